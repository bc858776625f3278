//! `asobench estimate record.csv` without an order: several methods at orders that the record chooses, in one table.

use super::arguments::{Arguments, Part, refuse};
use super::load::load;
use super::one_estimator::estimate;
use super::record;
use super::report::{Estimate, Report};
use super::scan::{Ranges, STRONG, StartChoice, scan_from_start};
use super::span::{Given, Span};
use super::{comparison, hints, orders, words};
use crate::cli::error::Error;
use crate::cli::output::{Lines, show};
use crate::cli::progress::Steps;
use crate::data::csv::Record;
use crate::diagnosis::LoopVerdict;
use crate::estimator::{Criterion, EstimatorName, OrderComparison};
use crate::model::Orders;
use crate::text::{count, visible};
use serde_json::{Map, Value, json};

/// The methods: an equation error, an output error, two models of the noise, and a subspace method with the weighting
/// that the record favours.
const METHODS: [EstimatorName; 5] = {
    use EstimatorName::{Armax, Arx, Bj, N4sid, Oe};
    [Arx, Oe, Armax, Bj, N4sid]
};

/// Largest order that is tried, and the samples for each.
const ORDER: usize = 6;
const SAMPLES: usize = 20;
/// The delays that are looked at where none is given; one of them is told by strong evidence.
const DELAYS: Span = Span { first: 1, last: 10 };
/// The share of the record on which models are fitted, per cent; on the rest they are validated.
const WINDOW: f64 = 70.0;

/// A method, with the model of the order that BIC chooses.
struct Row {
    n: usize,
    nk: usize,
    estimate: Estimate,
    /// The command that prints all of this model.
    command: String,
}

/// Whether methods and orders are the program's to choose.
pub(super) fn is_asked(arguments: &Arguments) -> bool {
    let options = &arguments.options;
    arguments.record.order.is_none() && !options.has(super::flags::ORDERS) && options.letters.is_empty()
}

/// Fits all methods, and prints the table.
pub(super) fn run(mut arguments: Arguments) -> Result<(), Error> {
    let [plot, report, states] = arguments.drawn();
    let (more, details) = (!arguments.more.is_empty(), arguments.details);
    let of_one_model = [plot, report, states, ("MORE.csv", more), ("--details", details)];
    refuse(
        &of_one_model,
        &format!("needs a single model; {}", orders::ORDERS_EXPECTED),
    )?;
    let chosen = match arguments.estimator.as_slice() {
        [] => METHODS.to_vec(),
        names => orders::of_tables(names)?,
    };
    if let Some(message) = arguments.options.useless(&chosen) {
        return Err(Error::Input(message));
    }
    let file = &arguments.record.file;
    let table = record::whole(record::read(file, &arguments.record)?, file, "a comparison of methods")?;
    let is_default = arguments.record.window.is_none() && arguments.validate.is_none();
    if is_default {
        arguments.record.window = Some(Part::Percent(WINDOW));
    }
    let rows = table.record.y.len();
    let window = arguments.record.window.map_or(rows, |part| part.of(rows));
    let largest = (window / SAMPLES).max(1);
    let order = Span {
        first: 1,
        last: largest.min(ORDER),
    };
    let delay = arguments.record.delay.unwrap_or(Span { first: 1, last: 1 });
    let orders = Orders::arx(order.last, order.last, delay.last);
    let mut report = load(&arguments, orders, table)?;
    let is_delay_free = arguments.record.delay.is_none();
    let nk = if delay.is_range() {
        delay_of(&report, delay).0
    } else {
        delay.first
    };
    let (mut rows, mut without, mut begun) = (Vec::new(), Vec::new(), false);
    let mut steps = Steps::new();
    for &method in &chosen {
        steps.show(&format!(
            "{method} of order {order}, {} of {}",
            rows.len() + without.len() + 1,
            chosen.len()
        ));
        match row(&mut arguments, &mut report, method, (order, nk), is_default, &mut begun)? {
            Ok(row) => rows.push(row),
            Err(reason) => without.push((method.name(), reason)),
        }
    }
    drop(steps);
    if let ([], Some((_, Some(reason)))) = (rows.as_slice(), without.first()) {
        return Err(Error::Input(reason.clone()));
    }
    rows.sort_by(|a, b| comparison::is_better(&a.estimate, &b.estimate, &report));
    // A method that can fit an offset says whether the record asks for one.
    if !chosen.iter().any(|method| method.takes("offset")) {
        hints::warn_of_offset(&report, &chosen);
    }
    let panel = Panel {
        report: &report,
        rows,
        without,
        order,
        delay,
        nk,
        later: is_delay_free
            .then(|| delay_of(&report, DELAYS))
            .filter(|(_, lead)| *lead > STRONG),
    };
    show(arguments.format, || panel.text(), || panel.json())
}

