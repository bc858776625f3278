//! The verdicts on the claims of an experiment file: a sentence each, and the cells behind it.

use crate::claim::{self, Judged, JudgedCell};
use crate::report::html::{CellText, Column, Section, Table, Verdict};
use crate::report::number::uncertain;
use crate::report::results::Study;

fn verdict(of: &Judged) -> Verdict {
    match of.verdict {
        claim::Verdict::Holds => Verdict::Holds,
        claim::Verdict::HoldsInPart => Verdict::HoldsInPart,
        claim::Verdict::DoesNotHold => Verdict::DoesNotHold,
        claim::Verdict::Undecided => Verdict::Undecided,
    }
}

/// The claims of all studies, in a table that leads to them.
pub(super) fn overview(section: &mut Section, studies: &[Study]) {
    let columns = ["claim", "verdict", "what it says", "source", "experiment"].map(Column::text);
    let mut table = Table::new("The claims of the experiment files.", columns.to_vec());
    for study in studies {
        for claim in &study.judged {
            table.row([
                CellText::text(&claim.id),
                CellText::verdict(verdict(claim)),
                CellText::text(&claim.text),
                CellText::text(&claim.source),
                CellText::text(study.title()).link(format!("#{}", study.name)),
            ]);
        }
    }
    if !table.rows.is_empty() {
        section.table(&table);
    }
}

/// The verdicts on a study's claims; their cells are seen after a click.
pub(super) fn verdicts(section: &mut Section, study: &Study) {
    for claim in &study.judged {
        let text = if claim.text.is_empty() {
            String::new()
        } else {
            format!("\u{201c}{}\u{201d} ", claim.text)
        };
        section.answer(verdict(claim), &format!("{text}{}", claim.line));
        if !claim.cells.is_empty() {
            let summary = format!("The {} cells of {}", claim.cells.len(), claim.id);
            section.details(&summary, |section| section.table(&cells(claim)));
        }
    }
}

/// What every cell says: the number that was looked at, what it must be, and two p-values.
fn cells(claim: &Judged) -> Table {
    let caption = format!(
        "One-sided p-values: that the test is not passed, and that it is. Certain at {} per cent.",
        crate::text::number(100.0 * claim.level)
    );
    let mut columns = ["where", "says", "number", "must be"]
        .map(Column::text)
        .to_vec();
    columns.extend(["value", "p (pass)", "p (fail)"].map(|name| Column::number(name, "")));
    let mut table = Table::new(caption, columns);
    for cell in &claim.cells {
        for (place, part) in rows(cell) {
            table.row(place.into_iter().chain(part));
        }
    }
    table
}

/// A row for every number of a cell, or one that says what is missing.
fn rows(cell: &JudgedCell) -> Vec<([CellText; 2], Vec<CellText>)> {
    let place = || [CellText::text(&cell.place), CellText::text(cell.says)];
    let p = |p: f64| CellText::number(format!("{p:.2e}"), p);
    let numbers = cell.numbers.iter().map(|number| {
        let value = CellText::number(uncertain(number.value, number.error), number.value);
        let texts = [&number.what, &number.must].map(CellText::text);
        let mut row = texts.to_vec();
        row.extend([value, p(cell.p_pass), p(cell.p_fail)]);
        (place(), row)
    });
    let missing = cell
        .missing
        .iter()
        .map(|why| (place(), vec![CellText::text(why)]));
    numbers.chain(missing).collect()
}
