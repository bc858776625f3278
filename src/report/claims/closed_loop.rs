//! C7: closed loop.
//!
//! A coefficient is biased where the mean of its signed error (the median where the tail is heavy) is more than
//! three standard errors from 0 and more than a tenth of its standard deviation (of its interquartile range over
//! 1.349): three, so that twelve coefficients of an unbiased estimate all pass with 97 %; a tenth, because smaller
//! a bias is less than 1 % of the mean square error. A cell without external input is lost where no more than half
//! of its trials have an e_a below 1 (the interval of the median decides).

use super::{Finding, Number, Studies, condition, count_of};
use crate::metric::Statistics;
use crate::report::html::Verdict;
use crate::report::number::uncertain;
use crate::report::results::{Study, median, shown, words};
use crate::study::file::Key;
use crate::study::{CellSummary, Measure, OutputSummary};

/// Standard errors, and standard deviations, beyond which a coefficient is biased.
const ERRORS: f64 = 3.0;
const DEVIATIONS: f64 = 0.1;

/// Bias and scatter of one coefficient, by quantiles where one trial dominates the moments.
pub(in crate::report) fn bias_of(of: &Statistics) -> (f64, f64, f64) {
    if of.dominated || !of.mean.value.is_finite() {
        (
            of.q50.value,
            of.q50.mcse,
            (of.q75.value - of.q25.value) / 1.349,
        )
    } else {
        (of.mean.value, of.mean.mcse, of.sd.value)
    }
}

/// Whether any coefficient is biased; `None` where coefficients are missing or too few trials tell.
fn biased(output: &OutputSummary) -> Option<bool> {
    let mut open = output.parameters.is_empty();
    for (_, of) in &output.parameters {
        let (bias, error, scatter) = bias_of(of);
        if bias.abs() > ERRORS * error && bias.abs() > DEVIATIONS * scatter {
            return Some(true);
        }
        // Unbiased is said only where a bias that counts would have been seen.
        open |= !(bias.abs() + 1.96 * error < 2.0 * DEVIATIONS * scatter);
    }
    (!open).then_some(false)
}

