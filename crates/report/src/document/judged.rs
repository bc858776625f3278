//! The verdicts on the claims of an experiment file: for each a sentence, a figure and the cells it rests on.

mod picture;
mod words;

use super::answer::capital;
use super::beside::Beside;
use super::columns::Columns;
use super::extremes::LongTable;
use super::paper;
use super::tables::tidy;
use crate::folder::Files;
use crate::html::{CellText, Section, Table, markdown_text};
use crate::results::Study;
use asobench_study::claim::{Judged, JudgedCell, JudgedNumber, Standing};
use asobench_study::text::{file_part, grouped};
use picture::pictures;
use words::{heading, is_share, levels, numbers, place, unit};

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
    let mut columns = Columns::new(all(studies))
        .text("claim", |(study, claim)| {
            CellText::text(&claim.id).link(format!("#{}:{}", study.name, claim.id))
        })
        .text("verdict", |of| CellText::verdict(of.1.verdict))
        .text("what it says", |of| &of.1.text)
        .text("source", |of| &of.1.source)
        .text("experiment", |(study, _)| {
            CellText::text(study.title()).link(format!("#{}", study.name))
        });
    if all(studies).any(|(_, claim)| claim.standing != Standing::Planned) {
        columns = columns.text("standing", |of| of.1.standing.name());
    }
    section.table(&columns.whole("The claims of the experiment files."));
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
    Columns::new(all(studies))
        .text("claim", |of| &of.1.id)
        .text("what it says", |of| &of.1.text)
        .text("verdict", |of| verdict(of.1))
        .text("experiment", |of| &of.0.name)
        .whole("")
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
    let exact = |x: f64| CellText::number("", x);
    let rows = all(studies).flat_map(|(study, claim)| {
        let known = numbers(claim).filter_map(|(cell, number)| Some((cell, number, claim.tests.get(number.test)?)));
        known.map(move |(cell, number, test)| (study, claim, cell, number, test))
    });
    Columns::new(rows)
        .text("claim", |of| &of.1.id)
        .text("number", |of| of.3.what.trim_end_matches(','))
        .number("value", "", |of| exact(unit(of.4) * of.3.value))
        .number("MCSE", "", |of| exact(unit(of.4) * of.3.error))
        .text("must be", |of| &of.4.must)
        .text("experiment", |of| &of.0.name)
        .text("where", |of| &of.2.place)
        .text("says", |of| of.2.says)
        .number("p (pass)", "", |of| exact(of.2.p_pass))
        .number("p (fail)", "", |of| exact(of.2.p_fail))
        .number("level", "", |of| exact(of.2.level.unwrap_or(f64::NAN)))
        .text("standing", |of| of.1.standing.name())
        .table("", "")
        .take_csv()
}

/// Adds a part for each claim of a study: the verdict with its sentence, its figures, and the cells as a detail that
/// opens on a click.
pub(super) fn verdicts(section: &mut Section, study: &Study, files: &mut Files) {
    for claim in &study.judged {
        let mut beside = Beside::new(study, files);
        let name = format!("claim-{}", file_part(&claim.id));
        section.part(&claim.id, claim.verdict, &claim.id, |section| {
            if !claim.text.is_empty() {
                let source = match claim.source.as_str() {
                    "own" => String::new(),
                    source => format!(" ({source})"),
                };
                section.claim(&format!("\u{201c}{}\u{201d}{source}", claim.text));
            }
            section.paragraph(&sentence(claim));
            for (i, drawn) in pictures(study, claim).iter().enumerate() {
                let number = if i == 0 { String::new() } else { format!("-{}", i + 1) };
                let label = format!("claim-{}{number}", claim.id);
                beside.figure(section, drawn, (&format!("{name}{number}"), &label));
            }
            if claim.cells.is_empty() {
                return;
            }
            let mut table = cells(claim);
            beside.table(&mut table, &name, &format!("{}: {}", claim.id, claim.text), true);
            let cells = grouped(claim.cells.len() as u64);
            let summary = format!("The cells behind the verdict: {cells}");
            section.details(&summary, |section| {
                table.show(section, &format!("claim-{}.csv", claim.id));
                section.files(&beside.links);
            });
        });
    }
}

/// The part of the claim's line after id and verdict.
fn sentence(claim: &Judged) -> String {
    let begin = format!("{}  {}", claim.id, claim.verdict);
    let rest = claim.line.strip_prefix(&begin).unwrap_or(&claim.line);
    capital(rest.trim_start_matches([':', ' ']))
}

/// The table of cells: the number, its condition, the verdict of the cell, and two p-values. Shares, such as coverages,
/// are in per cent.
fn cells(claim: &Judged) -> LongTable {
    let more = |cell: &JudgedCell| cell.numbers.len() > 1 || cell.case.is_some() || !cell.missing.is_empty();
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
    let are_shares = claim.tests.iter().all(is_share);
    let rows = claim.cells.iter().flat_map(|cell| {
        let missing = cell.missing.iter().map(|why| Err(why.as_str()));
        let rows = cell.numbers.iter().map(Ok).chain(missing);
        rows.map(move |number| (cell, number))
    });
    let test = |number: &JudgedNumber| claim.tests.get(number.test);
    let p = |row: &Row<'_>, p: f64| match row.1 {
        Ok(_) => CellText::number(p_value(p), p),
        Err(_) => CellText::default(),
    };
    let mut columns = Columns::new(rows).text("cell", |row| place(row.0));
    if several {
        columns = columns
            .text("number", |row| match row.1 {
                Ok(number) => number.what.trim_end_matches(','),
                Err(why) => why,
            })
            .text("must be", |row| {
                let test = row.1.ok().and_then(test);
                test.map_or("", |test| &test.must)
            });
    }
    columns
        .number("value", if are_shares { "%" } else { "" }, |row| match row.1 {
            Ok(number) => {
                let kept = number.kept.map(|kept| format!(" of {:.1} %", 100.0 * kept));
                let text = format!("{}{}", number.text, kept.unwrap_or_default());
                CellText::number(text, tidy(test(number).map_or(1.0, unit) * number.value))
            }
            Err(why) => CellText::text(if several { "-" } else { why }),
        })
        .text("verdict", |row| row.0.says)
        .number("p (pass)", "", |row| p(row, row.0.p_pass))
        .number("p (fail)", "", |row| p(row, row.0.p_fail))
        .number("level", "", |row| match row.1 {
            Ok(_) => level(row.0),
            Err(_) => CellText::default(),
        })
        .table(&caption, "value")
}

/// A number of a cell, or why it is missing.
type Row<'a> = (&'a JudgedCell, Result<&'a JudgedNumber, &'a str>);

fn p_value(p: f64) -> String {
    match p {
        p if p < 1e-6 => "< 1e-6".to_owned(),
        p if p < 0.01 => format!("{p:.1e}"),
        p => format!("{p:.2}"),
    }
}

/// The level of a cell.
fn level(cell: &JudgedCell) -> CellText {
    let text = |level: f64| match level {
        level if level < 0.01 => format!("{level:.1e}"),
        level => format!("{level:.3}"),
    };
    cell.level
        .map_or_else(CellText::default, |level| CellText::number(text(level), level))
}

#[cfg(test)]
mod tests;
