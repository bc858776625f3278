//! The settings of a study. Each is a scalar and may be an axis of the grid. Each has one entry of one table.

use crate::design::file::Scalar;
use Given::{Number, Text};
use InWords::{Template, Words};
use asobench_identification::names::named_table;

/// The kind of plants that a study simulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudyKind {
    /// Plants in discrete time, with methods.
    Discrete,
    /// Plants in continuous time, with observers.
    Continuous,
}

impl StudyKind {
    /// Returns its name in sentences: "discrete".
    pub const fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        }
    }
}

/// Which studies have a setting or a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Time {
    Discrete,
    Continuous,
    Both,
}

impl Time {
    /// Whether studies of this kind have it.
    pub(crate) const fn is_of(self, kind: StudyKind) -> bool {
        match self {
            Self::Discrete => matches!(kind, StudyKind::Discrete),
            Self::Continuous => matches!(kind, StudyKind::Continuous),
            Self::Both => true,
        }
    }
}

/// A default value.
#[derive(Clone, Copy)]
enum Given {
    Nothing,
    Text(&'static str),
    Number(f64),
}

/// How a value is put into words.
#[derive(Clone, Copy)]
enum InWords {
    /// As the setting's name and the value.
    Named,
    /// With the value instead of {}.
    Template(&'static str),
    /// By a rule of its own.
    Words(fn(&str) -> String),
}

/// The properties of a setting, other than its name and description.
#[expect(clippy::struct_excessive_bools, reason = "each is one property")]
pub struct Entry {
    /// The value if a file gives none.
    default: Given,
    /// The default in continuous time, if it differs.
    default_in_continuous: Option<&'static str>,
    time: Time,
    /// The heading of a table's column; the setting's name if empty.
    title: &'static str,
    /// The unit beside the heading.
    pub unit: &'static str,
    /// The label of an axis, with its unit; heading and unit if empty.
    axis: &'static str,
    words: InWords,
    /// Shortens a value for the ticks of an axis of names.
    pub tick: fn(&str) -> &str,
    /// The setting's rank among those that may be the axis of a picture.
    pub along: usize,
    /// The setting's rank among those that get panels of a picture; the last are held at one value.
    pub held: usize,
    /// Whether a resolved file omits the setting if it has its default.
    pub left_out: bool,
    /// Whether the value is a count, a whole number.
    pub count: bool,
    /// Whether results have a column of the setting even if it does not vary.
    pub column: bool,
    /// Whether the setting is a reading of the paper, named only if it is not the default.
    pub reading: bool,
    /// Whether the setting changes only the observer, and no parameter.
    pub of_observer: bool,
}

const DISCRETE: Entry = Entry {
    default: Given::Nothing,
    default_in_continuous: None,
    time: Time::Discrete,
    title: "",
    unit: "",
    axis: "",
    words: InWords::Named,
    tick: |value| value,
    along: usize::MAX,
    held: usize::MAX,
    left_out: false,
    count: false,
    column: false,
    reading: false,
    of_observer: false,
};

const CONTINUOUS: Entry = Entry {
    time: Time::Continuous,
    ..DISCRETE
};

// Each returns the entry with one more property.
impl Entry {
    const fn text(mut self, default: &'static str) -> Self {
        self.default = Text(default);
        self
    }

    const fn number(mut self, default: f64) -> Self {
        self.default = Number(default);
        self
    }

    const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    const fn axis(mut self, label: &'static str) -> Self {
        self.axis = label;
        self
    }

    const fn words(mut self, template: &'static str) -> Self {
        self.words = Template(template);
        self
    }

    const fn held(mut self, rank: usize) -> Self {
        self.held = rank;
        self
    }

    const fn left_out(mut self) -> Self {
        self.left_out = true;
        self
    }

    const fn count(mut self) -> Self {
        self.count = true;
        self
    }

    const fn column(mut self) -> Self {
        self.column = true;
        self
    }