/// The coefficient with the largest bias in standard deviations.
fn worst(output: &OutputSummary) -> Option<(String, f64, f64)> {
    let relative = |(name, of): &(String, Statistics)| {
        let (bias, error, scatter) = bias_of(of);
        (name.clone(), bias / scatter, error / scatter)
    };
    output
        .parameters
        .iter()
        .map(relative)
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Whether a cell's loop has no external input.
fn without_input(study: &Study, cell: &CellSummary) -> bool {
    let feedback = study.file.feedbacks.get(&cell.setting(Key::Feedback));
    feedback.is_some_and(|table| table.reference == Some(0.0))
}

/// Counts of biased, unbiased and open cells.
#[derive(Clone, Copy, Default)]
struct Count {
    yes: usize,
    no: usize,
    open: usize,
}

impl Count {
    fn of(cells: &[&CellSummary], label: &str) -> Self {
        let mut count = Self::default();
        for cell in cells {
            match cell.output(label).and_then(biased) {
                Some(true) => count.yes += 1,
                Some(false) => count.no += 1,
                None => count.open += 1,
            }
        }
        count
    }

    fn all(self) -> usize {
        self.yes + self.no + self.open
    }

    fn text(self) -> String {
        let open = match self.open {
            0 => String::new(),
            open => format!(" (open: {open})"),
        };
        format!("{} cells{open}", count_of(self.yes, self.all()))
    }
}

/// C7.
pub(super) fn bias(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("closed-loop") else {
        return Finding::not_run("closed-loop");
    };
    let open_loop = |cell: &&CellSummary| cell.setting(Key::Feedback) == "none";
    let loops: Vec<&CellSummary> = study
        .summary
        .cells
        .iter()
        .filter(|cell| !open_loop(cell))
        .collect();
    let (without, with): (Vec<&CellSummary>, Vec<&CellSummary>) = loops
        .into_iter()
        .partition(|cell| without_input(study, cell));
    let noise = |name: &str| -> Vec<&CellSummary> {
        with.iter()
            .copied()
            .filter(|cell| cell.setting(Key::Noise) == name)
            .collect()
    };
    let (equation, white) = (noise("ar"), noise("white"));
    if equation.is_empty() || white.is_empty() || equation[0].output("iv(4)").is_none() {
        return Finding::undecided(
            study,
            "The results lack loops with an external input under 1/A and under white noise, or the output iv(4).",
        );
    }
    let [own, own_white] = [&equation, &white].map(|cells| Count::of(cells, "iv(4)"));
    let found = verdict(own, own_white);
    let mut because = format!(
        "With an external input r, instruments formed from u leave a biased coefficient in {} under 1/A noise, where the equation error is white, and in {} under white output noise",
        own.text(),
        own_white.text()
    );
    if with.iter().any(|cell| cell.output("iv-r(4)").is_some()) {
        let counts = [&equation, &white].map(|cells| Count::of(cells, "iv-r(4)").text());
        because.push_str(&format!(
            "; formed from r in {} and {}",
            counts[0], counts[1]
        ));
    }
    because.push('.');
    let decided = |wanted: bool| -> Vec<&CellSummary> {
        let all = equation.iter().chain(&white).copied();
        all.filter(|cell| cell.output("iv(4)").and_then(biased) == Some(wanted))
            .collect()
    };
    because.push_str(&largest(study, &with));
    because.push_str(&lost(&without));
    let mut numbers = Vec::new();
    for (name, cells) in [("1/A", &equation), ("white", &white)] {
        for cell in cells {
            let found = cell.output("iv(4)").and_then(worst);
            numbers.extend(found.map(|(coefficient, bias, error)| {
                let case = words(Key::Feedback, &cell.setting(Key::Feedback));
                let name = format!(
                    "bias over SD of {coefficient}, {case}, {name} noise, eta = {} %, N = {}",
                    cell.eta, cell.window
                );
                Number::new(name, bias, error)
            }));
        }
    }
    Finding::new(study, found, because)
        .numbers(numbers)
        .led_by(&condition(study, &decided(false), &decided(true)))
}

/// White noise is read both ways: as the equation error's (1/A output noise) and as the output's.
fn verdict(equation: Count, white: Count) -> Verdict {
    let [yes, no, open] = [
        equation.yes + white.yes,
        equation.no + white.no,
        equation.open + white.open,
    ];
    match (yes, no) {
        (0, no) if no > 0 && open == 0 => Verdict::Holds,
        (0, _) => Verdict::Undecided,
        (_, no) if no > 0 => Verdict::HoldsOnlyIf,
        (yes, _) if yes >= open => Verdict::DoesNotHold,
        _ => Verdict::Undecided,
    }
}

/// The largest bias of all loops with an input.
fn largest(study: &Study, cells: &[&CellSummary]) -> String {
    let found = cells
        .iter()
        .filter_map(|cell| Some((cell, worst(cell.output("iv(4)")?)?)));
    let most = found.max_by(|a, b| a.1.1.abs().total_cmp(&b.1.1.abs()));
    most.map_or_else(String::new, |(cell, (name, bias, error))| {
        format!(
            " The largest bias is that of {name}, {} standard deviations ({}).",
            uncertain(bias, error),
            crate::report::results::place(cell, &study.varying())
        )
    })
}

/// What is left without external input.
fn lost(cells: &[&CellSummary]) -> String {
    let texts: Vec<String> = crate::report::results::distinct(cells, Key::Feedback)
        .into_iter()
        .map(|feedback| {
            let of: Vec<&&CellSummary> = cells
                .iter()
                .filter(|cell| cell.setting(Key::Feedback) == feedback)
                .collect();
            let medians = of
                .iter()
                .map(|cell| median(cell, "iv(4)", Measure::Ea).value);
            let (low, high) = medians
                .filter(|x| x.is_finite())
                .fold((f64::INFINITY, 0.0_f64), |(low, high), x| {
                    (low.min(x), high.max(x))
                });
            let (failed, trials) =
                of.iter()
                    .filter_map(|cell| cell.output("iv(4)"))
                    .fold((0, 0), |sum, output| {
                        (
                            sum.0 + output.outcomes.failed(),
                            sum.1 + output.outcomes.trials,
                        )
                    });
            let share = 100.0 * failed as f64 / f64::max(1.0, trials as f64);
            let medians = if high > 0.0 {
                format!(
                    " (median e_a of the others {} to {})",
                    uncertain(low, 0.0),
                    uncertain(high, 0.0)
                )
            } else {
                String::new()
            };
            format!("{share:.1} % with feedback {feedback}{medians}")
        })
        .collect();
    if texts.is_empty() {
        return String::new();
    }
    format!(
        " Without external input {} fails in this share of the trials: {}.",
        shown("iv(4)"),
        texts.join("; ")
    )
}
