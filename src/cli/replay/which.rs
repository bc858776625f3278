//! Which trial is replayed.

use crate::cli::error::Error;
use crate::study::{Cell, Experiment};
use crate::text::{folded, listed};
use std::collections::BTreeSet;

/// A cell, by its claim or its number, and a trial.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Which {
    pub(super) cell: String,
    pub(super) trial: u64,
}

impl std::str::FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.rsplit_once(':').and_then(|(cell, trial)| {
            let trial = trial.parse().ok()?;
            let cell = cell.to_owned();
            Some(Self { cell, trial })
        });
        parts.ok_or_else(|| "expected CELL:TRIAL, such as C2:17".to_owned())
    }
}

impl std::fmt::Display for Which {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.cell, self.trial)
    }
}

impl Which {
    /// Returns the index of the cell that is meant.
    pub(super) fn cell(&self, flag: &str, experiment: &Experiment) -> Result<usize, Error> {
        let (cells, given) = (&experiment.cells, &self.cell);
        let digits = |text: &&str| text.bytes().all(|byte| byte.is_ascii_digit());
        let number = |text: &str| Some(text).filter(digits)?.parse().ok();
        let number = |text: &str| number(text).filter(|number| *number < cells.len());
        if let Some(number) = given.strip_prefix(NUMBER).and_then(number) {
            return Ok(number);
        }
        let is_claim = |cell: &Cell| !cell.claim.is_empty() && folded(&cell.claim) == folded(given);
        let of_claim = (0..cells.len()).filter(|number| is_claim(&cells[*number]));
        let meant: BTreeSet<usize> = of_claim.chain(number(given)).collect();
        match (meant.first(), meant.len()) {
            (Some(number), 1) => Ok(*number),
            (None, _) => Err(Error::Input(format!(
                "{flag}no cell '{given}'; expected {}",
                valid(experiment)
            ))),
            (_, several) => {
                let numbers: Vec<String> = meant.iter().map(|number| format!("{NUMBER}{number}")).collect();
                let numbers = listed(&numbers, SHOWN);
                let message = format!("{flag}'{given}' matches {several} cells; expected one of {numbers}");
                Err(Error::Input(message))
            }
        }
    }
}

/// So many claims or numbers are listed.
const SHOWN: usize = 10;

/// The prefix of a cell's number, to tell it from a claim.
pub(super) const NUMBER: &str = "cell=";

/// Lists the claims and numbers of cells.
pub(super) fn valid(experiment: &Experiment) -> String {
    let cells = &experiment.cells;
    let numbers = format!("a number from 0 to {}", cells.len() - 1);
    let mut claims: Vec<&str> = cells.iter().map(|cell| cell.claim.as_str()).collect();
    claims.retain(|claim| !claim.is_empty());
    claims.dedup();
    if claims.is_empty() {
        return numbers;
    }
    format!("{}, or {numbers}", listed(&claims, SHOWN))
}
