//! Formats equations and lists as lines of a terminal.

/// The columns in a line.
pub(super) const WIDTH: usize = 79;

/// Breaks an equation before a sign when a line is full. The first line begins after `first` columns; the others are
/// indented.
pub(super) fn broken(equation: &str, first: usize, indent: usize) -> String {
    let terms = equation.replace(" + ", "\n + ").replace(" - ", "\n - ");
    in_lines(terms.split('\n'), WIDTH, first, indent)
}

/// Joins parts into lines. The first line begins after `first` columns; the others are indented, without the blanks
/// before their first part.
pub(super) fn in_lines(
    parts: impl IntoIterator<Item = impl AsRef<str>>,
    width: usize,
    first: usize,
    indent: usize,
) -> String {
    let (mut text, mut column) = (String::new(), first);
    for part in parts {
        let mut part = part.as_ref();
        if column + part.chars().count() > width {
            part = part.trim_start();
            text.push('\n');
            text.push_str(&" ".repeat(indent));
            column = indent;
        }
        text.push_str(part);
        column += part.chars().count();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_equations_break_before_a_sign() {
        let equation = "y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1)";
        assert_eq!(broken(equation, 0, 4), equation);
        let broken = broken(equation, 50, 4);
        assert_eq!(broken, "y(k) = 1.5 y(k-1)\n    - 0.7 y(k-2) + u(k-1)");
        let joined: String = broken.split_whitespace().collect();
        assert_eq!(joined, equation.split_whitespace().collect::<String>());
    }
}
