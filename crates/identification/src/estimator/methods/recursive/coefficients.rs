//! Numbers as an option: a text, since a list in an option makes one method for each value.

use crate::text::text_in_files;

/// Finite numbers, such as `-1.5,0.7,1,0.5`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coefficients(Vec<f64>);

impl Coefficients {
    /// Takes numbers.
    ///
    /// # Errors
    /// A message if one is not finite.
    pub fn new(numbers: Vec<f64>) -> Result<Self, String> {
        if numbers.iter().all(|number| number.is_finite()) {
            Ok(Self(numbers))
        } else {
            Err("expected finite numbers".to_owned())
        }
    }

    /// Returns the numbers.
    pub fn numbers(&self) -> &[f64] {
        &self.0
    }
}

impl std::str::FromStr for Coefficients {
    type Err = String;

    /// Parses numbers with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split(',').map(|number| number.trim().parse());
        let numbers: Result<Vec<f64>, _> = numbers.collect();
        let message = |_| format!("'{text}'; expected numbers with commas, such as -1.5,0.7,1,0.5");
        Self::new(numbers.map_err(message)?)
    }
}

impl std::fmt::Display for Coefficients {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let texts: Vec<String> = self.0.iter().map(f64::to_string).collect();
        f.pad(&texts.join(","))
    }
}

text_in_files!(Coefficients, serde::Deserialize::deserialize, "string");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back() {
        let numbers: Coefficients = "-1.5, 0.7,1e-20".parse().unwrap();
        assert_eq!(numbers.numbers(), [-1.5, 0.7, 1e-20]);
        assert_eq!(numbers.to_string().parse(), Ok(numbers));
        for (text, part) in [("1,x", "such as -1.5"), ("", "such as"), ("1,inf", "finite")] {
            let error = text.parse::<Coefficients>().unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
