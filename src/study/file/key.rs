//! The settings of a study: one scalar each, any of them an axis of the grid.

use super::Scalar;
use crate::names::named_enum;

named_enum! {
    /// A setting. The grid's axes are in this order, the first one slowest.
    Key, "setting" {
        /// A label for the claim or case.
        Claim = "claim",
        /// The plant.
        Plant = "plant",
        /// Reading E1.
        Numerator = "numerator",
        /// Order of random plants.
        PlantOrder = "plant_order",
        /// Radius of the disc of random poles.
        PoleRadius = "pole_radius",
        /// The initial state.
        X0 = "x0",
        /// The spread of the initial state.
        X0Deviation = "x0_deviation",
        /// The kind of input.
        Input = "input",
        /// The input's amplitude.
        Amplitude = "amplitude",
        /// Reading E5.
        Sequence = "sequence",
        /// The colour of the output noise.
        Noise = "noise",
        /// The feedback.
        Feedback = "feedback",
        /// Noise on the measured input.
        InputNoise = "input_noise",
        /// Noise on the states.
        ProcessNoise = "process_noise",
        /// Reading E7: over what.
        EtaOver = "eta_over",
        /// Reading E7: of which output.
        EtaOf = "eta_of",
        /// The noise level.
        Eta = "eta",
        /// The estimators' order.
        Order = "order",
        /// l, where the window is N = 3n + 2l.
        L = "l",
        /// The window N.
        Window = "window",
        /// The record's length K.
        Horizon = "horizon",
        /// The observer's gain, reading E8.
        Gain = "gain",
        /// Where the observer starts.
        ObserverStart = "observer_start",
        /// From which sample on the state's errors are taken.
        ScoredFrom = "scored_from",
        /// Continuous time: the disturbance.
        Disturbance = "disturbance",
        /// Continuous time: its level.
        Level = "level",
        /// Continuous time: its frequency.
        Frequency = "frequency",
        /// Continuous time: its phase.
        Phase = "phase",
        /// Continuous time: the hold of white noise.
        NoiseHold = "noise_hold",
        /// Continuous time: a factor on adaptation gains.
        GainScale = "gain_scale",
        /// Continuous time: the longest step.
        Step = "step",
    }
}

/// "the plant's", "as stated": settings whose default follows from others.
pub const AUTOMATIC: &str = "auto";

/// The settings of a study in continuous time.
const CONTINUOUS: [Key; 9] = [
    Key::Claim,
    Key::Plant,
    Key::Disturbance,
    Key::Level,
    Key::Frequency,
    Key::Phase,
    Key::NoiseHold,
    Key::GainScale,
    Key::Step,
];

impl Key {
    /// Whether a study in continuous time, or in discrete time, has the setting.
    pub fn is_of(self, continuous: bool) -> bool {
        let shared = matches!(self, Self::Claim | Self::Plant);
        shared || CONTINUOUS.contains(&self) == continuous
    }

    /// The value where a file of that kind says nothing.
    pub fn default_of(self, continuous: bool) -> Option<Scalar> {
        match self {
            _ if !self.is_of(continuous) => None,
            Self::Plant if continuous => Some(Scalar::Text("bobtsov2023".to_owned())),
            _ => self.default(),
        }
    }

