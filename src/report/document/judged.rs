//! The verdicts on the claims of an experiment file: a sentence each, and the cells behind it.

use crate::claim::{Judged, JudgedCell};
use crate::report::html::{CellText, Column, Section, Table, markdown_text};
use crate::report::number::uncertain;
use crate::report::results::Study;

/// Every claim with its study.
fn all(studies: &[Study]) -> impl Iterator<Item = (&Study, &Judged)> {
    studies
        .iter()
        .flat_map(|study| study.judged.iter().map(move |claim| (study, claim)))
}

/// Whether a study has a claim that is judged.
pub(super) fn are_there(studies: &[Study]) -> bool {
    studies.iter().any(|study| !study.judged.is_empty())
}

/// The claims of all studies, in a table that leads to them.
pub(super) fn overview(section: &mut Section, studies: &[Study]) {
    let columns = ["claim", "verdict", "what it says", "source", "experiment"].map(Column::text);
    let mut table = Table::new("The claims of the experiment files.", columns.to_vec());
    for (study, claim) in all(studies) {
        table.row([
            CellText::text(&claim.id),
            CellText::verdict(claim.verdict),
            CellText::text(&claim.text),
            CellText::text(&claim.source),
            CellText::text(study.title()).link(format!("#{}", study.name)),
        ]);
    }
    section.table(&table);
}

/// The table of verdicts and the line of each, for documents.
pub(super) fn markdown(studies: &[Study]) -> String {
    let columns = ["claim", "what it says", "verdict", "experiment"].map(Column::text);
    let mut table = Table::new("", columns.to_vec());
    for (study, claim) in all(studies) {
        table.row([
            CellText::text(&claim.id),
            CellText::text(&claim.text),
            CellText::text(claim.verdict.name()),
            CellText::text(&study.name),
        ]);
    }
    let mut text = format!("# Verdicts\n\n{}", table.markdown());
    for study in studies.iter().filter(|study| !study.judged.is_empty()) {
        text.push_str(&format!("\n## {}\n", markdown_text(study.title())));
        for claim in &study.judged {
            text.push_str(&format!("\n{}\n", markdown_text(&claim.line)));
        }
    }
    text
}

/// Every number behind a verdict, as CSV.
pub(super) fn csv(studies: &[Study]) -> String {
    let mut columns = ["claim", "number"].map(Column::text).to_vec();
    columns.extend(["value", "MCSE"].map(|name| Column::number(name, "")));
    columns.extend(["must be", "experiment", "where", "says"].map(Column::text));
    columns.extend(["p (pass)", "p (fail)"].map(|name| Column::number(name, "")));
    let mut table = Table::new("", columns);
    let number = |x: f64| CellText::number("", x);
    for (study, claim) in all(studies) {
        for cell in &claim.cells {
            for of in &cell.numbers {
                let mut row = [&claim.id, &of.what].map(CellText::text).to_vec();
                row.extend([of.value, of.error].map(number));
                row.extend([&of.must, &study.name, &cell.place].map(CellText::text));
                row.push(CellText::text(cell.says));
                row.extend([cell.p_pass, cell.p_fail].map(number));
                table.row(row);
            }
        }
    }
    table.csv()
}

/// The verdicts on a study's claims; their cells are seen after a click.
pub(super) fn verdicts(section: &mut Section, study: &Study) {
    for claim in &study.judged {
        let text = if claim.text.is_empty() {
            String::new()
        } else {
            format!("\u{201c}{}\u{201d} ", claim.text)
        };
        section.answer(claim.verdict, &format!("{text}{}", claim.line));
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
