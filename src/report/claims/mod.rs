//! What the results say of every claim and erratum: explicit rules on numbers with their standard errors.
//!
//! A rule decides only where a 95 % interval excludes the alternative; where the interval holds both, or a
//! needed cell is missing, the verdict is "undecided", and says why.

mod accuracy;
mod closed_loop;
mod condition;
mod errata;
mod gpebo;
mod iteration;
mod noise;
mod observers;
mod solvers;
mod state;

pub(super) use closed_loop::bias_of;
use condition::condition;

use super::html::Verdict;
use super::number::{listed, uncertain};
use super::results::Study;
use crate::metric::{Quantile, Z};

/// A claim of the papers, or an erratum, with what the results say of it.
#[derive(Clone, Debug)]
pub struct Claim {
    /// Such as "C4" or "E2".
    pub id: &'static str,
    /// What is claimed.
    pub text: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// Why, in a sentence or more with the numbers behind it.
    pub because: String,
    /// The name of the study that decides; empty where none was run.
    pub experiment: String,
    /// What other studies add: their names, and the sentences of `because` that are theirs.
    pub parts: Vec<(String, String)>,
    /// The numbers behind the verdict: name, value, standard error (NaN where it has none).
    pub numbers: Vec<Number>,
}

impl Claim {
    /// Whether a study of the report speaks to it.
    pub fn is_judged(&self) -> bool {
        !self.experiment.is_empty()
    }
}

/// A number behind a verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// What it is.
    pub name: String,
    /// The value.
    pub value: f64,
    /// Its Monte-Carlo standard error.
    pub mcse: f64,
}

impl Number {
    fn new(name: impl Into<String>, value: f64, mcse: f64) -> Self {
        Self {
            name: name.into(),
            value,
            mcse,
        }
    }
}

/// What a rule finds, before it has a claim's name.
#[derive(Clone, Debug)]
struct Finding {
    verdict: Verdict,
    because: String,
    experiment: String,
    parts: Vec<(String, String)>,
    numbers: Vec<Number>,
}

impl Finding {
    fn new(study: &Study, verdict: Verdict, because: impl Into<String>) -> Self {
        Self {
            verdict,
            because: because.into(),
            experiment: study.name.clone(),
            parts: Vec::new(),
            numbers: Vec::new(),
        }
    }

    fn numbers(mut self, numbers: Vec<Number>) -> Self {
        self.numbers = numbers;
        self
    }

    /// The finding with a sentence that rests on another study.
    fn part(mut self, study: &str, sentence: &str) -> Self {
        if !sentence.trim().is_empty() {
            self.parts
                .push((study.to_owned(), sentence.trim().to_owned()));
        }
        self
    }

    /// The finding with a sentence in front: that on where a claim holds.
    fn led_by(mut self, sentence: &str) -> Self {
        let all = format!("{sentence} {}", self.because);
        all.trim().clone_into(&mut self.because);
        self
    }

    fn undecided(study: &Study, why: &str) -> Self {
        Self::new(study, Verdict::Undecided, why)
    }

    fn not_run(experiment: &str) -> Self {
        Self {
            verdict: Verdict::Undecided,
            because: format!("Not run: needs the experiment {experiment}."),
            experiment: String::new(),
            parts: Vec::new(),
            numbers: Vec::new(),
        }
    }
}

/// The studies of a report.
#[derive(Clone, Copy)]
struct Studies<'a>(&'a [Study]);

impl<'a> Studies<'a> {
    fn named(self, name: &str) -> Option<&'a Study> {
        let is = |study: &&Study| study.shipped.is_some_and(|of| of.name == name);
        self.0.iter().find(is)
    }
}

