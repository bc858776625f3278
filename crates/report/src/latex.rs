//! A table as LaTeX for a paper. It needs no package but booktabs.

use crate::table::{CellText, Column, Table, reads_as_number};
use asobench_study::files::LATEX_TITLE;
use asobench_study::text;

/// A text of more characters wraps, in a column of its own width.
const LONG: usize = 30;

/// The part of a line that the columns that wrap share.
const PROSE: f64 = 0.45;

/// A table of more columns is set smaller and closer.
const WIDE: usize = 7;

/// Characters that are commands in LaTeX, or that its fonts have elsewhere, or that could be read as the argument of
/// the `\\` before them: a line for each, with what is written instead.
const SYMBOLS: &str = include_str!("latex/symbols.txt");

/// Escapes a text, on one line. Invisible characters are written out, as on the page. Letters of other scripts stay:
/// pdfLaTeX knows those of Latin alphabets, XeLaTeX and LuaLaTeX those of their fonts.
fn escaped(text: &str) -> String {
    let line = text.lines().collect::<Vec<_>>().join(" ");
    let mut latex = String::with_capacity(line.len());
    let mut before = ' ';
    for c in text::visible(line).chars() {
        let mut lines = SYMBOLS.lines();
        match lines.find_map(|line| line.strip_prefix(c)?.strip_prefix(' ')) {
            Some(command) => latex.push_str(command),
            None if c == '\u{a0}' => latex.push('~'),
            None if c == '"' && (before.is_whitespace() || "([".contains(before)) => {
                latex.push_str("``");
            }
            None if c == '"' => latex.push_str("''"),
            // Two of them would become one longer sign.
            None if c == before && "-'".contains(c) => latex.extend(["{}", &c.to_string()]),
            None => latex.push(c),
        }
        before = c;
    }
    latex
}

/// A number such as `3.21(4)e-13` in mathematics; another text of a column of numbers, such as `lost`, as text.
fn number(text: &str) -> String {
    if !reads_as_number(text) {
        return escaped(text);
    }
    match text.split_once(['e', 'E']) {
        Some((value, exponent)) => format!("${value}\\times10^{{{exponent}}}$"),
        None => format!("${text}$"),
    }
}

/// The same in bold; of a number the mathematics, too.
fn bold(latex: &str) -> String {
    match latex.strip_prefix('$').and_then(|rest| rest.strip_suffix('$')) {
        Some(number) => format!("$\\mathbf{{{number}}}$"),
        None => format!("\\textbf{{{latex}}}"),
    }
}

fn cell(column: &Column, cell: &CellText) -> String {
    let text = if column.numeric { number } else { escaped };
    let latex = text(&cell.text);
    if cell.best { bold(&latex) } else { latex }
}

fn line(cells: impl Iterator<Item = String>) -> String {
    format!("{} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
}

/// The name of a label: letters, digits and dashes.
fn label(name: &str) -> String {
    let kept = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    name.chars().map(kept).collect()
}

impl Table {
    /// The table as LaTeX, with booktabs: `title` begins its caption, `name` is that of its label. Numbers are as on
    /// the page, with their standard errors in parentheses.
    pub fn latex(&self, name: &str, title: &str) -> String {
        let caption = match self.caption.trim() {
            "" => escaped(title),
            about => format!("{}. {}", escaped(title.trim_end_matches('.')), escaped(about)),
        };
        let headings = line(self.columns.iter().map(heading));
        let mut latex = format!(
            "{LATEX_TITLE}\\begin{{table}}[htbp]\n\\centering\n\\caption{{{caption}}}\n\\label{{tab:{}}}\n{}\n\
             \\begin{{tabular}}{{{}}}\n\\toprule\n{headings}\\midrule\n",
            label(name),
            self.size(),
            self.alignment(),
        );
        for row in &self.rows {
            latex.push_str(&line(self.cells(row).map(|(column, of)| cell(column, of))));
        }
        latex.push_str("\\bottomrule\n\\end{tabular}\n\\end{table}\n");
        latex
    }

    fn size(&self) -> &'static str {
        if self.columns.len() > WIDE {
            "\\footnotesize\\setlength{\\tabcolsep}{3pt}"
        } else {
            "\\small"
        }
    }

    /// The columns of the tabular: numbers to the right, long texts wrapped.
    fn alignment(&self) -> String {
        let is_long = |i: usize| {
            let mut cells = self.rows.iter().map(|row| &row[i]);
            !self.columns[i].numeric && cells.any(|cell| cell.text.chars().count() > LONG)
        };
        let long: Vec<bool> = (0..self.columns.len()).map(is_long).collect();
        let count = long.iter().filter(|long| **long).count();
        let width = PROSE / count.max(1) as f64;
        let columns = self.columns.iter().zip(long);
        let aligned = columns.map(|(column, long)| match (column.numeric, long) {
            (true, _) => "r".to_owned(),
            (false, true) => format!("p{{{width:.2}\\linewidth}}"),
            (false, false) => "l".to_owned(),
        });
        aligned.collect()
    }
}

