//! Formats equations and lists as lines of a terminal.

/// The columns in a line.
const WIDTH: usize = 79;

/// Breaks an equation before a sign when a line is full. The first line begins after `first` columns; the others are
/// indented.
pub(super) fn broken(equation: &str, first: usize, indent: usize) -> String {
    let terms = equation.split_inclusive(" + ");
    let terms = terms.flat_map(|terms| terms.split_inclusive(" - "));
    let (mut text, mut column) = (String::new(), first);
    // A sign is at the end of the term before it.
    for term in terms {
        let (term, sign) = match term.len().checked_sub(3).map(|end| term.split_at(end)) {
            Some((term, sign @ (" + " | " - "))) => (term, sign),
            _ => (term, ""),
        };
        if column + term.len() > WIDTH {
            let kept = text.trim_end_matches([' ', '+', '-']).len();
            let moved = text.split_off(kept);
            text.push('\n');
            text.push_str(&" ".repeat(indent));
            text.push_str(moved.trim_start());
            column = indent + moved.trim_start().len();
        }
        text.push_str(term);
        text.push_str(sign);
        column += term.len() + sign.len();
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