type Rule = fn(Studies<'_>) -> Finding;

const CLAIMS: [(&str, &str, Rule); 22] = [
    (
        "C1",
        "Without noise, N = 18: e_a, e_b and e_x are zero.",
        |s| accuracy::bounds(s, "C1"),
    ),
    (
        "C2",
        "eta = 10.018 %, N = 98: e_a < 0.033, e_b < 0.01, e_x < 0.065.",
        |s| accuracy::bounds(s, "C2"),
    ),
    (
        "C3",
        "eta = 10.014 %, N = 218: e_a < 0.017, e_b < 0.0057, e_x < 0.024 and about 0.01.",
        |s| accuracy::bounds(s, "C3"),
    ),
    (
        "C4",
        "Robustness to noise grows in proportion to N.",
        noise::rate,
    ),
    (
        "C5",
        "The iteration converges; four passes are enough.",
        iteration::four_passes,
    ),
    (
        "C6",
        "Two n x n inverses are cheaper than all other ways, whatever N is.",
        solvers::cost,
    ),
    (
        "C7",
        "In closed loop the method needs an external input; with it and white noise it is unbiased.",
        closed_loop::bias,
    ),
    (
        "C8",
        "Estimating x0 keeps the instruments good under non-zero initial conditions.",
        state::initial_state,
    ),
    (
        "C9",
        "The state estimate is good for poles of F at zero or inside those of A.",
        state::poles,
    ),
    (
        "E1",
        "Reading b from the printed W(z) gives the same errors.",
        |s| errata::setting(s, "E1"),
    ),
    (
        "E2",
        "Stage 10 as printed works as well as corrected.",
        |s| errata::method(s, "E2"),
    ),
    (
        "E3",
        "Eq. (7) as printed gives the same figures.",
        errata::printed_errors,
    ),
    (
        "E4",
        "b and x0 left at iteration 0 do as well as renewed ones.",
        |s| errata::method(s, "E4"),
    ),
    (
        "E5",
        "A PRBS of period 127 does as well as fresh random signs.",
        |s| errata::setting(s, "E5"),
    ),
    ("E7", "Other readings of eta give the same figures.", |s| {
        errata::setting(s, "E7")
    }),
    ("E8", "The observer's gain does not matter.", |s| {
        errata::setting(s, "E8")
    }),
    (
        "E11",
        "Five passes do as well as four.",
        errata::five_passes,
    ),
    (
        "E12",
        "An auxiliary model driven as an observer does as well as an open-loop one.",
        |s| errata::method(s, "E12"),
    ),
    (
        "B1",
        "The proposed estimate of theta is as fast as the gradient's and more exact.",
        gpebo::parameters,
    ),
    (
        "B2",
        "Both states: the proposed observer is better than with the gradient and than the full-order one.",
        gpebo::state,
    ),
    (
        "B3",
        "Nothing need be known of the disturbance but that it is small.",
        gpebo::no_information,
    ),
    (
        "K1",
        "With plant and noise known, no observer of the same information beats the Kalman filter.",
        observers::kalman,
    ),
];

/// Every claim and erratum with what these studies say of it.
pub fn claims(studies: &[Study]) -> Vec<Claim> {
    let claim = |(id, text, rule): &(&'static str, &'static str, Rule)| {
        let Finding {
            verdict,
            mut because,
            experiment,
            parts,
            numbers,
        } = rule(Studies(studies));
        for (_, sentence) in &parts {
            because.push(' ');
            because.push_str(sentence);
        }
        Claim {
            id,
            text,
            verdict,
            because,
            experiment,
            parts,
            numbers,
        }
    };
    CLAIMS.iter().map(claim).collect()
}

/// A ratio of two positive numbers with its 95 % interval, by the delta method for the logarithm. Outputs that
/// share their trials are taken as independent: the interval is then too wide rather than too narrow. Where a number has
/// no standard error the ratio has none, and NaN for its interval: its standing is open.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ratio {
    value: f64,
    mcse: f64,
    low: f64,
    high: f64,
}

/// How a ratio stands to 1, given how far from 1 is still the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    Same,
    Above,
    Below,
    Open,
}

/// Ratios within this factor of 1 are "the same": 5 %.
const MARGIN: f64 = 1.05;

impl Ratio {
    fn of(above: Quantile, below: Quantile) -> Option<Self> {
        let defined = above.value > 0.0 && below.value > 0.0;
        let value = above.value / below.value;
        let relative = (above.mcse / above.value).hypot(below.mcse / below.value);
        (defined && value.is_finite()).then(|| Self::with(value, relative))
    }

    /// Of a paired comparison.
    fn paired(ratio: Quantile) -> Option<Self> {
        let defined = ratio.value > 0.0 && ratio.value.is_finite();
        defined.then(|| Self::with(ratio.value, ratio.mcse / ratio.value))
    }

    fn with(value: f64, relative: f64) -> Self {
        let factor = (Z * relative).exp();
        Self {
            value,
            mcse: value * relative,
            low: value / factor,
            high: value * factor,
        }
    }

    fn standing(self) -> Standing {
        let Self { low, high, .. } = self;
        if low > MARGIN {
            Standing::Above
        } else if high < 1.0 / MARGIN {
            Standing::Below
        } else if low >= 1.0 / MARGIN && high <= MARGIN {
            Standing::Same
        } else {
            Standing::Open
        }
    }

    fn text(self) -> String {
        uncertain(self.value, self.mcse)
    }

    fn number(self, name: impl Into<String>) -> Number {
        Number::new(name, self.value, self.mcse)
    }
}

/// "all 4", "3 of 4", "none of 4".
fn count_of(count: usize, of: usize) -> String {
    match count {
        0 => format!("none of {of}"),
        _ if count == of => format!("all {of}"),
        _ => format!("{count} of {of}"),
    }
}

/// The verdict on a claim of several parts: those where it holds, where it does not, where that is open. It is
/// refuted where no part holds and at least half of the parts are known not to.
fn settle(holds: usize, fails: usize, open: usize) -> Verdict {
    match (holds, fails, open) {
        (0, 0, _) => Verdict::Undecided,
        (_, 0, 0) => Verdict::Holds,
        (0, fails, open) if fails >= open => Verdict::DoesNotHold,
        (0, _, _) | (_, 0, _) => Verdict::Undecided,
        _ => Verdict::HoldsOnlyIf,
    }
}
