//! The smaller tables of an experiment file.

use crate::design::file::table::tables;
use crate::design::file::{Axis, HoldName, Key, Scalar};
use crate::design::{LoopModel, Measure};
use asobench_identification::metric::SlopeOf;
use asobench_identification::model::{LinearModel, Orders};
use asobench_identification::plant::{ContinuousPlant, OwnStates, StateSpace};
use asobench_identification::text::number;
use std::collections::BTreeMap;

tables! {
    /// A plant: the polynomials A, B, F of `A(q) y = B(q)/F(q) u` in the usual notation, the paper's a with b or h, or
    /// a transfer function in s with a sampling time.
    #[serde(expecting = "a table [plants.NAME]")]
    pub struct PlantTable: Default {
        /// `A = [1, a_1, ..., a_na]` in q^-1, such as `[1, -1.5, 0.7]`; 1 if absent.
        #[serde(rename = "A")]
        output_polynomial?: Option<Vec<f64>>,
        /// `B = [0, b_1, ...]` in q^-1: as many zeros as samples of delay, at least one.
        #[serde(rename = "B")]
        input_polynomial?: Option<Vec<f64>>,
        /// `F = [1, f_1, ..., f_nf]` in q^-1; 1 if absent.
        #[serde(rename = "F")]
        transfer_polynomial?: Option<Vec<f64>>,
        /// Last row of the matrix A, `a_1 ... a_n`: `a_i` is minus the coefficient of `q^-(n+1-i)` in `A(q)`.
        a?: Option<Vec<f64>>,
        /// Input vector b: the first n samples of the impulse response.
        b?: Option<Vec<f64>>,
        /// Numerator h of W(z), instead of b: `h_i` is the coefficient of `q^-i` in `B(q)`.
        h?: Option<Vec<f64>>,
        /// Numerator in s, the highest power first, as in MATLAB's `tf`; with `den` and `Ts`.
        num?: Option<Vec<f64>>,
        /// Denominator in s, the highest power first.
        den?: Option<Vec<f64>>,
        /// Zeros in rad/s, instead of `num`, as in MATLAB's `zpk`: numbers, or texts such as "-1+2i"; none if absent.
        zeros?: Option<Vec<Scalar>>,
        /// Poles in rad/s, instead of `den`; with `gain` and `Ts`.
        poles?: Option<Vec<Scalar>>,
        /// The factor k of `k (s - z_1) ... / ((s - p_1) ...)`.
        gain?: Option<f64>,
        /// The sampling time in seconds of a plant in s.
        #[serde(rename = "Ts")]
        sampling_time?: Option<f64>,
        /// The delay in seconds of a plant in s, a multiple of `Ts` or not; 0 if absent.
        delay?: Option<f64>,
        /// The hold of u(t) between two samples of a plant in s: "zero" (the last sample) or "linear".
        hold?: Option<HoldName>,
        /// Instead of all these: matrices in states of the plant's own, in discrete time or, with `Ts`, sampled.
        states?: Option<StatesTable>,
        /// Initial state, used if the setting x0 is "plant", in the plant's own states where it has a table of them.
        x0?: Option<Vec<f64>>,
        /// Whether the plant is meant to be unstable.
        unstable: bool,
    }

    /// A plant in states of its own, z(k+1) = A z(k) + B u(k), y(k) = C z(k); with `Ts` z' = A z + B u, sampled with u
    /// held. Errors are measured of the states x = (C z, C A z, ..., C A^(n-1) z), A that of one sample to the next.
    pub struct StatesTable {
        /// A, n rows of n numbers.
        #[serde(rename = "A")]
        a: Vec<Vec<f64>>,
        /// B, n numbers.
        #[serde(rename = "B")]
        b: Vec<f64>,
        /// C, n numbers.
        #[serde(rename = "C")]
        c: Vec<f64>,
        /// The sampling time in seconds of a plant in continuous time.
        #[serde(rename = "Ts")]
        sampling_time?: Option<f64>,
    }

    /// Covariances of white Gaussian noise: w in the plant's states, x(k+1) = A x(k) + b u(k) + w(k), and v in its
    /// output, y(k) = C x(k) + v(k). The states are those of `[plants.NAME.states]`; of other plants x, with x_1 = y.
    pub struct CovariancesTable: Default {
        /// E[w w'], n rows of n numbers; of a plant sampled from its own states the intensity in continuous time, of
        /// which Van Loan's integral is taken.
        #[serde(rename = "Q")]
        process?: Option<Vec<Vec<f64>>>,
        /// Instead of `Q`: n numbers, Q = variance G G'.
        #[serde(rename = "G")]
        channel?: Option<Vec<f64>>,
        /// The variance of the noise that enters through `G`; of a plant sampled from its own states its intensity.
        variance?: Option<f64>,
        /// Instead of `Q`: the standard deviation s of white noise on the plant's input, held as the input is: the
        /// covariance s^2 b b'.
        input?: Option<f64>,
        /// E[v v], the variance of white measurement noise; with `eta = 0` and `noise = "white"`. Without it the
        /// measurement noise is that of `eta` and `noise`.
        #[serde(rename = "R")]
        measurement?: Option<f64>,
        /// E[w v], n numbers, of a sampled plant too; beside `R`.
        #[serde(rename = "S")]
        cross?: Option<Vec<f64>>,
    }

    /// A change of the plant during the record, in open loop: to another plant, or by factors. Its last row of A and b
    /// step at sample `at`, or move from there along straight lines.
    #[derive(Default)]
    #[serde(expecting = "a table [changes.NAME]")]
    pub struct ChangeTable {
        /// The sample k of the step, or the last one before the drift: the first new state is x(k + 1).
        at: usize,
        /// The samples that the drift takes; 0 (the default): a step.
        #[serde(default)]
        over: usize,
        /// The plant that it becomes, of the same order: as in the setting `plant`, but "random".
        plant?: Option<String>,
        /// Instead of a plant: the factor on b.
        gain?: Option<f64>,
        /// Instead of a plant: the factor on all poles.
        poles?: Option<f64>,
    }

    /// A noise filter of white noise: the polynomials `C/D`, or numerator and denominator.
    #[serde(expecting = "a table [noises.NAME]")]
    pub struct NoiseTable: Default {
        /// `C = [1, c_1, ..., c_nc]` in q^-1; 1 if absent.
        #[serde(rename = "C")]
        moving_average?: Option<Vec<f64>>,
        /// `D = [1, d_1, ..., d_nd]` in q^-1; 1 if absent.
        #[serde(rename = "D")]
        autoregression?: Option<Vec<f64>>,
        /// `c_0 ... c_q`, with any first coefficient.
        numerator?: Option<Vec<f64>>,
        /// `1, d_1 ... d_p`; 1 if absent.
        denominator?: Option<Vec<f64>>,
        /// The white noise is drawn with replacement from a column of a CSV file, "file:PATH#COLUMN", its mean
        /// subtracted and its variance made 1; Gaussian if absent.
        residuals?: Option<String>,
        /// The white noise has heavy tails: Student's t with so many degrees of freedom, 3 to 100, scaled to variance
        /// 1; Gaussian if absent.
        student_t?: Option<u16>,
        /// The white noise has outliers: `{ share = 0.05, scale = 10 }`, normal numbers of which this share is so many
        /// times as large, all scaled to variance 1.
        outliers?: Option<OutlierTable>,
    }

    /// Outliers of a noise.
    pub struct OutlierTable {
        /// Their share, between 0 and 1.
        share: f64,
        /// Their standard deviation over that of the others.
        scale: f64,
    }

    /// A feedback: of the measured output, `u(k) = -K(q) y(k) + r(k)`, or of the adaptive observer's state,
    /// `u(k) = -k'xhat(k) + r(k)` after the first `identify` samples.
    #[serde(expecting = "a table [feedbacks.NAME]")]
    pub struct FeedbackTable {
        /// Numerator of K(q): `c_0 ... c_q`; one number is a static gain.
        numerator?: Option<Vec<f64>>,
        /// Denominator of K(q): `1, d_1 ... d_p`.
        denominator?: Option<Vec<f64>>,
        /// State feedback: k, one number per state.
        state_gain?: Option<Vec<f64>>,
        /// State feedback: samples of the open loop from which the observer's model is identified.
        identify?: Option<usize>,
        /// State feedback: "identified" (the default), or "true" for the plant itself as the observer's model, after
        /// the same samples in open loop.
        model?: Option<LoopModel>,
        /// The reference's amplitude instead of the setting `amplitude`; 0 is r = 0, with state feedback once the
        /// loop is closed.
        reference?: Option<f64>,
    }

    /// A log-log slope: of a statistic of a measure over an axis, for every output and every value of the other axes.
    pub struct SlopeTable {
        /// The measure.
        #[serde(rename(serialize = "figure"), alias = "figure")]
        measure: Measure,
        /// The axis.
        over: Key,
        /// "median" or "rmse".
        #[serde(default)]
        statistic: SlopeOf,
        /// Only cells from this value of the axis on.
        #[serde(default)]
        from: f64,
    }

    /// The changes that `--quick` makes.
    pub struct QuickTable {
        /// Trials in each cell.
        trials: u64,
        /// Settings instead of the file's.
        #[serde(default)]
        settings: BTreeMap<Key, Axis>,
    }
}

