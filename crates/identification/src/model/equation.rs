//! A model as a difference equation, which makes signs visible.

use super::LinearModel;
use crate::text::{number, rounded};
use std::fmt::{self, Write as _};

/// Shows `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)`. A model with F, C or D is shown as polynomials, one a
/// line.
#[derive(Clone, Copy, Debug)]
pub struct Equation<'a> {
    model: &'a LinearModel,
    /// Significant digits; `None`: as many as read back to the same bits.
    digits: Option<usize>,
}

impl LinearModel {
    /// Returns the model as an equation with all digits.
    pub fn equation(&self) -> Equation<'_> {
        Equation {
            model: self,
            digits: None,
        }
    }
}

impl Equation<'_> {
    /// Limits the numbers to so many significant digits.
    #[must_use]
    pub fn rounded(mut self, digits: usize) -> Self {
        self.digits = Some(digits);
        self
    }

    fn number(&self, value: f64) -> String {
        match self.digits {
            None => number(value),
            Some(digits) => rounded(value, digits),
        }
    }

    /// Writes the terms `coefficient name` with their signs; coefficients of 0 are left out.
    fn sum(&self, terms: impl Iterator<Item = (f64, String)>) -> String {
        let mut text = String::new();
        for (coefficient, name) in terms.filter(|(coefficient, _)| *coefficient != 0.0) {
            let sign = match (text.is_empty(), coefficient < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            let size = match coefficient.abs() {
                1.0 if !name.is_empty() => String::new(),
                size if name.is_empty() => self.number(size),
                size => self.number(size) + " ",
            };
            // Writing to a string cannot fail.
            let _ = write!(text, "{sign}{size}{name}");
        }
        if text.is_empty() {
            text.push('0');
        }
        text
    }

    fn polynomial(&self, coefficients: &[f64]) -> String {
        let power = |i: usize| match i {
            0 => String::new(),
            _ => format!("q^-{i}"),
        };
        let terms = coefficients.iter().enumerate();
        self.sum(terms.map(|(i, c)| (*c, power(i))))
    }
}

fn at(signal: &str, delay: usize) -> String {
    match delay {
        0 => format!("{signal}(k)"),
        _ => format!("{signal}(k-{delay})"),
    }
}

impl fmt::Display for Equation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LinearModel { a, b, c, d, .. } = self.model;
        let forms = [("A", a), ("B", b), ("C", c), ("D", d), ("F", &self.model.f)];
        if [c, d, &self.model.f].iter().all(|p| p.len() == 1) {
            let of_y = a.iter().enumerate().skip(1);
            let of_y = of_y.map(|(i, a)| (-a, at("y", i)));
            let of_u = b.iter().enumerate().map(|(i, b)| (*b, at("u", i)));
            return write!(f, "y(k) = {}", self.sum(of_y.chain(of_u)));
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
        write!(f, "{left} = {} u + {noise}", over("B", 4))?;
        for (name, polynomial) in forms {
            if name == "B" || polynomial.len() > 1 {
                write!(f, "\n{name} = {}", self.polynomial(polynomial))?;
            }
        }
        Ok(())
    }
}
