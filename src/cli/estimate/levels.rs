//! Whether a record begins at rest and moves about zero, as a model without a start and an offset has it.

use super::flags::ORDERS;
use super::report::{Estimate, Report};
use crate::diagnosis::LoopVerdict;
use crate::estimator::{Criterion, Method, Window};
use crate::metric::tails::chi_square_above;
use crate::model::Orders;
use crate::text::rounded;
use asobench_identification::Fitted;
use serde_json::json;

/// The level at which a start or an offset is said to be missing.
pub(super) const LEVEL: f64 = 1e-3;

/// Samples of the longest record of which it is asked: each addition is a fit of its own.
const MOST: usize = 100_000;

/// A parameter that may be fitted beside the model.
#[derive(Clone, Copy, PartialEq)]
struct Addition {
    flags: &'static str,
    start: bool,
    offset: bool,
    /// Whether u is taken less its first value: the record begins at rest there.
    from_first: bool,
}

const ADDITIONS: [Addition; 4] = {
    let none = Addition {
        flags: "",
        start: false,
        offset: false,
        from_first: false,
    };
    [
        Addition {
            flags: "--offset estimate",
            offset: true,
            ..none
        },
        Addition {
            flags: "--offset estimate",
            offset: true,
            from_first: true,
            ..none
        },
        Addition {
            flags: "--initial estimate",
            start: true,
            ..none
        },
        Addition {
            flags: "--initial estimate --offset estimate",
            start: true,
            offset: true,
            ..none
        },
    ]
};

/// The parameters to be fitted beside the model.
pub(super) struct Advice {
    /// Whether a start is among it, of a method that can fit one.
    pub(super) start: bool,
    /// The chance of such a likelihood ratio without it.
    pub(super) chance: f64,
    /// The hint.
    pub(super) sentence: String,
}