impl PlantTable {
    /// The largest order that the lengths of its lists can mean.
    pub(crate) fn order(&self) -> usize {
        let longest = |lists: &[&Option<Vec<f64>>]| {
            let lengths = lists.iter().map(|list| list.as_ref().map_or(0, Vec::len));
            lengths.max().unwrap_or(0)
        };
        let rows = longest(&[&self.a, &self.b, &self.h, &self.x0]);
        let discrete = longest(&self.polynomials()).saturating_sub(1).max(rows);
        let own = self.states.as_ref().map_or(0, |states| states.a.len());
        discrete.max(self.order_in_s()).max(own)
    }

    fn polynomials(&self) -> [&Option<Vec<f64>>; 3] {
        [
            &self.output_polynomial,
            &self.input_polynomial,
            &self.transfer_polynomial,
        ]
    }

    /// Returns the plant, from the notation in which it is given.
    pub(crate) fn plant(&self) -> Result<StateSpace, String> {
        let polynomials = self.polynomials().into_iter().any(Option::is_some);
        let rows = [&self.a, &self.b, &self.h].into_iter().any(Option::is_some);
        if let Some(states) = &self.states {
            if polynomials || rows || self.is_in_s() {
                return Err("states beside polynomials, a, b, h or a plant in s; expected one of them".to_owned());
            }
            let plant = states.own()?.canonical();
            return plant.ok_or_else(|| "states: the sampled matrices are not finite".to_owned());
        }
        match (polynomials, rows, self.is_in_s()) {
            (true, false, false) => self.plant_of_polynomials(),
            (false, false, true) => {
                let [a, b] = self.sampled()?;
                let sampled = Self {
                    output_polynomial: Some(a),
                    input_polynomial: Some(b),
                    ..Self::default()
                };
                sampled.plant_of_polynomials()
            }
            (false, true, false) => match (&self.a, &self.b, &self.h) {
                (Some(a), Some(b), None) => StateSpace::new(a.clone(), b.clone()).map_err(|e| e.to_string()),
                (Some(a), None, Some(h)) => {
                    StateSpace::from_transfer_function(a.clone(), h.clone()).map_err(|e| e.to_string())
                }
                _ => Err("expected a, and either b or h beside it".to_owned()),
            },
            (false, false, false) => Err(
                "expected the polynomials A = [1, ...] and B = [0, ...], or a with b or h, or num, den and Ts"
                    .to_owned(),
            ),
            _ => Err(
                "both the polynomials A, B, F and the paper's a, b, h, or either and a plant in s (num, den, Ts); \
                 expected one of them"
                    .to_owned(),
            ),
        }
    }