/// A heading; above numbers, the words of a long one stand below each other.
fn heading(column: &Column) -> String {
    let text = column.heading();
    let words: Vec<String> = text.split_whitespace().map(escaped).collect();
    if !column.numeric || words.len() < 2 || text.chars().count() <= 8 {
        return escaped(&text);
    }
    let lines = words.join("\\\\");
    format!("\\begin{{tabular}}[b]{{@{{}}r@{{}}}}{lines}\\end{{tabular}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: what each character is in LaTeX.
    #[test]
    fn texts_are_escaped() {
        for (text, latex) in [
            ("50 % of e_a & #1", "50 \\% of e\\_a \\& \\#1"),
            (
                "a<b>c^d~e|f",
                "a\\textless{}b\\textgreater{}c\\textasciicircum{}d\\textasciitilde{}e\\textbar{}f",
            ),
            ("\\input{x}$1$", "\\textbackslash{}input\\{x\\}\\$1\\$"),
            ("\"tail\": (\"a\")", "``tail'': (``a'')"),
            ("--quick, x''", "-{}-quick, x'{}'"),
            ("[1] *", "{[}1] {*}"),
            ("\u{b5}s \u{b7} \u{3b7}", "$\\mu$s $\\cdot$ $\\eta$"),
            ("a\nb\u{202e}", "a b\\textbackslash{}u\\{202e\\}"),
            (
                "`R\u{e9}sum\u{e9}`",
                "\\textasciigrave{}R\u{e9}sum\u{e9}\\textasciigrave{}",
            ),
        ] {
            assert_eq!(escaped(text), latex);
        }
    }

    #[test]
    fn every_symbol_has_a_command() {
        for line in SYMBOLS.lines() {
            let mut rest = line.chars();
            rest.next();
            assert!(rest.as_str().len() > 1 && rest.as_str().starts_with(' '), "{line}");
        }
    }

    #[test]
    fn numbers_keep_their_errors() {
        for (text, latex) in [
            ("0.0879(5)", "$0.0879(5)$"),
            ("-3.21(4)e-13", "$-3.21(4)\\times10^{-13}$"),
            ("98", "$98$"),
            ("lost", "lost"),
            ("98.2(3) of 50 %", "98.2(3) of 50 \\%"),
            ("", ""),
        ] {
            assert_eq!(number(text), latex);
        }
    }

    #[test]
    fn a_table_has_the_rules_of_booktabs() {
        let columns = vec![Column::text("output"), Column::number("median e_a", "%")];
        let mut table = Table::new("Errors in units of the last digit.", columns);
        table.row([CellText::text("[iv]"), CellText::number("0.0879(5)", 0.0879).best(true)]);
        table.row([CellText::text("a text that is longer than thirty characters")]);
        let expected = "% Table of an asobench report; in the preamble: \\usepackage{booktabs}\n\
            \\begin{table}[htbp]\n\\centering\n\
            \\caption{100 \\%. Errors in units of the last digit.}\n\\label{tab:a-b-c}\n\\small\n\
            \\begin{tabular}{p{0.45\\linewidth}r}\n\\toprule\n\
            output & \\begin{tabular}[b]{@{}r@{}}median\\\\e\\_a\\\\(\\%)\\end{tabular} \\\\\n\\midrule\n\
            {[}iv] & $\\mathbf{0.0879(5)}$ \\\\\na text that is longer than thirty characters &  \\\\\n\
            \\bottomrule\n\\end{tabular}\n\\end{table}\n";
        assert_eq!(table.latex("a%b_c", "100 %."), expected);
    }
}
