//! A table on a page, with columns that sort.

use super::verdict::badge;
use crate::markup::{address, escape};
use crate::table::{CellText, Column, Table, reads_as_number};

/// A name has at most so many characters.
const NAME: usize = 40;

impl CellText {
    /// Whether the text is too long to stay on a line.
    fn is_prose(&self) -> bool {
        self.text.chars().count() > 24
    }

    fn html(&self, numeric: bool) -> String {
        let shown = self.verdict.map_or_else(|| escape(&self.text), badge);
        let content = match &self.link {
            Some(target) => format!("<a href=\"{}\">{shown}</a>", address(target)),
            None => shown,
        };
        let content = if self.best {
            format!("<b>{content}</b>")
        } else {
            content
        };
        let class = match (numeric, self.is_prose()) {
            (true, _) => " class=\"n\"",
            (false, true) => " class=\"prose\"",
            (false, false) => "",
        };
        let value = self.sort_value.filter(|value| value.is_finite());
        let value = value.filter(|_| !(numeric && reads_as_number(&self.text)));
        let value = value.map_or_else(String::new, |v| format!(" data-value=\"{v:?}\""));
        format!("<td{class}{value}>{content}</td>")
    }
}

impl Table {
    /// The table as HTML with sortable columns; `number` is its number on the page.
    pub(crate) fn html(&self, number: usize) -> String {
        // A short table is printed on one page; a long one may break between rows.
        let long = if self.rows.len() > 30 { " long" } else { "" };
        // Short names in the first column stay in view where the table scrolls.
        let is_short = |row: &Vec<CellText>| row.first().is_none_or(|of| of.text.chars().count() <= NAME);
        let named = if self.rows.iter().all(is_short) { " named" } else { "" };
        let caption = escape(&self.caption);
        let heads: String = self.columns.iter().map(head).collect();
        let mut html = format!(
            "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Table {number}\">\n\
             <table class=\"sortable{long}{named}\">\n\
             <caption><span><b>Table {number}.</b> {caption}</span></caption>\n\
             <thead><tr>{heads}</tr></thead>\n<tbody>\n"
        );
        for row in &self.rows {
            html.push_str("<tr>");
            for (column, cell) in self.cells(row) {
                html.push_str(&cell.html(column.numeric));
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table>\n</div>\n");
        html
    }
}

/// The head of a column: a button that sorts by it.
fn head(column: &Column) -> String {
    let class = if column.numeric { " class=\"number\"" } else { "" };
    let unit = if column.unit.is_empty() {
        String::new()
    } else {
        format!(" <span class=\"unit\">{}</span>", escape(&column.unit))
    };
    let title = escape(&column.title);
    format!("<th scope=\"col\"{class}><button type=\"button\">{title}{unit}</button></th>")
}
