//! Compares models of several orders and delays over the same equations, by each criterion.

mod picture;

use super::comparison::fit_of_all;
use super::flags::OptionFlags;
use super::hints;
use super::levels::{Advice, Tried, levels};
use super::one_estimator::run;
use super::orders::delayed;
use super::report::{Estimate, Fits, Report};
use super::span::Span;
use crate::cli::error::{Error, bad_input};
use crate::cli::groups;
use crate::cli::output::Lines;
use crate::estimator::{ArxOptions, Criterion, EstimatorName, MethodOptions, OrderComparison, Progress, SetupError};
use crate::metric::Fit;
use crate::model::Orders;
use crate::text::visible;
use serde_json::{Map, Value, json};

/// One model of the table.
#[derive(Default)]
struct Row {
    n: usize,
    orders: Orders,
    /// The mean squared error over the common equations; `None` if there is no estimate.
    loss: Option<f64>,
    /// The parameters over the common equations.
    theta: Vec<f64>,
    /// `RSS / N` over the model's own equations.
    own_loss: Option<f64>,
    /// The model of its own equations.
    own: Option<Estimate>,
    /// FIT of the simulated output on the window and on the samples after it, per cent.
    window_fit: Option<f64>,
    validation_fit: Option<f64>,
    /// The criteria, in the order of [`Criterion::ALL`].
    criteria: Vec<Option<f64>>,
    /// Why there is no estimate of a record so short.
    refused: Option<String>,
}

/// The table, and the row that each criterion chooses.
pub(super) struct Scan {
    estimator: EstimatorName,
    /// The orders and delays of the table.
    ranges: [Span; 2],
    rows: Vec<Row>,
    equations: usize,
    /// Whether the record told that the models do not begin at rest.
    pub(super) start_told: bool,
    best: Vec<Option<usize>>,
    /// The row with the best FIT on validation samples.
    best_fit: Option<usize>,
    /// The row with the fewest parameters of those that fit to rounding: criteria of more parameters compare rounding.
    exact: Option<usize>,
}

/// Runs the models of all orders and delays on a record.
fn scan(
    report: &Report,
    estimator: EstimatorName,
    given: &Map<String, Value>,
    Ranges { order, delay, ends }: Ranges,
) -> Result<Scan, Error> {
    let both = (delay.first..=delay.last).flat_map(|nk| (order.first..=order.last).map(move |n| (n, nk)));
    let (rows, equations) = if estimator == EstimatorName::Arx {
        regressions(report, both)?
    } else {
        let mut rows: Vec<Row> = Vec::new();
        for (n, nk) in both {
            let orders = Orders::arx(n, n, nk);
            let mut row = Row {
                n,
                orders,
                ..Row::default()
            };
            row.fit(report, estimator, of_order(estimator, given, n, nk)?)?;
            row.loss = row.own_loss;
            row.judge(report.window);
            rows.push(row);
            if ends && two_are_worse(&rows) {
                break;
            }
        }
        (rows, report.window)
    };
    let best = (0..Criterion::ALL.len()).map(|criterion| {
        let values = rows.iter().enumerate();
        let values = values.filter_map(|(i, row)| Some((i, row.criteria[criterion]?)));
        let best = values.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(i, _)| i)
    });
    let fits = rows.iter().enumerate();
    let fits = fits.filter_map(|(i, row)| Some((i, row.validation_fit?)));
    let best_fit = fits.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i);
    let exact = rows.iter().enumerate().filter(|(_, row)| row.fits_to_rounding());
    let exact = exact.min_by_key(|(_, row)| row.parameters()).map(|(i, _)| i);
    Ok(Scan {
        estimator,
        ranges: [order, delay],
        best: best.collect(),
        best_fit,
        exact,
        rows,
        equations,
        start_told: false,
    })
}

