//! The tables that a reader may put into a paper: of the verdicts, of the cells of a claim, and of the measures, where
//! they have few enough rows, as LaTeX and as CSV, with their
//! Monte-Carlo errors in parentheses.

use super::Files;
use crate::report::html::Table;

/// The most rows of a table that fits a page of a paper. A longer one is only in its CSV file with all digits.
pub(super) const ROWS: usize = 50;

/// The tables of measures that a paper shows. Times are of one machine, failures are told in the text, and the results hold
/// every statistic of every output, for programs.
pub(super) const NAMES: [&str; 5] = ["overview", "coverage", "slopes", "bounds", "comparisons"];

/// The files of a table with its paths in the report: `tables/NAME.tex` and `tables/NAME-paper.csv`.
pub(super) fn files(name: &str, title: &str, table: &Table) -> Files {
    vec![
        (format!("tables/{name}.tex"), table.latex(name, title)),
        (format!("tables/{name}-paper.csv"), table.csv_as_shown()),
    ]
}

/// The label of a link to a file of a study: its name without folder and study.
pub(super) fn label(path: &str, study: &str) -> String {
    let name = path.strip_prefix("tables/").unwrap_or(path);
    let own = name
        .strip_prefix(study)
        .and_then(|name| name.strip_prefix('-'));
    own.unwrap_or(name).to_owned()
}
