//! The tables that commands print, on no page: the laws of d, times of methods, published numbers.

use super::{cell, count, none};
use crate::document::columns::Columns;
use crate::table::{CellText, Column, Table};
use asobench_identification::metric::Estimate;
use asobench_identification::number::{uncertain, uncertain_within};
use asobench_study::suite::{Laws, Reproduced, Times};

/// A number to three digits.
fn plain(x: f64) -> CellText {
    CellText::number(uncertain_within(x, 0.0, 3), x)
}

/// The law of d in each scenario.
pub fn law_table(laws: &Laws) -> Table {
    Columns::new(laws.scenarios.iter())
        .with(Column::text("scenario").width(18), |of| &of.name)
        .with(Column::number("lost", "").width(6), |of| count(of.lost as usize))
        .with(Column::number("mean d", "").width(10), |of| cell(of.mean(), 1.0))
        .with(Column::number("KS p", "").width(9), |of| plain(of.p))
        .with(Column::number("Holm", "").width(9), |of| plain(of.holm))
        .text("law", |of| of.verdict().name())
        .whole("")
}

/// The time of each method over that of the reference.
pub fn times_table(times: &Times) -> Table {
    Columns::new(times.methods.iter())
        .with(Column::text("method").width(15), |of| &of.method)
        .with(Column::number("scenarios", "").width(9), |of| count(of.scenarios.len()))
        .with(Column::number("time, of arx", "").width(13), |of| {
            cell(of.typical(), 1.0)
        })
        .with(Column::number("least", "").width(9), |of| plain(of.extremes()[0]))
        .with(Column::number("most", "").width(9), |of| plain(of.extremes()[1]))
        .with(Column::number("longest run", "ms").width(16), |of| {
            plain(1e3 * of.longest())
        })
        .whole("")
}

/// Printed numbers beside ours.
pub fn published_table(rows: &[Reproduced]) -> Table {
    let number = |of: Estimate| CellText::number(uncertain(of.value, of.mcse), of.value);
    Columns::new(rows.iter())
        .with(Column::text("").width(7), |of| &of.name)
        .with(Column::number("printed mean", "").width(15), |of| number(of.printed.0))
        .with(Column::number("ours", "").width(15), |of| number(of.ours.0))
        .with(Column::number("printed SD", "").width(14), |of| {
            of.printed.1.map_or_else(none, number)
        })
        .with(Column::number("ours", "").width(14), |of| number(of.ours.1))
        .with(Column::number("bound", "").width(10), |of| {
            of.bound.map_or_else(none, |x| CellText::number(format!("{x:.3e}"), x))
        })
        .with(Column::text("").width(7), |of| {
            if of.agrees() { "agrees" } else { "DIFFERS" }
        })
        .whole("")
}
