//! The verdicts on the claims of an experiment file: for each a sentence, a figure and the cells it rests on.

mod picture;
mod words;

use super::extremes::LongTable;
use super::figure::Drawn;
use super::paper;
use super::tables::tidy;
use crate::folder::Files;
use crate::html::{CellText, Column, Section, Table, markdown_text};
use crate::results::Study;
use asobench_study::claim::{Judged, JudgedCell, JudgedNumber, Standing};
use asobench_study::text::grouped;
use picture::pictures;
use words::{heading, is_share, levels, place, unit};

/// Every claim with its study.
fn all(studies: &[Study]) -> impl Iterator<Item = (&Study, &Judged)> {
    studies
        .iter()
        .flat_map(|study| study.judged.iter().map(move |claim| (study, claim)))
}

/// Whether any study has a judged claim.
pub(super) fn are_there(studies: &[Study]) -> bool {
    studies.iter().any(|study| !study.judged.is_empty())
}

/// A table of the claims of all studies, with links to them.
pub(super) fn overview(section: &mut Section, studies: &[Study]) {
    let columns = ["claim", "verdict", "what it says", "source", "experiment"].map(Column::text);
    let mut columns = columns.to_vec();
    let with_standing = all(studies).any(|(_, claim)| claim.standing != Standing::Planned);
    if with_standing {
        columns.push(Column::text("standing"));
    }
    let mut table = Table::new("The claims of the experiment files.", columns);
    for (study, claim) in all(studies) {
        let mut row = vec![
            CellText::text(&claim.id).link(format!("#{}:{}", study.name, claim.id)),
            CellText::verdict(claim.verdict),
            CellText::text(&claim.text),
            CellText::text(&claim.source),
            CellText::text(study.title()).link(format!("#{}", study.name)),
        ];
        if with_standing {
            row.push(CellText::text(claim.standing.name()));
        }
        table.row(row);
    }
    section.table(&table);
    for study in studies {
        let Some(tested) = study.tested() else {
            continue;
        };
        match studies {
            [_] => section.paragraph(&tested),
            _ => section.paragraph(&format!("{}: {tested}", study.title())),
        }
    }
}

/// The verdict on a claim, with its standing if the claim was not planned.
fn verdict(claim: &Judged) -> String {
    match claim.standing {
        Standing::Planned => claim.verdict.name().to_owned(),
        standing => format!("{} ({standing})", claim.verdict),
    }
}

/// Each claim with its verdict, in few columns.
fn short(studies: &[Study]) -> Table {
    let columns = ["claim", "what it says", "verdict", "experiment"].map(Column::text);
    let mut table = Table::new("", columns.to_vec());
    for (study, claim) in all(studies) {
        table.row([
            CellText::text(&claim.id),
            CellText::text(&claim.text),
            CellText::text(verdict(claim)),
            CellText::text(&study.name),
        ]);
    }
    table
}

/// The table of verdicts for a paper, if it fits a page of one.
pub(super) fn for_paper(studies: &[Study]) -> Files {
    let table = short(studies);
    if paper::fits(&table) {
        paper::files("verdicts", "Verdicts", &table)
    } else {
        Files::new()
    }
}

/// The table of verdicts and the line of each claim, as Markdown.
pub(super) fn markdown(studies: &[Study]) -> String {
    let mut text = format!("# Verdicts\n\n{}", short(studies).markdown());
    for study in studies.iter().filter(|study| !study.judged.is_empty()) {
        text.push_str(&format!("\n## {}\n", markdown_text(study.title())));
        for claim in &study.judged {
            text.push_str(&format!("\n{}\n", markdown_text(&claim.line)));
        }
        if let Some(tested) = study.tested() {
            text.push_str(&format!("\n{}\n", markdown_text(&tested)));
        }
    }
    text
}

/// All numbers behind the verdicts, as CSV. Shares, such as coverages, are in per cent.
pub(super) fn csv(studies: &[Study]) -> String {
    let mut columns = ["claim", "number"].map(Column::text).to_vec();
    columns.extend(["value", "MCSE"].map(|name| Column::number(name, "")));
    columns.extend(["must be", "experiment", "where", "says"].map(Column::text));
    columns.extend(["p (pass)", "p (fail)", "level"].map(|name| Column::number(name, "")));
    columns.push(Column::text("standing"));
    let mut table = Table::new("", columns);
    let number = |x: f64| CellText::number("", x);
    for (study, claim) in all(studies) {
        for cell in &claim.cells {
            let known = |judged: &&JudgedNumber| judged.test < claim.tests.len();
            for judged in cell.numbers.iter().filter(known) {
                let what = judged.what.trim_end_matches(',');
                let mut row = [claim.id.as_str(), what].map(CellText::text).to_vec();
                let unit = unit(&claim.tests[judged.test]);
                row.extend([unit * judged.value, unit * judged.error].map(number));
                row.extend([must(claim, judged), &study.name, &cell.place].map(CellText::text));
                row.push(CellText::text(cell.says));
                let level = cell.level.unwrap_or(f64::NAN);
                row.extend([cell.p_pass, cell.p_fail, level].map(number));
                row.push(CellText::text(claim.standing.name()));
                table.row(row);
            }
        }
    }
    table.csv()
}