    fn plant_of_polynomials(&self) -> Result<StateSpace, String> {
        let b = self.input_polynomial.as_deref().unwrap_or(&[]);
        let delay = b.iter().take_while(|b| **b == 0.0).count();
        if b.len() < 2 || delay == b.len() {
            return Err("B: expected B = [0, b_1, ...] with a coefficient that is not 0".to_owned());
        }
        if delay == 0 {
            return Err(format!(
                "B: its first number is {}; expected 0, a delay of at least one sample: B = [0, b_1, ...]",
                number(b[0])
            ));
        }
        let model = LinearModel {
            a: monic("A", self.output_polynomial.as_deref())?,
            f: monic("F", self.transfer_polynomial.as_deref())?,
            b: b.to_vec(),
            delay,
            ..LinearModel::zero(Orders::default())
        };
        let plant = model.plant();
        plant.ok_or_else(|| "a plant's coefficients must be finite numbers".to_owned())
    }
}

impl StatesTable {
    /// Returns the plant in its own states.
    pub(crate) fn own(&self) -> Result<OwnStates, String> {
        let plant = ContinuousPlant::new(&self.a, self.b.clone(), self.c.clone());
        let plant = plant.map_err(|error| format!("states: {error}"))?;
        match self.sampling_time {
            None => Ok(OwnStates::discrete(&plant)),
            Some(time) if time > 0.0 && time.is_finite() => Ok(OwnStates::sampled(&plant, time)),
            Some(time) => Err(format!(
                "states.Ts: {}; expected a sampling time above 0, in seconds",
                number(time)
            )),
        }
    }
}