/// Whether each of the last two orders has a BIC that is higher than the least one by strong evidence.
fn two_are_worse(rows: &[Row]) -> bool {
    let bic = |row: &Row| row.criteria[place_of(Criterion::Bic)];
    let least = rows.iter().filter_map(bic).fold(f64::INFINITY, f64::min);
    let worse = rows
        .iter()
        .rev()
        .take(2)
        .filter(|row| bic(row).is_some_and(|bic| bic - least > STRONG));
    worse.count() == 2
}

/// The lead in BIC of strong evidence (Kass and Raftery, *Bayes factors*, 1995).
pub(super) const STRONG: f64 = 6.0;

/// The orders and delays of a table.
#[derive(Clone, Copy)]
pub(super) struct Ranges {
    pub(super) order: Span,
    pub(super) delay: Span,
    /// Whether a search of orders ends after two in a row that are worse.
    pub(super) ends: bool,
}

/// Whether the start of the record is for the program to choose.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum StartChoice {
    Given,
    Free,
    /// Another method has found that the record does not begin at rest.
    Told,
}

/// Runs the models as [`scan`], and once more with the start of the record where the model that BIC chooses does not
/// begin at rest and the start is free. Returns the hint on the start, too.
pub(super) fn scan_from_start(
    report: &Report,
    (estimator, given): (EstimatorName, Map<String, Value>),
    ranges: Ranges,
    start: StartChoice,
) -> Result<(Scan, Option<String>), Error> {
    let from_start = |mut given: Map<String, Value>| {
        OptionFlags::estimate_start(&mut given);
        let mut found = scan(report, estimator, &given, ranges)?;
        found.start_told = true;
        Ok::<Scan, Error>(found)
    };
    if start == StartChoice::Told {
        return Ok((from_start(given)?, None));
    }
    let mut found = scan(report, estimator, &given, ranges)?;
    let Some(chosen) = found.of_bic() else {
        return Ok((found, None));
    };
    let mut advice = levels(chosen, report, &mut Tried::default());
    let fixed = hints::fixed_start(chosen, report);
    if start == StartChoice::Free && advice.as_ref().is_some_and(|of: &Advice| of.start) {
        found = from_start(given)?;
        let chosen = found.of_bic();
        advice = chosen.and_then(|of| levels(of, report, &mut Tried::default()));
    }
    Ok((found, advice.map(|advice| advice.sentence).or(fixed)))
}

/// The place of a criterion among all.
fn place_of(criterion: Criterion) -> usize {
    let place = Criterion::ALL.iter().position(|of| *of == criterion);
    place.unwrap_or_default()
}

/// The options of an estimator whose polynomials all have the order n, with those that were given.
fn of_order(estimator: EstimatorName, given: &Map<String, Value>, n: usize, nk: usize) -> Result<MethodOptions, Error> {
    let read = |orders: Orders| {
        let mut options = given.clone();
        options.insert("orders".to_owned(), Value::from(orders.to_string()));
        estimator.parse(options)
    };
    let default = estimator.parse(given.clone()).ok();
    let default = default.and_then(|options| options.model_orders(n));
    // The orders of the estimator's own polynomials; subspace methods take n and nk.
    let options = match default.map(|orders| read(delayed(orders, nk))) {
        Some(Ok(options)) => Ok(options),
        _ => read(Orders::arx(n, n, nk)),
    };
    let wrong = |message: String| Error::Input(format!("--estimator {estimator}, order {n}: {message}"));
    match options {
        Ok(options) if options.needs().reference.is_some() => Err(wrong(
            "needs the reference of a closed loop; expected one order".to_owned(),
        )),
        options => options.map_err(|error| wrong(error.to_string())),
    }
}