    /// What the setting means, with its unit and what it may be.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Claim => "label of the cell, such as C2",
            Self::Plant => {
                "\"nikolov2023\", \"random\" or a name in [plants]; in continuous time \"bobtsov2023\" or a name in \
                 [continuous_plants]"
            }
            Self::Numerator => {
                "reading E1 of nikolov2023: \"state-space\" or \"transfer-function\""
            }
            Self::PlantOrder => "order n of random plants, a new one in every trial",
            Self::PoleRadius => {
                "poles of random plants are uniform on the disc of this radius, in (0, 1)"
            }
            Self::X0 => {
                "initial state: one number for every component, or \"plant\" for x0 of [plants.NAME]"
            }
            Self::X0Deviation => {
                "standard deviation of every component of the initial state about x0, in open loop"
            }
            Self::Input => {
                "\"signs\" (random, +-amplitude) or \"gaussian\" (of that standard deviation)"
            }
            Self::Amplitude => {
                "amplitude of the input, or of the reference r where there is feedback"
            }
            Self::Sequence => "reading E5: \"independent\" or \"periodic-127\"",
            Self::Noise => {
                "colour of the output noise: \"ar\" (1/A of the plant), \"white\" or a name in [noises]"
            }
            Self::Feedback => "\"none\" or a name in [feedbacks]",
            Self::InputNoise => {
                "noise on the measured input, per cent of the input's standard deviation"
            }
            Self::ProcessNoise => {
                "standard deviation of white noise on every state in each step, in open loop"
            }
            Self::EtaOver => {
                "reading E7: \"exact\" (in the window) or \"nominal\" (of the processes)"
            }
            Self::EtaOf => "reading E7: sigma_y of the \"noise-free\" or the \"measured\" output",
            Self::Eta => "noise level 100 sigma_f / sigma_y, per cent",
            Self::Order => "order n of the estimators; \"auto\": the plant's",
            Self::L => "l >= 0 where the window is N = 3n + 2l, instead of window",
            Self::Window => "the window N, samples, at least 3n",
            Self::Horizon => "the record's length K, samples; \"auto\": max(400, N + 200)",
            Self::Gain => "reading E8: \"dead-beat\", \"scaled:RHO\" or \"poles:LIST\"",
            Self::ObserverStart => "the observer starts from \"x0-hat\" or from \"zero\"",
            Self::ScoredFrom => {
                "the state's errors are taken from the \"window\" on (k >= N) or from the \"start\" (k >= 0)"
            }
            Self::Disturbance => {
                "disturbance of a continuous-time output: \"none\", \"constant\", \"ramp\", \"sine\", \"square\", \
                 \"white\" or a name in [signals]"
            }
            Self::Level => "factor on the disturbance: its amplitude, slope or standard deviation",
            Self::Frequency => "frequency of a sine or square disturbance, rad/s",
            Self::Phase => {
                "phase of a sine or square disturbance, rad; \"random\": uniform, a new one in every trial"
            }
            Self::NoiseHold => {
                "seconds for which a number of white noise is held: its bandwidth is 1/(2 hold) Hz"
            }
            Self::GainScale => "factor on the adaptation gains of every observer",
            Self::Step => "longest step of the integration, seconds",
        }
    }

    /// The value where a file says nothing; `None` for `l`, which stands instead of `window`.
    pub fn default(self) -> Option<Scalar> {
        let text = |text: &str| Some(Scalar::Text(text.to_owned()));
        let number = |x: f64| Some(Scalar::Number(x));
        match self {
            Self::Claim => text(""),
            Self::Plant => text("nikolov2023"),
            Self::Numerator => text("state-space"),
            Self::PlantOrder => number(2.0),
            Self::PoleRadius => number(0.9),
            Self::Input => text("signs"),
            Self::Amplitude | Self::Eta => number(10.0),
            Self::Sequence => text("independent"),
            Self::Noise => text("ar"),
            Self::Feedback => text("none"),
            Self::InputNoise | Self::X0Deviation | Self::ProcessNoise | Self::Phase => number(0.0),
            Self::EtaOver => text("exact"),
            Self::EtaOf => text("noise-free"),
            Self::Order | Self::Horizon => text(AUTOMATIC),
            Self::L => None,
            Self::Window => number(98.0),
            Self::Gain => text("dead-beat"),
            Self::ObserverStart => text("x0-hat"),
            Self::ScoredFrom => text("window"),
            Self::Disturbance => text("sine"),
            Self::Level => number(0.3),
            Self::X0 | Self::Frequency | Self::GainScale => number(1.0),
            Self::NoiseHold | Self::Step => number(0.01),
        }
    }

    /// Whether a resolved file leaves the setting out where it has its default: settings that came later, so that the
    /// designs of older results, which do not have them, stay the same.
    pub const fn is_left_out(self) -> bool {
        matches!(
            self,
            Self::X0Deviation | Self::ProcessNoise | Self::ScoredFrom
        )
    }

    /// Whether the setting is a whole number of something.
    pub const fn is_count(self) -> bool {
        matches!(
            self,
            Self::PlantOrder | Self::Order | Self::L | Self::Window | Self::Horizon
        )
    }

    /// Whether results have a column of this setting even where it does not vary.
    pub const fn is_always_a_column(self) -> bool {
        matches!(self, Self::Claim | Self::Eta | Self::Window)
    }
}