/// Checks a polynomial whose first coefficient is 1; returns 1 if it is absent.
fn monic(name: &str, given: Option<&[f64]>) -> Result<Vec<f64>, String> {
    match given {
        None => Ok(vec![1.0]),
        Some([first, ..]) if *first == 1.0 => Ok(given.unwrap_or_default().to_vec()),
        Some([]) => Err(format!("{name}: an empty list; expected {name} = [1, ...]")),
        Some([first, ..]) => Err(format!(
            "{name}: its leading coefficient is {}; expected 1: {name} = [1, ...]",
            number(*first)
        )),
    }
}

impl NoiseTable {
    /// Returns the table as a resolved file has it, with numerator and denominator.
    pub(crate) fn resolve(self) -> Result<Self, String> {
        let Self {
            moving_average: c,
            autoregression: d,
            numerator,
            denominator,
            residuals,
            student_t,
            outliers,
        } = self;
        let laws = [residuals.is_some(), student_t.is_some(), outliers.is_some()];
        let laws = laws.into_iter().filter(|is| *is).count();
        if laws > 1 {
            let given = "two of residuals, student_t, outliers are given; expected one of them";
            return Err(given.to_owned());
        }
        let polynomials = c.is_some() || d.is_some();
        let (numerator, denominator) = match (polynomials, numerator, denominator) {
            (true, None, None) => (monic("C", c.as_deref())?, monic("D", d.as_deref())?),
            (false, Some(numerator), denominator) => (numerator, denominator.unwrap_or_else(|| vec![1.0])),
            (true, _, _) => {
                return Err("both C, D and numerator, denominator are given; expected one pair of them".to_owned());
            }
            (false, None, None) if laws > 0 => (vec![1.0], vec![1.0]),
            (false, None, _) => {
                return Err("expected C = [1, ...] and D = [1, ...], or numerator".to_owned());
            }
        };
        Ok(Self {
            numerator: Some(numerator),
            denominator: Some(denominator),
            residuals,
            student_t,
            outliers,
            ..Self::default()
        })
    }

    /// Whether the white noise is not Gaussian.
    pub(crate) fn has_law(&self) -> bool {
        self.residuals.is_some() || self.student_t.is_some() || self.outliers.is_some()
    }