    const fn reading(mut self) -> Self {
        self.reading = true;
        self
    }
}

named_table! {
    /// A setting. The grid's axes are in this order, the first one slowest.
    Key, "setting", Entry {
        /// label of the cell, such as C2
        Claim = "claim": Entry {
            time: Time::Both,
            along: 2,
            ..DISCRETE.text("").words("{}").held(1).column()
        },
        /// "nikolov2023", "random" or a name in `[plants]`; in continuous time "bobtsov2023" or a
        /// name in `[continuous_plants]`
        Plant = "plant": Entry {
            default_in_continuous: Some("bobtsov2023"),
            time: Time::Both,
            ..DISCRETE.text("nikolov2023")
        },
        /// how the plant changes during the record: "none" or a name in `[changes]`
        Change = "change": Entry {
            words: Words(change_words),
            ..DISCRETE.text("none").held(1).left_out()
        },
        /// reading E1 of nikolov2023: "state-space" or "transfer-function"
        Numerator = "numerator": DISCRETE.text("state-space").words("{} numerator").reading(),
        /// order n of random plants, a new one in every trial
        PlantOrder = "plant_order": DISCRETE
            .number(2.0)
            .axis("order n of the plant")
            .words("plant's n = {}")
            .held(3)
            .count(),
        /// poles of random plants are uniform on the disc of this radius, in (0, 1)
        PoleRadius = "pole_radius": DISCRETE.number(0.9).axis("largest pole radius").words("poles within {}").held(5),
        /// initial state: one number for every component, or "plant" for x0 of `[plants.NAME]`
        X0 = "x0": DISCRETE.number(1.0).axis("x0, every component").words("x0 = {}").held(5),
        /// standard deviation of every component of the initial state about x0, in open loop
        X0Deviation = "x0_deviation": DISCRETE.number(0.0).words("x0 within {}").left_out(),
        /// "signs" (random, +-amplitude), "gaussian" (of that standard deviation), a name in `[inputs]`, one in
        /// `[noises]` (Gaussian through that filter, of that standard deviation), or
        /// "file:PATH#COLUMN" (the same samples in every trial; column u if none is named)
        Input = "input": DISCRETE.text("signs"),
        /// amplitude of the input, or of the reference r if there is feedback
        Amplitude = "amplitude": DISCRETE.number(10.0),
        /// reading E5: "independent", "periodic-127" or "held-127" (the last of 127 signs held)
        Sequence = "sequence": DISCRETE.text("independent").words("{} input").reading(),
        /// colour of the output noise: "ar" (1/A of the plant), "white" or a name in `[noises]`
        Noise = "noise": Entry {
            words: Words(noise_words),
            tick: noise,
            ..DISCRETE.text("ar").held(0)
        },
        /// "none" or a name in `[feedbacks]`
        Feedback = "feedback": DISCRETE.text("none").words("feedback {}").held(5),
        /// noise on the measured input, per cent of the input's standard deviation
        InputNoise = "input_noise": DISCRETE.number(0.0).unit("%").words("input noise {} %"),
        /// standard deviation of white noise on every state in each step, in open loop; or a name in `[covariances]`
        ProcessNoise = "process_noise": DISCRETE.number(0.0).words("process noise {}").left_out(),
        /// reading E7: "exact" (in the window), "window-alone" (and no noise after it) or "nominal" (of the processes);
        /// or "absolute": eta/100 is the standard deviation of the white noise before its filter, in units of y
        EtaOver = "eta_over": DISCRETE.text("exact").words("{} eta").reading(),
        /// reading E7: sigma_y of the "noise-free" or the "measured" output
        EtaOf = "eta_of": DISCRETE.text("noise-free").words("eta of the {} output").reading(),
        /// noise level 100 sigma_f / sigma_y, per cent
        Eta = "eta": Entry {
            along: 1,
            ..DISCRETE.number(10.0).unit("%").words("eta = {} %").held(4).column()
        },
        /// order n of the estimators; "auto": the plant's
        Order = "order": DISCRETE.text(AUTOMATIC).axis("order n of the estimator").words("n = {}").count(),
        /// the paper's l = 0, 1, 2, ...: the window is N = 3n + 2l; instead of window
        L = "l": DISCRETE.count(),
        /// the window N, samples: any whole number from 3n on, even or odd
        Window = "window": Entry {
            title: "N",
            along: 0,
            ..DISCRETE.number(98.0).unit("samples").words("N = {}").held(3).count().column()
        },
        /// the record's length K, samples; "auto": max(400, N + 200)
        Horizon = "horizon": DISCRETE.text(AUTOMATIC).count(),
        /// reading E8: "dead-beat", "scaled:RHO" or "poles:LIST"
        Gain = "gain": Entry {
            words: Words(gain_words),
            tick: gain,
            of_observer: true,
            ..DISCRETE.text("dead-beat").axis("poles of F over those of A")
        },
        /// the observer starts from "x0-hat" or from "zero"
        ObserverStart = "observer_start": Entry {
            of_observer: true,
            ..DISCRETE.text("x0-hat").words("start at {}").held(2)
        },
        /// the state's errors are taken from the "window" on (k >= N) or from the "start" (k >=
        /// 0)
        ScoredFrom = "scored_from": DISCRETE.text("window").words("scored from the {}").left_out(),
        /// the samples by which `fit_ahead` predicts y ahead
        Ahead = "ahead": DISCRETE.number(1.0).unit("samples").words("{} samples ahead").left_out().count(),
        /// disturbance of a continuous-time output: "none", "constant", "ramp", "sine", "square",
        /// "white" or a name in `[signals]`
        Disturbance = "disturbance": CONTINUOUS.text("sine").words("{} disturbance"),
        /// factor on the disturbance: its amplitude, slope or standard deviation
        Level = "level": CONTINUOUS.number(0.3).axis("level of the disturbance"),
        /// frequency of a sine or square disturbance, rad/s
        Frequency = "frequency": CONTINUOUS.number(1.0).axis("frequency, rad/s").words("{} rad/s"),
        /// phase of a sine or square disturbance, rad; "random": uniform, a new one in every
        /// trial
        Phase = "phase": CONTINUOUS.number(0.0).words("phase {}"),
        /// seconds for which a number of white noise is held: its bandwidth is 1/(2 hold) Hz
        NoiseHold = "noise_hold": CONTINUOUS.number(0.01).axis("hold of white noise, s").words("hold {} s"),
        /// factor on the adaptation gains of every observer
        GainScale = "gain_scale": CONTINUOUS.number(1.0).axis("factor on the adaptation gains").words("gains times {}"),
        /// longest step of the integration, seconds
        Step = "step": CONTINUOUS.number(0.01).axis("step, s").words("step {} s"),
    }
}

/// The value of settings whose default follows from others: "the plant's", "as stated".
pub const AUTOMATIC: &str = "auto";

/// Returns the common name of a noise.
fn noise(value: &str) -> &str {
    match value {
        "ar" => "1/A",
        "ma" => "MA",
        "arma" => "ARMA",
        _ => value,
    }
}

fn noise_words(value: &str) -> String {
    format!("{} noise", noise(value))
}

fn change_words(value: &str) -> String {
    match value {
        "none" => "no change".to_owned(),
        _ => format!("change {value}"),
    }
}

/// Shortens a gain to the factor on the poles.
fn gain(value: &str) -> &str {
    match value {
        "dead-beat" => "0",
        _ => value.strip_prefix("scaled:").unwrap_or(value),
    }
}

/// Describes a gain by the poles of F.
fn gain_words(value: &str) -> String {
    match value.strip_prefix("scaled:") {
        Some("1") => "no feedback (scaled:1)".to_owned(),
        Some(factor) => format!("poles {factor} times A's"),
        None => format!("{value} gain"),
    }
}

impl Key {
    /// Whether studies of this kind have the setting.
    pub const fn is_of(self, kind: StudyKind) -> bool {
        self.entry().time.is_of(kind)
    }

