//! Claims, tables and figures. They read stored results, never a running study.

#[allow(clippy::format_push_string, reason = "lines of a terminal")]
mod compared;
#[allow(clippy::format_push_string, reason = "sentences of a few words")]
mod document;
mod failures;
mod figures;
mod folder;
mod gpebo_table;
pub mod html;
mod index;
mod latex;
mod markup;
pub mod plot;
mod results;
mod suite;
mod table;
#[allow(clippy::format_push_string, reason = "lines of a terminal")]
pub mod terminal;
#[cfg(test)]
mod tests;
mod verdict_table;

use asobench_identification::number;
pub use asobench_identification::number::uncertain;
pub use compared::compared;
pub use document::{Chosen, Kind as FigureKind, Mark, chosen_figure, course_figures, held, report};
pub use failures::failures;
pub use figures::{OneTrial, TrialErrors, draw};
pub use folder::{Files, prepare as prepare_report, write as write_report};
pub use gpebo_table::{ends, example_table};
pub use results::{ResultsError, Study, Time};
pub use suite::{
    SuitePage, SuiteTable, about_loss, law_table, published_table, recorded_tables, suite_page, suite_tables,
    times_table,
};
pub use verdict_table::verdict_table;