    /// Returns numerator and denominator of a resolved table.
    pub(crate) fn filter(&self) -> (&[f64], &[f64]) {
        let numerator = self.numerator.as_deref().unwrap_or(&[1.0]);
        (numerator, self.denominator.as_deref().unwrap_or(&[1.0]))
    }
}

impl SlopeTable {
    /// Checks that the setting has values over which to take a slope.
    pub(crate) fn check(&self, settings: &BTreeMap<Key, Axis>) -> Result<(), String> {
        let Self { over, from, .. } = self;
        let Some(Axis::Many(values)) = settings.get(over) else {
            return Err(format!("'{over}' has no list in [settings]"));
        };
        let taken = |value: &&Scalar| match value {
            Scalar::Number(number) => number >= from,
            Scalar::Text(_) => true,
        };
        let positive = |value: &Scalar| matches!(value, Scalar::Number(number) if *number > 0.0);
        let taken: Vec<&Scalar> = values.iter().filter(taken).collect();
        if taken.len() < 2 || !taken.into_iter().all(positive) {
            return Err(format!(
                "'{over}' must have at least two values from {from} on, all of them numbers above 0"
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plant(text: &str) -> Result<StateSpace, String> {
        let table: PlantTable = toml::from_str(text).unwrap();
        table.plant()
    }

    /// `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)` in every notation; b is the impulse response, by hand.
    #[test]
    fn a_plant_is_the_same_in_every_notation() {
        let expected = StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap();
        for text in [
            "A = [1, -1.5, 0.7]\nB = [0, 1, 0.5]",
            "F = [1, -1.5, 0.7]\nB = [0, 1, 0.5]",
            "a = [-0.7, 1.5]\nh = [1, 0.5]",
            "a = [-0.7, 1.5]\nb = [1, 2]",
        ] {
            assert_eq!(plant(text).unwrap(), expected, "{text}");
        }
        // (1 - 0.5 q^-1)(1 - 0.25 q^-1), and a delay of two samples.
        let product = plant("A = [1, -0.5]\nF = [1, -0.25]\nB = [0, 0, 1]").unwrap();
        assert_eq!(product.a(), [-0.125, 0.75]);
        assert_eq!(product.h(), [0.0, 1.0]);
    }

    #[test]
    fn mistakes_in_a_plant_are_told() {
        for (text, part) in [
            ("A = [2, -1]\nB = [0, 1]", "A: its leading coefficient is 2; expected 1"),
            ("A = []\nB = [0, 1]", "A: an empty list"),
            ("A = [1, -0.5]\nB = [1, 0.5]", "B: its first number is 1; expected 0"),
            ("A = [1, -0.5]", "B: expected B = [0, b_1, ...]"),
            ("A = [1, -0.5]\nB = [0, 0]", "B: expected B = [0, b_1, ...]"),
            ("A = [1, -0.5]\nB = [0, 1]\na = [0.5]\nb = [1]", "both the polynomials"),
            ("a = [0.5]", "either b or h"),
            ("x0 = [0]", "expected the polynomials"),
        ] {
            let error = plant(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn noise_as_polynomials_or_as_a_filter() {
        let noise = |text: &str| toml::from_str::<NoiseTable>(text).unwrap().resolve();
        let same = noise("numerator = [1, 0.5]\ndenominator = [1, -0.9]").unwrap();
        assert_eq!(noise("C = [1, 0.5]\nD = [1, -0.9]").unwrap(), same);
        assert_eq!(same.clone().resolve().unwrap(), same);
        assert_eq!(noise("D = [1, -0.9]").unwrap().filter(), (&[1.0][..], &[1.0, -0.9][..]));
        for (text, part) in [
            ("C = [2, 1]", "C: its leading coefficient is 2"),
            ("C = [1]\nnumerator = [1]", "both"),
            ("denominator = [1, 0.5]", "expected C"),
        ] {
            assert!(noise(text).unwrap_err().contains(part), "{text}");
        }
    }
}
