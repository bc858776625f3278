//! A study's simulation, from the experiment file in its manifest, in the order of Morris, White and Crowther, Using
//! simulation studies to evaluate statistical methods, Statistics in Medicine 38 (2019) 2074-2102: aims,
//! data-generating mechanisms, estimands, methods, performance measures.

mod aims;
mod estimands;
mod mechanisms;
mod methods;
mod part;
mod performance;
mod words;

use crate::html::{CellText, Column, Section, Table, markdown_text};
use crate::results::Study;
use asobench_study::files::SIMULATED_TITLE;
use part::Part;

const ORDER: &str = "In the order of Morris, White and Crowther (2019). Names are those of the keys in the experiment \
    file, in parentheses units; `asobench explain NAME` says more of each.";

fn parts(study: &Study) -> [Part; 5] {
    [
        aims::part(study),
        mechanisms::part(study),
        estimands::part(study),
        methods::part(study),
        performance::part(study),
    ]
}

/// Adds the description to the section of a study. Defaults are hidden until a click.
pub(super) fn section(section: &mut Section, study: &Study) {
    section.heading("What was simulated");
    section.paragraph(ORDER);
    for part in parts(study) {
        section.subheading(part.heading);
        section.settings(&part.rows);
        if !part.defaults.is_empty() {
            let summary = format!("Defaults: {}", part.defaults.len());
            section.details(&summary, |section| section.settings(&part.defaults));
        }
    }
}

/// The description of every study as Markdown, a table for each part; defaults come last.
pub(super) fn markdown(studies: &[Study]) -> String {
    let mut text = format!("{SIMULATED_TITLE}\n{ORDER} Defaults come last.\n");
    for study in studies {
        text.push_str(&format!("\n## {}\n", markdown_text(study.title())));
        for part in parts(study) {
            let mut table = Table::new("", ["term", "value"].map(Column::text).to_vec());
            let defaults = part.defaults.into_iter();
            let defaults = defaults.map(|(term, value)| (term, format!("{value}; default")));
            for (term, value) in part.rows.into_iter().chain(defaults) {
                table.row([term, value].map(CellText::text));
            }
            text.push_str(&format!("\n### {}\n\n{}", part.heading, table.markdown()));
        }
    }
    text
}

#[cfg(test)]
mod tests;