/// Returns the advice on a start, an offset, or both, by which the same method has a lower loss than by chance: the
/// likelihood ratio, over the factor by which residuals of this colour inflate the square of a mean, is beyond the
/// point of chi-square. Of several the one of the lowest BIC is named. `None` where the method has no such options.
/// `tried` keeps the fits for a second question about the same method, orders and record.
pub(super) fn levels(estimate: &Estimate, report: &Report, tried: &mut Tried) -> Option<Advice> {
    let last = &estimate.last().fitted;
    let fitted = |key: &str| Some(estimate.options.get(key)?.as_str()? == "estimate");
    let (start, offset) = (fitted("initial")?, fitted("offset").unwrap_or(false));
    let has_offset = estimate.options.contains_key("offset");
    let failed = estimate.failure().is_some_and(|of| !of.kind.leaves_a_model());
    let exact = estimate.last().residuals.as_ref();
    let exact = exact.is_some_and(|residuals| residuals.fits_to_rounding);
    if failed || exact || !last.pass.loss.is_finite() || report.window > MOST {
        return None;
    }
    // No model can be told from a controller without a change of its setpoint.
    if report.feedback.is_some_and(|test| test.verdict() == LoopVerdict::Told) {
        return None;
    }
    // Where an offset is fitted, a start is what is left to ask for.
    let may_shift = may_shift(report) && !offset;
    let allowed = |of: &&Addition| {
        let adds = (of.start && !start) || (of.offset && !offset);
        let keeps = (of.start || !start || of.from_first) && (of.offset || !offset);
        adds && keeps && (has_offset || !of.offset) && (may_shift || !of.from_first)
    };
    let samples = report.window as f64;
    let best = ADDITIONS
        .iter()
        .filter(allowed)
        .filter_map(|of| {
            let found = tried.fit(estimate, report, *of)?;
            let count = found.pass.start_numbers as f64 - last.pass.start_numbers as f64;
            let inflation = inflation(&found, of, report)?;
            let likelihood = samples * (last.pass.loss / found.pass.loss).ln() / inflation;
            // A start that the offset replaces costs nothing.
            let chance = chi_square_above(likelihood, count.max(1.0) as usize);
            (chance < LEVEL).then_some((count * samples.ln() - likelihood, of, found, chance))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, of, found, chance) = best?;
    let unit = report.unit;
    let why = match of {
        Addition { from_first: true, .. } => "the record fits better as one that begins at rest, but not at zero",
        Addition {
            start: true,
            offset: true,
            ..
        } => "the record begins neither at rest nor about zero",
        Addition { start: true, .. } => "the record does not begin at rest",
        _ => "y moves about a level of its own",
    };
    let variances = [&last.model, &found.model].map(|model| rounded(model.noise_variance * unit * unit, 4));
    Some(Advice {
        start: of.start && !start,
        chance,
        sentence: format!(
            "{why}: with {} the noise variance is {} (now {})",
            of.flags(report),
            variances[1],
            variances[0]
        ),
    })
}

/// Whether u may be taken less its first value.
fn may_shift(report: &Report) -> bool {
    report.subtracted().is_none() && report.parts.is_empty() && report.record.u[0] != 0.0
}

/// Returns the flags of an offset with which the same method has a lower BIC at one order less, and by how much: a pole
/// and a zero near 1 stand for the offset. `None` where they do not, or where the method takes none.
pub(super) fn offset_of_pair(estimate: &Estimate, report: &Report) -> Option<(String, f64)> {
    let last = &estimate.last().fitted;
    if estimate.options.get("offset")?.as_str()? == "estimate" || report.window > MOST {
        return None;
    }
    let orders = last.model.orders();
    let fewer = Orders {
        na: orders.na.saturating_sub(1),
        nf: orders.nf.saturating_sub(1),
        nb: orders.nb.checked_sub(1).filter(|nb| *nb > 0)?,
        ..orders
    };
    let bic = |Fitted { pass, .. }: &Fitted| Criterion::Bic.value(pass.loss, report.window, pass.fitted_numbers());
    let with_offset = ADDITIONS
        .iter()
        .filter(|of| of.offset && (may_shift(report) || !of.from_first));
    let found = with_offset.filter_map(|of| Some((of, bic(&fit(estimate, report, of, Some(fewer))?))));
    let (of, least) = found.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let lead = bic(last) - least;
    (lead > 0.0).then(|| (of.flags(report), lead))
}

/// The fits of a method with additions.
#[derive(Default)]
pub(super) struct Tried(Vec<(Addition, Option<Fitted>)>);

impl Tried {
    fn fit(&mut self, estimate: &Estimate, report: &Report, of: Addition) -> Option<Fitted> {
        if let Some((_, found)) = self.0.iter().find(|(tried, _)| *tried == of) {
            return found.clone();
        }
        let found = fit(estimate, report, &of, None);
        self.0.push((of, found.clone()));
        found
    }
}

impl Addition {
    /// The flags by which it is asked for.
    fn flags(&self, report: &Report) -> String {
        if !self.from_first {
            return self.flags.to_owned();
        }
        let first = rounded(report.record.u[0] * report.unit, 6);
        format!("--operating-point {first},0 {}", self.flags)
    }

    /// u as the model sees it.
    fn input(&self, report: &Report) -> Vec<f64> {
        let u = &report.record.u[..report.window];
        let level = if self.from_first { u[0] } else { 0.0 };
        u.iter().map(|u| u - level).collect()
    }
}

/// Fits the method with the addition, at the same orders or at others; `None` if it fails.
fn fit(estimate: &Estimate, report: &Report, of: &Addition, orders: Option<Orders>) -> Option<Fitted> {
    let mut options = estimate.given();
    if let Some(orders) = orders {
        options.insert(ORDERS.to_owned(), json!(orders));
    }
    for (key, is) in [("initial", of.start), ("offset", of.offset)] {
        let value = match (key, is) {
            (_, true) => "estimate",
            ("initial", _) => "zero",
            _ => "none",
        };
        if options.contains_key(key) {
            options.insert(key.to_owned(), json!(value));
        }
    }
    let options = estimate.name.parse(options).ok()?;
    let (u, order) = (of.input(report), estimate.last().fitted.pass.a.len());
    let window = Window::new(&u, &report.record.y, report.window);
    let passes = Method::named(estimate.name.name(), options).estimate_once(order, &report.lengths(), window, true);
    let pass = passes.ok()?.pop()?;
    let has_model = pass.failure.is_none_or(|of| of.kind.leaves_a_model());
    (has_model && pass.loss.is_finite()).then(|| Fitted::new(pass, 0))
}

/// The factor by which the square of a mean of the residuals exceeds that of white ones, at least 1: by their
/// autocorrelations, `1 + 2 sum (1 - tau/(L+1)) r_e(tau)` over L lags, or by the first alone, `(1 + r)/(1 - r)` of an
/// AR(1), where that is more.
fn inflation(found: &Fitted, of: &Addition, report: &Report) -> Option<f64> {
    let u = of.input(report);
    let first = report.runs().iter().next()?.clone();
    let y = &report.record.y[first.clone()];
    let residuals = found.residuals(&u[first], y, false, report.rounding)?;
    let lags = residuals.autocorrelations.len() as f64;
    let weighted = residuals.autocorrelations.iter().enumerate().skip(1);
    let sum: f64 = weighted.map(|(lag, r)| (1.0 - lag as f64 / lags) * r).sum();
    let r = residuals.autocorrelations[1];
    Some(((1.0 + r) / (1.0 - r)).max(1.0 + 2.0 * sum).max(1.0))
}