/// Least squares of all orders over the same equations; returns their number too.
fn regressions(report: &Report, both: impl Iterator<Item = (usize, usize)>) -> Result<(Vec<Row>, usize), Error> {
    let (u, y) = (&report.record.u, &report.record.y);
    let window = report.window;
    let square = report.told_unit().powi(2);
    let orders: Vec<Orders> = both.map(|(n, nk)| delayed(Orders::arx(n, n, 1), nk)).collect();
    let comparison = OrderComparison::of_runs(&orders, report.runs());
    let mut comparison = comparison.map_err(bad_input)?;
    comparison.run(&u[..window], &y[..window]);
    let mut rows = Vec::new();
    for candidate in comparison.candidates() {
        let orders = candidate.orders;
        let mut row = Row {
            n: orders.na,
            orders,
            loss: candidate.loss.ok().map(|loss| loss * square),
            ..Row::default()
        };
        row.judge(comparison.equations());
        let options = ArxOptions {
            orders: Some(orders),
            ..ArxOptions::default()
        };
        row.fit(report, EstimatorName::Arx, options.into())?;
        row.theta = candidate.theta().to_vec();
        rows.push(row);
    }
    Ok((rows, comparison.equations()))
}

impl Row {
    /// Whether the residuals are no larger than the rounding of the record's numbers.
    fn fits_to_rounding(&self) -> bool {
        let own = self.own.as_ref().and_then(|own| own.last().residuals.as_ref());
        own.is_some_and(|tests| tests.fits_to_rounding)
    }

    /// The number of parameters, those of the record's start too.
    fn parameters(&self) -> usize {
        let start = self.own.as_ref().map_or(0, |own| own.last().fitted.pass.start_numbers);
        self.orders.parameters() + start
    }

    /// Computes the criteria.
    fn judge(&mut self, equations: usize) {
        let value = |criterion: &Criterion| {
            let value = criterion.value(self.loss?, equations, self.parameters());
            value.is_finite().then_some(value)
        };
        self.criteria = Criterion::ALL.iter().map(value).collect();
    }

    /// Estimates the model from its own equations, and computes its FIT.
    fn fit(&mut self, report: &Report, estimator: EstimatorName, options: MethodOptions) -> Result<(), Error> {
        self.orders = options.model_orders(self.n).unwrap_or(self.orders);
        let own = run(estimator, options, (self.orders.order(), 0), report, false);
        let own = match own {
            Err(
                error @ (SetupError::ShortWindow(_) | SetupError::ShortRecord { .. } | SetupError::ShortHankel { .. }),
            ) => {
                self.refused = Some(error.to_string());
                return Ok(());
            }
            own => own.map_err(bad_input)?,
        };
        let fitted = &own.last().fitted;
        if fitted.pass.progress < Progress::InitialState {
            return Ok(());
        }
        self.theta = fitted.model.parameters().collect();
        self.own_loss = Some(fitted.pass.loss * report.told_unit().powi(2));
        let simulated = |fit: Fit| Some(fit.simulated).filter(|fit| fit.is_finite());
        if let Some(Fits { window, validation }) = own.fit {
            self.window_fit = simulated(window);
            self.validation_fit = validation.and_then(simulated);
        } else {
            self.window_fit = simulated(fit_of_all(&own.parts, report));
        }
        self.own = Some(own);
        Ok(())
    }

    fn named(&self) -> Value {
        let Orders { na, nb, nk, .. } = self.orders;
        if self.orders == Orders::arx(na, nb, nk) {
            return json!({ "na": na, "nb": nb, "nk": nk });
        }
        json!({ "n": self.n, "nk": nk, "orders": self.orders.to_string() })
    }
}

impl Scan {
    /// The row that BIC chooses, or the smallest that fits to rounding.
    fn by_bic(&self) -> Option<&Row> {
        Some(&self.rows[self.exact.or(self.best[place_of(Criterion::Bic)])?])
    }

    /// Returns the order and the delay that BIC chooses, or the lowest that fit to rounding.
    pub(super) fn chosen(&self) -> Option<(usize, usize)> {
        self.by_bic().map(|row| (row.n, row.orders.nk))
    }

    /// Why no order has an estimate of a record so short.
    pub(super) fn refused(&self) -> Option<&str> {
        let all = self.rows.iter().map(|row| row.refused.as_deref());
        all.collect::<Option<Vec<&str>>>()?.first().copied()
    }

