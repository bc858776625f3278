//! One table in all its forms: as CSV with all digits or as a paper has them, as Markdown and as lines of text; for a
//! page (`crate::html`), and as LaTeX (`crate::latex`).

use asobench_identification::data::csv;
use asobench_study::claim::Verdict;
use asobench_study::text;

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// The quantity.
    pub title: String,
    /// Its unit; empty if it has none.
    pub unit: String,
    /// Whether cells are numbers: aligned right, sorted by value, and written to CSV with all digits.
    pub numeric: bool,
    /// Its width in characters where the table is text; a longer cell pushes the others.
    pub width: usize,
}

impl Column {
    /// A column of texts.
    pub fn text(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            unit: String::new(),
            numeric: false,
            width: 0,
        }
    }

    /// A column of numbers.
    pub fn number(title: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            unit: unit.into(),
            numeric: true,
            width: 0,
        }
    }

    /// Returns the column with a width for text.
    #[must_use]
    pub fn width(mut self, width: usize) -> Self {
        self.width = width;
        self
    }

    /// Title and unit in one text.
    pub(crate) fn heading(&self) -> String {
        if self.unit.is_empty() {
            self.title.clone()
        } else {
            format!("{} ({})", self.title, self.unit)
        }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellText {
    /// The text shown.
    pub text: String,
    /// The sort key. In a column of numbers, cells without one come last.
    pub sort_value: Option<f64>,
    /// The verdict to show as a badge instead of the text.
    pub verdict: Option<Verdict>,
    /// The target of a link: `#id` of a section, or a file beside the page.
    pub link: Option<String>,
    /// Whether it is the best of its row, shown in bold.
    pub best: bool,
}

impl CellText {
    /// A text, sorted as text.
    pub fn text(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            ..Self::default()
        }
    }

    /// A number with its text, as written by [`crate::uncertain`].
    pub fn number(text: impl Into<String>, value: f64) -> Self {
        Self {
            sort_value: value.is_finite().then_some(value),
            ..Self::text(text)
        }
    }

    /// Returns the cell, marked where it is the best of its row.
    #[must_use]
    pub fn best(mut self, best: bool) -> Self {
        self.best = best;
        self
    }

    /// A verdict as a badge; cells are sorted from "holds" to "undecided".
    pub fn verdict(verdict: Verdict) -> Self {
        Self {
            sort_value: Some(f64::from(verdict as u8)),
            verdict: Some(verdict),
            ..Self::text(verdict.name())
        }
    }

    /// Returns the cell with a link.
    #[must_use]
    pub fn link(mut self, target: impl Into<String>) -> Self {
        self.link = Some(target.into());
        self
    }
}

impl<S: Into<String>> From<S> for CellText {
    /// A text, sorted as text.
    fn from(text: S) -> Self {
        Self::text(text)
    }
}

/// Whether the page's script can read the number from its text: `0.0879(5)`, `3.21(4)e-13`.
pub(crate) fn reads_as_number(text: &str) -> bool {
    let plain = match (text.find('('), text.find(')')) {
        (Some(open), Some(close)) if open < close => [&text[..open], &text[close + 1..]].concat(),
        _ => text.to_owned(),
    };
    plain.parse::<f64>().is_ok_and(f64::is_finite)
}

/// A table of texts and numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// A description of the content.
    pub caption: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows, each with a cell for every column.
    pub rows: Vec<Vec<CellText>>,
}

impl Table {
    /// A table without rows.
    pub fn new(caption: impl Into<String>, columns: Vec<Column>) -> Self {
        Self {
            caption: caption.into(),
            columns,
            rows: Vec::new(),
        }
    }

