//! The table of orders and delays as a picture and as a page.

use super::{Row, Scan};
use crate::cli::estimate::{Report, page};
use crate::estimator::Criterion;
use crate::report::html::{CellText, Column, Table};
use crate::report::plot::{Picture, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use crate::text::rounded;

/// The most lines that a picture can tell apart. With more delays, it shows only the best delay of each order.
const MOST_LINES: usize = 7;
/// The palette's position for the mark of the best model: a grey dot.
const BEST: usize = 13;
/// FIT below this is cut off, so that models that explain something remain visible.
const LEAST_FIT: f64 = -10.0;

/// A value of each model.
type Value<'a> = &'a dyn Fn(&Row) -> Option<f64>;

/// A quantity drawn over the order.
struct Quantity<'a> {
    name: &'static str,
    axis: fn(&'static str) -> PlotAxis,
    value: Value<'a>,
    /// Whether larger values are better.
    larger: bool,
    best: Option<usize>,
}

impl Scan {
    /// Draws criteria and FIT over the order.
    pub(in crate::cli::estimate) fn picture(&self) -> Picture {
        let criteria = Criterion::ALL.iter().enumerate().map(|(i, criterion)| {
            self.plot(&Quantity {
                name: criterion.heading(),
                // Of the criteria FPE alone is no logarithm.
                axis: match criterion {
                    Criterion::Fpe => PlotAxis::log,
                    _ => PlotAxis::linear,
                },
                value: &move |row| row.criteria[i],
                larger: false,
                best: self.best[i],
            })
        });
        let mut plots: Vec<Plot> = criteria.collect();
        let fits: [(&'static str, Value<'_>); 2] = [
            ("FIT on the window, %", &|row| row.window_fit),
            ("FIT after the window, %", &|row| row.validation_fit),
        ];
        for (i, (name, value)) in fits.into_iter().enumerate() {
            if self.rows.iter().any(|row| value(row).is_some()) {
                let best = if i == 0 { None } else { self.best_fit };
                let larger = true;
                plots.push(self.plot(&Quantity {
                    name,
                    axis: PlotAxis::linear,
                    value,
                    larger,
                    best,
                }));
            }
        }
        let description = "Information criteria, of which the smallest is the best, and FIT of the simulated output \
                           over the order n.";
        let sharing = Sharing { x: true, y: false };
        small_multiples(&format!("Order: {}", self.models()), description, &plots, 2, sharing)
    }

    fn plot(&self, quantity: &Quantity<'_>) -> Plot {
        let mut y = (quantity.axis)(quantity.name);
        let values: Vec<f64> = self.rows.iter().filter_map(quantity.value).collect();
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        if quantity.larger && lowest < LEAST_FIT {
            y = y.range(LEAST_FIT, 100.0);
        }
        let mut plot = Plot::new("", PlotAxis::linear("order n"), y);
        for (slot, (label, rows)) in self.lines(quantity).into_iter().enumerate() {
            let point = |row: &&Row| {
                let value = (quantity.value)(row).unwrap_or(f64::NAN);
                Point::new(row.n as f64, value)
            };
            let points = rows.iter().map(point).collect();
            plot = plot.series(Series::new(label, Style::Line, points).slot(slot));
        }
        if let Some(row) = quantity.best.map(|best| &self.rows[best])
            && let Some(value) = (quantity.value)(row)
        {
            let point = Point::new(row.n as f64, value);
            plot = plot.series(Series::new("best", Style::Marks, vec![point]).slot(BEST));
        }
        plot
    }

    /// Returns a line for each delay, or one with the best delay of each order.
    fn lines(&self, quantity: &Quantity<'_>) -> Vec<(String, Vec<&Row>)> {
        let same_delay = |a: &Row, b: &Row| a.orders.nk == b.orders.nk;
        let delays: Vec<&[Row]> = self.rows.chunk_by(same_delay).collect();
        if delays.len() <= MOST_LINES {
            let lines = delays.into_iter().map(|rows| {
                let label = format!("delay nk = {}", rows[0].orders.nk);
                (label, rows.iter().collect())
            });
            return lines.collect();
        }
        let sign = if quantity.larger { -1.0 } else { 1.0 };
        let rank = |row: &Row| (quantity.value)(row).map_or(f64::INFINITY, |value| sign * value);
        let best = (0..delays[0].len()).filter_map(|i| {
            let rows = delays.iter().map(|rows| &rows[i]);
            rows.min_by(|a, b| rank(a).total_cmp(&rank(b)))
        });
        vec![("best delay of each order".to_owned(), best.collect())]
    }

    /// Returns the page of the record with the table.
    pub(in crate::cli::estimate) fn page(&self, report: &Report) -> String {
        let mut page = page::begin(report);
        page.section("orders", "Which order?", |section| {
            section.paragraph(&format!(
                "Each line has {} over the same {} equations. A star marks the smallest \
                 value of each criterion, and at the largest FIT on the samples after the window.",
                self.models(),
                self.equations
            ));
            section.figure(
                &self.picture(),
                "Criteria and FIT of the simulated output over the order; the best of each is marked.",
            );
            section.table(&self.table());
        });
        page.html()
    }

    fn table(&self) -> Table {
        let criteria = Criterion::ALL.iter();
        let columns = [
            Column::number("n", ""),
            Column::number("nk", ""),
            Column::number("V", ""),
        ]
        .into_iter()
        .chain(criteria.map(|criterion| Column::number(criterion.heading(), "")))
        .chain(["FIT, window", "FIT, after it"].map(|fit| Column::number(fit, "%")));
        let mut table = Table::new("Models of each order and delay", columns.collect());
        for (i, row) in self.rows.iter().enumerate() {
            let cell = |value: Option<f64>, best: bool| {
                let text = value.map_or("-".to_owned(), |value| rounded(value, 6));
                let star = if best { " *" } else { "" };
                CellText::number(text + star, value.unwrap_or(f64::NAN))
            };
            let whole = |number: usize| CellText::number(number.to_string(), number as f64);
            let criteria = row.criteria.iter().zip(&self.best);
            let criteria = criteria.map(|(value, best)| cell(*value, *best == Some(i)));
            let fits = [
                cell(row.window_fit, false),
                cell(row.validation_fit, self.best_fit == Some(i)),
            ];
            let orders = [whole(row.n), whole(row.orders.nk), cell(row.loss, false)];
            table.row(orders.into_iter().chain(criteria).chain(fits));
        }
        table
    }
}