    /// Returns the table as text, with what may be done about the record.
    pub(super) fn text(&self, report: &Report, hint: Option<&str>) -> String {
        let mut text = Lines::default();
        self.write(&mut text, report);
        for line in &self.choice() {
            text.paragraph(line, "  ");
        }
        if let Some(hint) = hint {
            text.paragraph(&format!("hint: {hint}"), "  ");
        }
        text.0
    }

    /// Returns the model that BIC chooses, for hints on its start.
    fn of_bic(&self) -> Option<&Estimate> {
        let row = self.by_bic()?;
        row.own.as_ref().filter(|_| self.estimator != EstimatorName::Arx)
    }

    /// The choices in words: that of BIC, models that are nearly as good, the other criteria, and an edge of the range.
    fn choice(&self) -> Vec<String> {
        /// Of two models whose BIC differs by less, neither is preferred (Raftery 1995).
        const NEAR: f64 = 2.0;
        let bic = place_of(Criterion::Bic);
        let Some(best) = self.best[bic] else {
            return Vec::new();
        };
        let named = |row: &Row| format!("n = {}, nk = {}", row.n, row.orders.nk);
        if let Some(exact) = self.exact {
            return vec![format!(
                "{}: the fewest parameters that fit to the rounding of the record's numbers. With more, criteria \
                 compare rounding.",
                named(&self.rows[exact])
            )];
        }
        let of = |row: usize| named(&self.rows[row]);
        let least = self.rows[best].criteria[bic].unwrap_or(f64::NAN);
        let near = self
            .rows
            .iter()
            .enumerate()
            .filter(|(i, row)| *i != best && row.criteria[bic].is_some_and(|value| value - least < NEAR));
        let near: Vec<String> = near.map(|(_, row)| named(row)).collect();
        let near = match near.as_slice() {
            [] => String::new(),
            near => format!(" (within 2 of it: {})", near.join("; ")),
        };
        let mut others: Vec<(String, Vec<&str>)> = Vec::new();
        let criteria = Criterion::ALL.iter().zip(&self.best);
        let choices = criteria.filter_map(|(criterion, row)| Some((criterion.heading(), (*row)?)));
        let choices = choices.chain(self.best_fit.map(|row| ("FIT of validation", row)));
        for (name, row) in choices.filter(|(_, row)| *row != best) {
            groups::add(&mut others, of(row), name);
        }
        let others = others
            .iter()
            .map(|(model, names)| format!("; {}: {model}", names.join(", ")));
        let mut lines = vec![format!("BIC: {}{near}{}.", of(best), others.collect::<String>())];
        if self.start_told {
            lines
                .push("Each model has its start: the record does not begin at rest (--initial zero: none).".to_owned());
        }
        let [order, delay] = self.ranges;
        let chosen = &self.rows[best];
        let ranges = [
            ("n", "order", order, chosen.n),
            ("nk", "delay", delay, chosen.orders.nk),
        ];
        for (name, flag, Span { first, last }, at) in ranges.into_iter().filter(|of| of.2.is_range()) {
            let (end, wider) = if at == last {
                ("largest", format!("{first}:{}", 2 * last))
            } else if at == first && flag == "delay" && first > 1 {
                ("smallest", format!("1:{last}"))
            } else {
                continue;
            };
            lines.push(format!(
                "{name} = {at} is the {end} of the range: widen it, --{flag} {wider}"
            ));
        }
        lines
    }