    /// Adds a row; missing cells at its end are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = CellText>) {
        let mut row: Vec<CellText> = cells.into_iter().collect();
        row.resize(self.columns.len(), CellText::default());
        self.rows.push(row);
    }

    /// Pairs each column with its cell of a row.
    pub(crate) fn cells<'a>(&'a self, row: &'a [CellText]) -> impl Iterator<Item = (&'a Column, &'a CellText)> {
        self.columns.iter().zip(row)
    }

    /// The table as CSV (RFC 4180, with CRLF). A numeric cell is its sort value with all digits, any other cell its
    /// text.
    pub fn csv(&self) -> String {
        let rows = self.rows.iter().map(|row| self.csv_row(row));
        self.csv_head() + &rows.collect::<String>()
    }

    /// The table as CSV with every cell as on the page: numbers with their standard errors in parentheses.
    pub fn csv_as_shown(&self) -> String {
        let rows = self.rows.iter().map(|row| {
            csv_line(self.cells(row).map(|(column, cell)| match cell.text.as_str() {
                number if column.numeric && reads_as_number(number) => csv::Cell::Rounded(number),
                text => csv::Cell::Text(text),
            }))
        });
        self.csv_head() + &rows.collect::<String>()
    }

    fn csv_head(&self) -> String {
        let headings: Vec<String> = self.columns.iter().map(Column::heading).collect();
        csv_line(headings.iter().map(|heading| csv::Cell::Text(heading)))
    }

    /// Formats a row, which need not be in this table, as a line of [`Self::csv`].
    pub fn csv_row(&self, row: &[CellText]) -> String {
        csv_line(self.cells(row).map(|(column, cell)| match cell.sort_value {
            Some(value) if column.numeric => csv::Cell::Number(value),
            _ => csv::Cell::Text(&cell.text),
        }))
    }

    /// The headings as a line of text.
    pub fn text_head(&self) -> String {
        self.text_line(self.columns.iter().map(Column::heading))
    }

    /// Formats a row, which need not be in this table, as a line of text.
    pub fn text_row(&self, row: &[CellText]) -> String {
        self.text_line(row.iter().map(|cell| cell.text.clone()))
    }

    /// The table as lines of text, without its caption.
    pub fn text(&self) -> String {
        let rows = self.rows.iter().map(|row| self.text_row(row));
        self.text_head() + &rows.collect::<String>()
    }

    /// Puts cells side by side with a space between them, numbers to the right.
    fn text_line(&self, cells: impl Iterator<Item = String>) -> String {
        let cells = self.columns.iter().zip(cells).map(|(column, cell)| {
            let width = column.width;
            if column.numeric {
                format!("{cell:>width$}")
            } else {
                format!("{cell:width$}")
            }
        });
        let line = cells.collect::<Vec<_>>().join(" ");
        line.trim_end().to_owned() + "\n"
    }

    /// The table as Markdown (GitHub's dialect), with its caption in bold above.
    pub fn markdown(&self) -> String {
        let mut text = match self.caption.as_str() {
            "" => String::new(),
            caption => format!("**{}**\n\n", markdown_text(caption)),
        };
        text += &markdown_line(self.columns.iter().map(|column| markdown_text(&column.heading())));
        let rule = |column: &Column| if column.numeric { "--:" } else { ":--" }.to_owned();
        text += &markdown_line(self.columns.iter().map(rule));
        let rows = self.rows.iter();
        text.extend(rows.map(|row| markdown_line(row.iter().map(|cell| markdown_text(&cell.text)))));
        text
    }
}

fn csv_line<'a>(cells: impl Iterator<Item = csv::Cell<'a>>) -> String {
    csv::line(cells) + "\r\n"
}

/// Escapes a text for a Markdown table: no markup, and on one line.
pub fn markdown_text(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    let line = text.lines().collect::<Vec<_>>().join(" ");
    for character in text::visible(line).chars() {
        if matches!(character, '\\' | '|' | '`' | '*' | '<' | '[' | ']' | '~') {
            escaped.push('\\');
        }
        escaped.push(character);
    }
    escaped
}

