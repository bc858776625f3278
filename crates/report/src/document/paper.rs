//! The tables that a reader may put into a paper: of the verdicts, of the cells of a claim, and of the measures, where
//! they have few enough rows, as LaTeX and as CSV, with their
//! Monte-Carlo errors in parentheses.

use crate::folder::Files;
use crate::html::{CellText, Table};

/// The most lines of a table that fits a page of a paper. A longer one is only in its CSV file with all digits.
const LINES: usize = 50;

/// The characters of a text that fill a line of its column.
const WIDTH: usize = 20;

/// The tables of measures that a paper shows. Times are of one machine, failures are told in the text, and the results
/// hold every statistic of every output, for programs.
pub(super) const NAMES: [&str; 5] = ["overview", "coverage", "slopes", "bounds", "comparisons"];

/// Whether a page of a paper has room for the table.
pub(super) fn fits(table: &Table) -> bool {
    let lines = |row: &Vec<CellText>| {
        let longest = row.iter().map(|cell| cell.text.chars().count()).max();
        longest.unwrap_or(0).div_ceil(WIDTH).max(1)
    };
    table.rows.iter().map(lines).sum::<usize>() <= LINES
}

/// The files of a table with its paths in the report: `tables/NAME.tex` and `tables/NAME-paper.csv`.
pub(crate) fn files(name: &str, title: &str, table: &Table) -> Files {
    vec![
        (format!("tables/{name}.tex"), table.latex(name, title)),
        (format!("tables/{name}-paper.csv"), table.csv_as_shown()),
    ]
}

/// Links to files of a study: what they say, and the paths.
pub(crate) fn links(files: &Files, study: &str) -> Vec<(String, String)> {
    let link = |(path, _): &(String, String)| (label(path, study), path.clone());
    files.iter().map(link).collect()
}

/// The label of a link to a file of a study: its name without folder and study.
pub(super) fn label(path: &str, study: &str) -> String {
    let name = path.strip_prefix("tables/").unwrap_or(path);
    let own = name.strip_prefix(study).and_then(|name| name.strip_prefix('-'));
    own.unwrap_or(name).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::Column;

    #[test]
    fn a_page_has_room_for_fifty_lines() {
        let table = |rows: usize, letters: usize| {
            let mut table = Table::new("", vec![Column::text("a")]);
            (0..rows).for_each(|_| table.row([CellText::text("x".repeat(letters))]));
            table
        };
        assert!(fits(&table(50, 0)) && fits(&table(50, 20)) && fits(&table(25, 40)));
        assert!(!fits(&table(51, 1)) && !fits(&table(25, 41)));
    }

    #[test]
    fn links_are_called_without_the_study() {
        assert_eq!(label("tables/my-study-overview.tex", "my-study"), "overview.tex");
        assert_eq!(label("tables/verdicts.tex", ""), "verdicts.tex");
        assert_eq!(label("tables/another.tex", "my"), "another.tex");
    }
}