    /// Returns the table with all digits.
    pub(super) fn json(&self, report: &Report) -> Value {
        let m = self.equations as f64;
        let table = self.rows.iter().map(|row| {
            let mut object = row.named();
            object["d"] = json!(row.parameters());
            object["theta"] = json!(row.loss.map(|_| &row.theta));
            object["V"] = json!(row.loss);
            object["rss"] = json!(row.loss.map(|loss| loss * m));
            for (criterion, value) in Criterion::ALL.iter().zip(&row.criteria) {
                object[criterion.name()] = json!(value);
            }
            let normalised = row.loss.map(|loss| loss.ln() + 2.0 * row.parameters() as f64 / m);
            object["aic_normalised"] = json!(normalised);
            object["V_own_rows"] = json!(row.own_loss);
            object["fit_percent"] = json!({ "window": row.window_fit, "validation": row.validation_fit });
            object
        });
        let named = |row: &Option<usize>| json!(row.map(|row| self.rows[row].named()));
        let mut best = json!({});
        for (criterion, row) in Criterion::ALL.iter().zip(&self.best) {
            best[criterion.name()] = named(row);
        }
        best["fit_percent"] = named(&self.best_fit);
        json!({
            "file": report.file.display().to_string(),
            "samples": report.record.y.len(),
            "window": report.window,
            "skipped": report.skipped,
            "form": report.form,
            "validation": report.validation.as_ref().map(|validation| validation.file.display().to_string()),
            "unit": report.unit,
            "detrend": report.detrend,
            "estimator": self.estimator.name(),
            "common_first_row": report.parts.is_empty().then(|| report.window - self.equations),
            "rows": self.equations,
            "table": table.collect::<Vec<_>>(),
            "best": best,
            "fits_to_rounding": self.exact.map(|row| self.rows[row].named()),
        })
    }

    /// The models of the table in words.
    fn models(&self) -> String {
        match self.estimator {
            EstimatorName::Arx => "ARX models with na = nb = n".to_owned(),
            estimator => format!("models by {estimator} of order n"),
        }
    }

    fn write(&self, text: &mut Lines, report: &Report) {
        let (models, equations, detrend) = (self.models(), self.equations, report.detrend);
        if report.parts.is_empty() {
            text.line(format_args!(
                "{}: {models} over the same {equations} equations,\nk = {} ... {}; \
                 window {} of {} samples, detrend {detrend}",
                visible(report.file.display()),
                report.window - equations,
                report.window - 1,
                report.window,
                report.record.y.len(),
            ));
        } else {
            text.line(format_args!(
                "{} records, {} samples: {models}\nover the same {equations} equations; detrend {detrend} of each file",
                report.parts.len(),
                report.window
            ));
        }
        text.record(report);
        text.line("\n  n nk        V         AIC        AICc         BIC         FPE  FIT %  valid.");
        for (i, row) in self.rows.iter().enumerate() {
            let loss = row.loss.map_or("-".to_owned(), |loss| format!("{loss:.4e}"));
            let mut line = format!("{:>3} {:>2} {loss:>11}", row.n, row.orders.nk);
            for ((criterion, value), best) in Criterion::ALL.iter().zip(&row.criteria).zip(&self.best) {
                let star = if *best == Some(i) { "*" } else { " " };
                let number = match value {
                    None => "-".to_owned(),
                    Some(value) if *criterion == Criterion::Fpe => format!("{value:.4e}"),
                    Some(value) => format!("{value:.2}"),
                };
                line.extend([format!(" {number:>10}{star}")]);
            }
            let star = if self.best_fit == Some(i) { "*" } else { "" };
            let percent = |fit: Option<f64>| match fit {
                Some(fit) if fit.abs() < 1e4 => format!("{fit:.2}"),
                Some(fit) => format!("{fit:.0e}"),
                None => "-".to_owned(),
            };
            let (window, validation) = (percent(row.window_fit), percent(row.validation_fit));
            line.extend([format!(" {window:>6} {validation:>7}{star}")]);
            text.line(line.trim_end());
        }
        let on = match (&report.validation, report.parts.is_empty()) {
            (_, false) => "",
            (Some(_), _) => ", and the best FIT on\n  the record for validation",
            (None, _) => ", and the best FIT on\n  samples after the window",
        };
        let whose = match self.estimator {
            EstimatorName::Arx => ", its own equations",
            _ => "",
        };
        text.line(format_args!(
            "\n* the smallest value of each criterion{on}.\n\
             V: mean squared residual; FIT: of the simulated output{whose}."
        ));
    }
}
