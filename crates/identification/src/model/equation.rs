//! A model as a difference equation, which makes signs visible.

use super::LinearModel;
use crate::text::{number, rounded};

impl LinearModel {
    /// Returns `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)`, with so many significant digits, or as many as
    /// read back to the same bits. A model with F, C or D is shown as polynomials, one a line.
    pub fn equation(&self, digits: Option<usize>) -> String {
        let Self { a, b, c, d, f, .. } = self;
        let forms = [("A", a), ("B", b), ("C", c), ("D", d), ("F", f)];
        if [c, d, f].iter().all(|p| p.len() == 1) {
            let of_y = a.iter().enumerate().skip(1);
            let of_y = of_y.map(|(i, a)| (-a, at("y", i)));
            let of_u = b.iter().enumerate().map(|(i, b)| (*b, at("u", i)));
            return format!("y(k) = {}", sum(of_y.chain(of_u), digits));
        }
        let is_there = |index: usize| forms[index].1.len() > 1;
        let over = |above: &str, below: usize| {
            let name = forms[below].0;
            if is_there(below) {
                format!("{above}/{name}")
            } else {
                above.to_owned()
            }
        };
        let left = if is_there(0) { "A y" } else { "y" };
        let noise = match (is_there(2), is_there(3)) {
            (true, _) => over("C", 3) + " e",
            (false, true) => "1/D e".to_owned(),
            (false, false) => "e".to_owned(),
        };
        let mut text = format!("{left} = {} u + {noise}", over("B", 4));
        for (name, polynomial) in forms {
            if name == "B" || polynomial.len() > 1 {
                let power = |i: usize| if i == 0 { String::new() } else { format!("q^-{i}") };
                let terms = polynomial.iter().enumerate().map(|(i, c)| (*c, power(i)));
                text = format!("{text}\n{name} = {}", sum(terms, digits));
            }
        }
        text
    }
}

/// Returns the terms `coefficient name` with their signs; coefficients of 0 are left out.
fn sum(terms: impl Iterator<Item = (f64, String)>, digits: Option<usize>) -> String {
    let of = |value: f64| digits.map_or_else(|| number(value), |digits| rounded(value, digits));
    let mut text = String::new();
    for (coefficient, name) in terms.filter(|(coefficient, _)| *coefficient != 0.0) {
        text += match (text.is_empty(), coefficient < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        text += &match coefficient.abs() {
            1.0 if !name.is_empty() => String::new(),
            size if name.is_empty() => of(size),
            size => of(size) + " ",
        };
        text += &name;
    }
    if text.is_empty() { "0".to_owned() } else { text }
}

fn at(signal: &str, delay: usize) -> String {
    match delay {
        0 => format!("{signal}(k)"),
        _ => format!("{signal}(k-{delay})"),
    }
}