/// Returns the delay that BIC chooses among ARX models that all look back equally far, so that a larger delay leaves
/// out leading coefficients of B and nothing else: A of high order has taken up the noise. Returns too by how much its
/// BIC is lower than that of the first delay; the first delay and 0 where there is no such model.
fn delay_of(report: &Report, delay: Span) -> (usize, f64) {
    let reach = delay.last + ORDER;
    let orders = (delay.first..=delay.last).map(|nk| Orders::arx(reach, reach + 1 - nk, nk));
    let orders: Vec<Orders> = orders.collect();
    let Ok(mut comparison) = OrderComparison::new(&orders, report.window) else {
        return (delay.first, 0.0);
    };
    let Record { u, y, .. } = &report.record;
    comparison.run(&u[..report.window], &y[..report.window]);
    let equations = comparison.equations();
    let of = comparison.candidates().iter().filter_map(|candidate| {
        let (loss, orders) = (candidate.loss.ok()?, candidate.orders);
        let bic = Criterion::Bic.value(loss, equations, orders.parameters());
        bic.is_finite().then_some((bic, orders.nk))
    });
    let of: Vec<(f64, usize)> = of.collect();
    let best = of.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((bic, nk)) = best else {
        return (delay.first, 0.0);
    };
    let first = of.iter().find(|(_, nk)| *nk == delay.first);
    (*nk, first.map_or(0.0, |(first, _)| first - bic))
}

/// Fits a method at the order that BIC chooses. The inner error is for a method without a model at any order, with the
/// reason where the record is too short for it. `begun` says whether a method before
/// has found that the record does not begin at rest.
fn row(
    arguments: &mut Arguments,
    report: &mut Report,
    method: EstimatorName,
    (order, nk): (Span, usize),
    is_default: bool,
    begun: &mut bool,
) -> Result<Result<Row, Option<String>>, Error> {
    let one = |number| Span {
        first: number,
        last: number,
    };
    // Subspace methods have no delay of more than a sample: further states hold it.
    let (last, delay) = if nk > 1 && is_subspace(method) {
        (order.last + nk - 1, one(1))
    } else {
        (order.last, one(nk))
    };
    let options = arguments.options.taken_by(method);
    let start = match arguments.options.start_is_free(method) {
        false => StartChoice::Given,
        true if *begun => StartChoice::Told,
        true => StartChoice::Free,
    };
    let ranges = Ranges {
        order: Span { last, ..order },
        delay,
        ends: true,
    };
    let (of_orders, _) = scan_from_start(report, (method, options), ranges, start)?;
    *begun |= of_orders.start_told;
    let Some((n, nk)) = of_orders.chosen() else {
        return Ok(Err(of_orders.refused().map(str::to_owned)));
    };
    arguments.record.order = Some(Given::Span(one(n)));
    arguments.record.delay = Some(one(nk));
    report.orders = Orders::arx(n, n, nk);
    let estimate = estimate(arguments, method, report)?;
    let command = comparison::command(&["--estimator", "--delay", "--format"]);
    let window = if is_default {
        format!(" --window {WINDOW}%")
    } else {
        String::new()
    };
    let delay = if nk == 1 {
        String::new()
    } else {
        format!(" --delay {nk}")
    };
    let command = format!("{command}{window} --estimator {method} --order {n}{delay}");
    Ok(Ok(Row {
        n,
        nk,
        estimate,
        command,
    }))
}

/// Whether a method has no delay of more than one sample.
fn is_subspace(method: EstimatorName) -> bool {
    let orders = |text: &str| method.parse(Map::from_iter([("orders".to_owned(), json!(text))]));
    orders("n=1,nk=2").is_err() && orders("n=1,nk=1").is_ok()
}