    /// Returns the value if a file of that kind gives none.
    pub fn default_of(self, kind: StudyKind) -> Option<Scalar> {
        let own = match kind {
            StudyKind::Discrete => None,
            StudyKind::Continuous => self.entry().default_in_continuous,
        };
        let own = own.map(|text| Scalar::Text(text.to_owned()));
        own.or_else(|| self.default()).filter(|_| self.is_of(kind))
    }

    /// Returns the value if a file gives none; `None` for `l`, which replaces `window`.
    pub fn default(self) -> Option<Scalar> {
        match self.entry().default {
            Given::Nothing => None,
            Text(text) => Some(Scalar::Text(text.to_owned())),
            Number(number) => Some(Scalar::Number(number)),
        }
    }

    /// Puts a value into words: "N = 98", "eta = 2 %", "white noise".
    pub fn words(self, value: &str) -> String {
        match self.entry().words {
            InWords::Named => format!("{self} {value}"),
            Template(template) => template.replace("{}", value),
            Words(words) => words(value),
        }
    }

    /// Returns the heading of a table's column, without its unit.
    pub fn title(self) -> String {
        match self.entry().title {
            "" => self.name().replace('_', " "),
            title => title.to_owned(),
        }
    }

    /// Returns the label of an axis of this setting, with its unit.
    pub fn axis_label(self) -> String {
        let Entry { axis, unit, .. } = self.entry();
        match (axis, unit) {
            ("", "") => self.title(),
            ("", unit) => format!("{}, {unit}", self.title()),
            (axis, _) => axis.to_owned(),
        }
    }

    /// Returns every setting, in the order in which they are used to tell cells apart.
    pub fn telling() -> impl Iterator<Item = Self> {
        const FIRST: [Key; 6] = [Key::Claim, Key::PlantOrder, Key::Order, Key::Window, Key::Eta, Key::L];
        let others = Self::ALL.iter().copied().filter(|key| !FIRST.contains(key));
        FIRST.into_iter().chain(others)
    }
}
