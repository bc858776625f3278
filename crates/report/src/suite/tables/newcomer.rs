//! The tables of a newcomer: beside the others, and where it lost runs.

use super::{SuiteTable, Tables, cell, count, percent};
use crate::document::columns::Columns;
use crate::table::Column;
use asobench_study::suite::{MethodResults, paired};

/// The meaning of a reason for a lost run; `None` for a failure whose name says it.
pub fn about_loss(reason: &str) -> Option<&'static str> {
    Some(match reason {
        "other orders" => "a model of a larger order than the method was told",
        "declined" => "the method cannot serve the scenario",
        "boundary" | "iteration-limit" => "the search came to no minimum",
        "unstable" => "a pole on or outside the unit circle",
        "crashed" => "the program ended before it answered",
        "timeout" => "no answer within the method's timeout",
        "malformed" => "an answer that docs/protocol.md does not allow",
        _ => return None,
    })
}

impl Tables<'_> {
    /// The newcomer's results.
    fn newcomer(&self) -> Option<&MethodResults> {
        let mut methods = self.of.methods.iter();
        methods.find(|of| Some(of.method.as_str()) == self.of.newcomer)
    }

    /// The newcomer beside each other method, on the same records.
    pub(in crate::suite) fn against(&self) -> Option<SuiteTable> {
        let own = self.newcomer()?;
        let others = self.of.methods.iter().filter(|of| of.method != own.method);
        let table = Columns::new(others.filter_map(|other| Some((other, paired(own, other)?))))
            .with(Column::text("beside").width(15), |(other, _)| &other.method)
            .with(Column::number("nearer", "%").width(10), |(_, of)| percent(of.win))
            .with(Column::number("tie", "%").width(7), |(_, of)| percent(of.tie))
            .with(Column::number("farther", "%").width(11), |(_, of)| percent(of.loss))
            .with(Column::number("nearer - farther", "%").width(20), |(_, of)| {
                cell(of.lead, 100.0)
            })
            .whole(format!(
                "{} beside each method on the same records: in how many runs it is nearer to the truth",
                own.method
            ));
        Some(self.table("newcomer", "The newcomer beside the others", table))
    }

    /// Where the newcomer lost runs, and why; `None` without any.
    pub(in crate::suite) fn own_losses(&self) -> Option<SuiteTable> {
        let own = self.newcomer()?;
        let scenarios = own.scenarios.iter();
        let lost = scenarios.flat_map(|of| of.lost.iter().map(move |(reason, runs)| (&of.name, reason, *runs)));
        let table = Columns::new(lost)
            .with(Column::text("scenario").width(18), |of| of.0)
            .with(Column::number("lost runs", "").width(9), |of| count(of.2 as usize))
            .with(Column::text("reason").width(15), |of| of.1)
            .text("what it means", |of| about_loss(of.1).unwrap_or("a numerical failure"))
            .whole(format!(
                "Where {} lost runs, and why; workers.log of a study has what a program printed",
                own.method
            ));
        self.table("lost", "Lost runs of the newcomer", table).unless_empty()
    }
}
