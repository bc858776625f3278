//! The keys of an external program as a method, in an experiment file.

use asobench_identification::model::Orders;
use asobench_identification::names::named_enum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest number of records in a message.
const LARGEST_BATCH: u64 = 1 << 16;
/// Longest time limit for a message, in seconds.
const LONGEST: f64 = 1e6;
/// Largest number of processes.
const MOST_WORKERS: u64 = 1024;

named_enum! {
    /// A fact that a program may know about a cell besides its records.
    Told, "thing to be told" {
        /// The noise level and the noise filter.
        Noise = "noise",
    }
}

/// Number of processes of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Workers {
    /// One for each thread that needs one.
    #[default]
    #[serde(with = "automatic")]
    #[schemars(with = "String")]
    Auto,
    /// At most this many.
    Most(u64),
}

/// Reads and writes the text "auto".
mod automatic {
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub fn serialize<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str("auto")
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
        let expected = "workers: expected \"auto\" or a whole number";
        match String::deserialize(deserializer)?.as_str() {
            "auto" => Ok(()),
            _ => Err(de::Error::custom(expected)),
        }
    }
}

/// A method that is an external program; see docs/protocol.md.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandOptions {
    /// The program and its arguments; no shell is involved. It runs in the folder of the experiment file.
    pub command: Vec<String>,
    /// Largest number of records in a message.
    #[serde(default = "default_batch")]
    pub batch: u64,
    /// Time limit for a message, in seconds.
    #[serde(default = "default_timeout")]
    pub timeout: f64,
    /// Largest number of processes, or "auto": one for each thread.
    #[serde(default)]
    pub workers: Workers,
    /// The facts that the program may know about a cell besides its records.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub told: Vec<Told>,
    /// The orders of the requested model, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orders: Option<Orders>,
    /// Name and version as the program reports them; a run records them and fails if the program reports others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worker: Option<String>,
}

fn default_batch() -> u64 {
    256
}

fn default_timeout() -> f64 {
    60.0
}

impl CommandOptions {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// The key, and the value expected.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let whole = |text: &String| !text.contains('\0');
        let named = self.command.first().is_some_and(|name| !name.is_empty());
        if !named || !self.command.iter().all(whole) {
            let message = "expected a list of the program and its arguments, such as [\"python3\", \"mine.py\"]";
            return Err(("command", message.to_owned()));
        }
        if !(1..=LARGEST_BATCH).contains(&self.batch) {
            return Err(("batch", format!("expected 1 to {LARGEST_BATCH} records")));
        }
        if !(self.timeout > 0.0 && self.timeout <= LONGEST) {
            return Err(("timeout", "expected seconds above 0, at most 1000000".to_owned()));
        }
        match self.workers {
            Workers::Most(most) if !(1..=MOST_WORKERS).contains(&most) => {
                Err(("workers", format!("expected \"auto\" or 1 to {MOST_WORKERS} processes")))
            }
            _ => Ok(()),
        }
    }

    /// The orders that the program is asked for, where the plant is of order n; of its models if it returns
    /// polynomials.
    pub fn orders_for(&self, n: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(n, n, 1))
    }

    /// The command as it would be typed in a shell.
    pub fn typed(&self) -> String {
        let words: Vec<String> = self.command.iter().map(crate::text::shell_word).collect();
        words.join(" ")
    }
}
