//! The layout of a reply: which numbers stand where.

use crate::text::{beginning, visible};
use asobench_identification::estimator::Reason;
use asobench_identification::model::Orders;
use serde_json::{Map, Value};

/// The blocks of a reply: status, seconds, then the model. Each has a row per trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    pub(super) trials: usize,
    pub(super) form: Form,
    pub(super) reasons: Vec<Reason>,
}

impl Layout {
    /// Reads the header of a reply.
    ///
    /// # Errors
    /// A description of the fault.
    pub fn read(header: &Map<String, Value>, number: u64, trials: usize, matrices: bool) -> Result<Self, String> {
        let count = |key: &str| header.get(key).and_then(Value::as_u64);
        for (key, expected) in [("number", number), ("trials", trials as u64)] {
            if count(key) != Some(expected) {
                return Err(format!("\"{key}\" of \"reply\": expected {expected}"));
            }
        }
        let order = |key: &str, default: Option<u64>| {
            let given = if header.contains_key(key) { count(key) } else { default };
            let given = given.filter(|n| *n <= LARGEST_ORDER as u64);
            given
                .map(|n| n as usize)
                .ok_or_else(|| format!("\"{key}\" of \"reply\": expected a whole number of 0 to {LARGEST_ORDER}"))
        };
        let flag = |key: &str| match header.get(key) {
            None => Ok(false),
            Some(Value::Bool(flag)) => Ok(*flag),
            Some(_) => Err(format!("\"{key}\" of \"reply\": expected true or false")),
        };
        let form = if matrices {
            let order = order("order", None)?;
            if order == 0 {
                return Err("\"order\" of \"reply\": expected at least 1".to_owned());
            }
            Form::Matrices { order }
        } else {
            let zero = Some(0);
            let orders = Orders {
                na: order("na", zero)?,
                nb: order("nb", zero)?,
                nc: order("nc", zero)?,
                nd: order("nd", zero)?,
                nf: order("nf", zero)?,
                nk: order("nk", Some(1))?,
            };
            if orders.parameters() == 0 {
                return Err("\"reply\": expected a model with at least one coefficient".to_owned());
            }
            Form::Polynomials {
                orders,
                variance: flag("noise_variance")?,
                covariance: flag("covariance")?,
            }
        };
        let layout = Self {
            trials,
            form,
            reasons: reasons(header)?,
        };
        let bytes = 8 * layout.numbers();
        if bytes > LARGEST_REPLY {
            return Err(format!("blocks of {bytes} bytes; expected at most {LARGEST_REPLY}"));
        }
        if count("bytes") != Some(bytes as u64) {
            let given = header.get("bytes").unwrap_or(&Value::Null);
            return Err(format!(
                "\"bytes\" of \"reply\" is {}; expected {bytes}, 8 for each number: a trial's status, seconds and {} \
                 of the model",
                visible(beginning(&given.to_string(), 20)),
                layout.model_numbers()
            ));
        }
        Ok(layout)
    }

    /// The number of values in all blocks.
    pub fn numbers(&self) -> usize {
        self.trials * (2 + self.model_numbers())
    }

    /// The number of values of one trial's model.
    fn model_numbers(&self) -> usize {
        let widths = self.form.blocks().into_iter().map(|(_, width)| width);
        widths.sum()
    }
}

/// Largest order and largest delay of a model.
pub const LARGEST_ORDER: usize = 1000;

/// The form of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// The free coefficients of A, B, C, D, F, then the variance of e and the covariance of the coefficients.
    Polynomials {
        orders: Orders,
        variance: bool,
        covariance: bool,
    },
    /// A, b, c, d, x0.
    Matrices { order: usize },
}

impl Form {
    /// Each block of the model, with the number of its values per trial.
    pub(super) fn blocks(self) -> Vec<(&'static str, usize)> {
        match self {
            Self::Polynomials {
                orders,
                variance,
                covariance,
            } => {
                let p = orders.parameters();
                let covariance = if covariance { p * p } else { 0 };
                vec![
                    ("parameters", p),
                    ("noise variance", usize::from(variance)),
                    ("covariance", covariance),
                ]
            }
            Self::Matrices { order: n } => {
                vec![("A", n * n), ("b", n), ("c", n), ("d", 1), ("x0", n)]
            }
        }
    }
}

fn reasons(header: &Map<String, Value>) -> Result<Vec<Reason>, String> {
    let wrong = || "\"reasons\" of \"reply\": expected a list of texts that are not empty".to_owned();
    let Some(given) = header.get("reasons") else {
        return Ok(Vec::new());
    };
    let texts = given.as_array().ok_or_else(wrong)?.iter();
    let texts = texts.map(|text| text.as_str().filter(|text| !text.trim().is_empty()));
    let reasons = texts.map(|text| text.map(Reason::new));
    reasons.collect::<Option<_>>().ok_or_else(wrong)
}

/// Largest size of a reply's blocks, in bytes.
pub const LARGEST_REPLY: usize = 1 << 27;