/// The table, best model first.
struct Panel<'a> {
    report: &'a Report,
    rows: Vec<Row>,
    /// The methods that have no model at any order, with the reason where the record is too short.
    without: Vec<(&'static str, Option<String>)>,
    order: Span,
    /// The delays that were tried, and the one that was chosen.
    delay: Span,
    nk: usize,
    /// A delay that was not tried and has a lower BIC in long ARX models, and by how much.
    later: Option<(usize, f64)>,
}

impl Panel<'_> {
    fn text(&self) -> String {
        let mut text = Lines::default();
        let Self {
            report,
            order,
            delay,
            nk,
            ..
        } = self;
        let delay = if delay.is_range() {
            format!("delay {nk} of {delay} by BIC of long ARX models")
        } else {
            format!("delay {nk}")
        };
        let about = format!(
            "{}: {}, at the order of {order} that BIC chooses (a search ends after two orders that are worse by \
             {STRONG}), {delay}; window {} of {} samples, detrend {}",
            visible(report.file.display()),
            count((self.rows.len() + self.without.len()) as u64, "method"),
            report.window,
            report.record.y.len(),
            report.detrend
        );
        text.paragraph(&about, "");
        text.add(&words::record(report));
        let ranked: Vec<&Estimate> = self.rows.iter().map(|row| &row.estimate).collect();
        if !ranked.is_empty() {
            comparison::write(&mut text, report, &ranked);
        }
        for (method, reason) in &self.without {
            let reason = reason
                .as_ref()
                .map_or_else(String::new, |reason| format!(" ({reason})"));
            text.paragraph(&format!("No model at any order: {method}{reason}"), "  ");
        }
        if let Some((nk, lead)) = self.later {
            let line = format!(
                "hint: the BIC of long ARX models is lower by {lead:.0} with a delay of {nk} than of 1: --delay \
                 {DELAYS}"
            );
            text.paragraph(&line, "  ");
        }
        let Some(best) = self.rows.first() else {
            return text.0;
        };
        if report
            .feedback
            .is_some_and(|test| test.verdict() == LoopVerdict::Feedback)
        {
            text.paragraph(&format!("hint: {}", hints::LOOP), "  ");
        }
        comparison::hints(&mut text, &best.estimate);
        if !best.estimate.name.takes("offset") {
            let can_fit = self.rows.iter().find(|row| row.estimate.name.takes("offset"));
            can_fit.inspect(|row| comparison::hints(&mut text, &row.estimate));
        }
        if best.n == order.last && order.is_range() {
            let line = format!(
                "n = {} is the largest that was tried: --estimator {} --order 1:{} compares more",
                best.n,
                best.estimate.name,
                2 * best.n
            );
            text.paragraph(&line, "  ");
        }
        text.line(format_args!("All of the first model:\n  {}", best.command));
        text.0
    }

    fn json(&self) -> Value {
        let report = self.report;
        let row = |row: &Row| {
            let fits = row.estimate.fit.as_ref();
            json!({
                "estimator": row.estimate.name,
                "n": row.n,
                "nk": row.nk,
                "orders": row.estimate.last().fitted.model.orders().to_string(),
                "fit_percent": {
                    "window": fits.map(|fits| fits.window),
                    "validation": fits.map(|fits| fits.validation),
                },
                "bic": comparison::bic(&row.estimate, report),
                "white": comparison::white(&row.estimate),
                "status": comparison::status(&row.estimate),
                "hints": row.estimate.hints,
                "command": row.command,
            })
        };
        json!({
            "file": report.file.display().to_string(),
            "samples": report.record.y.len(),
            "window": report.window,
            "validation": report.validation.as_ref().map(|validation| validation.file.display().to_string()),
            "detrend": report.detrend,
            "orders_tried": [self.order.first, self.order.last],
            "delays_tried": [self.delay.first, self.delay.last],
            "nk": self.nk,
            "panel": self.rows.iter().map(row).collect::<Vec<_>>(),
            "without_model": self.without.iter().map(|(method, _)| method).collect::<Vec<_>>(),
            "later_delay": self.later.map(|(nk, lead)| json!({ "nk": nk, "bic_lower_by": lead })),
        })
    }
}