/// Adds a part for each claim of a study: the verdict with its sentence, its figures, and the cells as a detail that
/// opens on a click.
pub(super) fn verdicts(section: &mut Section, study: &Study, files: &mut Files) {
    for claim in &study.judged {
        let mut links = Vec::new();
        let name = format!("{}-claim-{}", study.name, file_name(&claim.id));
        section.part(&claim.id, claim.verdict, &claim.id, |section| {
            if !claim.text.is_empty() {
                let source = match claim.source.as_str() {
                    "own" => String::new(),
                    source => format!(" ({source})"),
                };
                section.claim(&format!("\u{201c}{}\u{201d}{source}", claim.text));
            }
            section.paragraph(&sentence(claim));
            for (i, Drawn { svg, caption, .. }) in pictures(study, claim).into_iter().enumerate() {
                let number = if i == 0 {
                    String::new()
                } else {
                    format!("-{}", i + 1)
                };
                section.figure(&svg, &caption);
                let path = format!("figures/{name}{number}.svg");
                links.push((format!("claim-{}{number}.svg", claim.id), path.clone()));
                files.push((path, svg));
            }
            if claim.cells.is_empty() {
                return;
            }
            let mut table = cells(claim);
            let mut all = vec![(format!("tables/{name}.csv"), table.take_csv())];
            if let Some(table) = table.for_paper() {
                all.extend(paper::files(
                    &name,
                    &format!("{}: {}", claim.id, claim.text),
                    table,
                ));
            }
            let label = format!("claim-{}.csv", claim.id);
            links.extend(
                all.iter()
                    .map(|(path, _)| (paper::label(path, &study.name), path.clone())),
            );
            files.extend(all);
            let cells = grouped(claim.cells.len() as u64);
            let summary = format!("The cells behind the verdict: {cells}");
            section.details(&summary, |section| {
                let (table, note) = table.shown(&label);
                if let Some(note) = &note {
                    section.paragraph(note);
                }
                section.table(&table);
                section.files(&links);
            });
        });
    }
}

/// Turns an id from any author into a part of a file name.
fn file_name(id: &str) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    id.chars().map(|c| if kept(c) { c } else { '-' }).collect()
}

/// The part of the claim's line after id and verdict.
fn sentence(claim: &Judged) -> String {
    let begin = format!("{}  {}", claim.id, claim.verdict);
    let rest = claim.line.strip_prefix(&begin).unwrap_or(&claim.line);
    let rest = rest.trim_start_matches([':', ' ']);
    let mut letters = rest.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

/// The table of cells: the number, its condition, the verdict of the cell, and two p-values. Shares, such as coverages,
/// are in per cent.
fn cells(claim: &Judged) -> LongTable {
    let more = |cell: &JudgedCell| {
        cell.numbers.len() > 1 || cell.case.is_some() || !cell.missing.is_empty()
    };
    let several = claim.tests.len() > 1 || claim.cells.iter().any(more);
    let mut caption = match claim.tests.as_slice() {
        [test] => format!("{} must be {}. ", heading(&test.what), test.must),
        _ => "All tests must pass in a cell. ".to_owned(),
    };
    caption.push_str(&format!(
        "p (pass) is the p-value of the hypothesis \"the cell does not pass\", p (fail) that of \"the cell passes\". A \
         cell passes or fails if that p-value is at most the level of the cell: {}.",
        levels(claim)
    ));
    let mut columns = vec![Column::text("cell")];
    if several {
        columns.extend(["number", "must be"].map(Column::text));
    }
    let are_shares = claim.tests.iter().all(is_share);
    let unit = if are_shares { "%" } else { "" };
    columns.extend([Column::number("value", unit), Column::text("verdict")]);
    columns.extend(["p (pass)", "p (fail)", "level"].map(|name| Column::number(name, "")));
    let mut table = LongTable::new(&caption, columns, "value");
    for cell in &claim.cells {
        for number in &cell.numbers {
            table.row(row(claim, cell, number, several));
        }
        for why in &cell.missing {
            let mut row = vec![CellText::text(place(cell))];
            if several {
                row.extend([CellText::text(why), CellText::default()]);
            }
            let why = if several { "-" } else { why };
            row.extend([CellText::text(why), CellText::text(cell.says)]);
            table.row(row);
        }
    }
    table
}

fn row(claim: &Judged, cell: &JudgedCell, number: &JudgedNumber, several: bool) -> Vec<CellText> {
    let text = |p: f64| match p {
        p if p < 1e-6 => "< 1e-6".to_owned(),
        p if p < 0.01 => format!("{p:.1e}"),
        p => format!("{p:.2}"),
    };
    let p = |p: f64| CellText::number(text(p), p);
    let must = must(claim, number);
    let mut row = vec![CellText::text(place(cell))];
    if several {
        row.extend([number.what.trim_end_matches(','), must].map(CellText::text));
    }
    let kept = number
        .kept
        .map_or_else(String::new, |kept| format!(" of {:.1} %", 100.0 * kept));
    let unit = claim.tests.get(number.test).map_or(1.0, unit);
    let value = CellText::number(format!("{}{kept}", number.text), tidy(unit * number.value));
    row.extend([
        value,
        CellText::text(cell.says),
        p(cell.p_pass),
        p(cell.p_fail),
        level(cell),
    ]);
    row
}

/// The level of a cell.
fn level(cell: &JudgedCell) -> CellText {
    let text = |level: f64| match level {
        level if level < 0.01 => format!("{level:.1e}"),
        level => format!("{level:.3}"),
    };
    cell.level.map_or_else(CellText::default, |level| {
        CellText::number(text(level), level)
    })
}

/// The condition on a number.
fn must<'a>(claim: &'a Judged, number: &JudgedNumber) -> &'a str {
    claim.tests.get(number.test).map_or("", |test| &test.must)
}

#[cfg(test)]
mod tests;
