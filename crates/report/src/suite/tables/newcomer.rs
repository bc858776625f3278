//! The tables of a newcomer: beside the others, and where it lost runs.

use super::{SuiteTable, Tables, cell, percent};
use crate::table::{CellText, Column, Table};
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
    /// The newcomer beside each other method, on the same records.
    pub(in crate::suite) fn against(&self) -> Option<SuiteTable> {
        let newcomer = self.of.newcomer?;
        let is_it = |method: &&MethodResults| method.method == newcomer;
        let own = self.of.methods.iter().find(is_it)?;
        let columns = vec![
            Column::text("beside").width(15),
            Column::number("nearer", "%").width(10),
            Column::number("tie", "%").width(7),
            Column::number("farther", "%").width(11),
            Column::number("nearer - farther", "%").width(20),
        ];
        let caption =
            format!("{newcomer} beside each method on the same records: in how many runs it is nearer to the truth");
        let mut table = Table::new(caption, columns);
        for other in self.of.methods.iter().filter(|method| !is_it(method)) {
            let Some(found) = paired(own, other) else {
                continue;
            };
            table.row([
                CellText::text(other.method.clone()),
                percent(found.win),
                percent(found.tie),
                percent(found.loss),
                cell(found.lead, 100.0),
            ]);
        }
        let title = "The newcomer beside the others";
        Some(self.table("newcomer", title, table))
    }

    /// Where the newcomer lost runs, and why; `None` without any.
    pub(in crate::suite) fn own_losses(&self) -> Option<SuiteTable> {
        let newcomer = self.of.newcomer?;
        let own = self.of.methods.iter().find(|of| of.method == newcomer)?;
        let columns = vec![
            Column::text("scenario").width(18),
            Column::number("lost runs", "").width(9),
            Column::text("reason").width(15),
            Column::text("what it means"),
        ];
        let caption = format!("Where {newcomer} lost runs, and why; workers.log of a study has what a program printed");
        let mut table = Table::new(caption, columns);
        for scenario in &own.scenarios {
            for (reason, runs) in &scenario.lost {
                table.row([
                    CellText::text(scenario.name.clone()),
                    CellText::number(runs.to_string(), *runs as f64),
                    CellText::text(reason.clone()),
                    CellText::text(about_loss(reason).unwrap_or("a numerical failure")),
                ]);
            }
        }
        self.table("lost", "Lost runs of the newcomer", table).unless_empty()
    }
}