fn markdown_line(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::xml::elements;

    fn table() -> Table {
        let columns = vec![
            Column::text("estimator"),
            Column::number("median, e_a", "%"),
            Column::text("verdict"),
        ];
        let mut table = Table::new("P(A|B) < 1 & more", columns);
        table.row([
            CellText::text("LS, \"plain\"\nsolve").link("#c\"2"),
            CellText::number("0.0879(5)", 0.087_912_345_678_9),
            CellText::verdict(Verdict::DoesNotHold),
        ]);
        table.row([CellText::text("a|b *c* `d` e_a <b>"), CellText::number("-", f64::NAN)]);
        table.row([CellText::text(""), CellText::number("3.2e-13", 3.2e-13)]);
        table
    }

    #[test]
    fn html_is_escaped_and_sorts_by_value() {
        let html = table().html(3);
        let cells = elements(&html).unwrap();
        assert_eq!(cells.iter().filter(|name| *name == "td").count(), 9);
        assert!(html.contains("<b>Table 3.</b> P(A|B) &lt; 1 &amp; more"));
        assert!(html.contains("<td class=\"n\">0.0879(5)</td>"));
        assert!(html.contains("<td class=\"n\">-</td>"));
        assert!(reads_as_number("3.21(4)e-13") && reads_as_number("98"));
        assert!(!reads_as_number("tail") && !reads_as_number(""));
        assert!(html.contains("e_a &lt;b&gt;</td>"));
        assert!(html.contains("<a href=\"#c%222\">"));
    }

    #[test]
    fn csv_is_quoted_and_has_all_digits() {
        let expected = "estimator,\"median, e_a (%)\",verdict\r\n\
                        \"LS, \"\"plain\"\"\nsolve\",0.0879123456789,does not hold\r\n\
                        a|b *c* `d` e_a <b>,-,\r\n\
                        ,3.2e-13,\r\n";
        assert_eq!(table().csv(), expected);
    }

    #[test]
    fn csv_as_shown_has_errors_in_parentheses_and_no_formula() {
        let mut table = table();
        table.row([CellText::text("-1"), CellText::number("-3.21(4)e-13", -3.21e-13)]);
        table.row([CellText::text(""), CellText::number("=1(2)", 1.0)]);
        let expected = "estimator,\"median, e_a (%)\",verdict\r\n\
                        \"LS, \"\"plain\"\"\nsolve\",0.0879(5),does not hold\r\n\
                        a|b *c* `d` e_a <b>,-,\r\n\
                        ,3.2e-13,\r\n\
                        '-1,-3.21(4)e-13,\r\n\
                        ,'=1(2),\r\n";
        assert_eq!(table.csv_as_shown(), expected);
    }

    #[test]
    fn lines_of_text_have_numbers_to_the_right() {
        let columns = vec![
            Column::text("output").width(8),
            Column::number("e_a", "%").width(9),
            Column::text("").width(3),
        ];
        let table = Table::new("", columns);
        let row = |cells: [&str; 3]| table.text_row(&cells.map(CellText::text));
        assert_eq!(table.text_head(), "output     e_a (%)\n");
        assert_eq!(row(["ls", "0.0879(5)", "*"]), "ls       0.0879(5) *\n");
        assert_eq!(row(["ls", "1", ""]), "ls               1\n");
        // A text that is too long pushes what follows.
        assert_eq!(row(["kalman-bucy", "1", ""]), "kalman-bucy         1\n");
    }

    #[test]
    fn markdown_has_no_stray_pipe_or_markup() {
        let expected = "**P(A\\|B) \\< 1 & more**\n\n\
                        | estimator | median, e_a (%) | verdict |\n\
                        | :-- | --: | :-- |\n\
                        | LS, \"plain\" solve | 0.0879(5) | does not hold |\n\
                        | a\\|b \\*c\\* \\`d\\` e_a \\<b> | - |  |\n\
                        |  | 3.2e-13 |  |\n";
        assert_eq!(table().markdown(), expected);
    }
}
