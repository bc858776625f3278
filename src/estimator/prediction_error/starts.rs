//! The starts of searches: F, C and D from linear methods and from random stable models. A and B follow by least
//! squares.

use crate::estimator::SetupError;
use crate::estimator::known::KnownModel;
use crate::estimator::output_error_iteration::{OutputErrorIteration, stable};
use crate::estimator::regression::{Regression, Rows};
use crate::model::polynomial::{divide, filter};
use crate::model::{LinearModel, Orders};
use crate::plant::random_stable;
use crate::signal::{Purpose, stream};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// Seed of the random starts, which are the same for every record.
const SEED: u64 = 0x7065_6d00;

/// Random zeros have moduli up to this.
const RADIUS: f64 = 0.98;

/// Lags of the long autoregression in the method of Hannan and Rissanen.
const LONG: usize = 20;

/// Random starts besides those from linear methods: the default and the largest number.
const RANDOM_STARTS: usize = 12;
const MOST_STARTS: usize = 10_000;

/// The starts of the searches of a prediction error method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchStarts {
    /// Linear methods, and this number of random stable models.
    Random(usize),
    /// The true plant alone, which no user has: the remaining error is then not due to other minima.
    Truth,
}

impl Default for SearchStarts {
    fn default() -> Self {
        Self::Random(RANDOM_STARTS)
    }
}

impl Serialize for SearchStarts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Random(count) => serializer.serialize_u64(*count as u64),
            Self::Truth => serializer.serialize_str("truth"),
        }
    }
}

impl<'de> Deserialize<'de> for SearchStarts {
    /// Reads a number, or "truth".
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = Value::deserialize(deserializer)?;
        let count = match &given {
            Value::String(text) if text == "truth" => return Ok(Self::Truth),
            Value::String(text) => text.parse().ok(),
            other => other.as_u64().and_then(|count| usize::try_from(count).ok()),
        };
        let count = count.filter(|count| *count <= MOST_STARTS);
        count.map(Self::Random).ok_or_else(|| {
            serde::de::Error::custom(format!("{given}; expected 0 to {MOST_STARTS}, or truth"))
        })
    }
}

impl schemars::JsonSchema for SearchStarts {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SearchStarts".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "anyOf": [
                { "type": "integer", "minimum": 0, "maximum": MOST_STARTS },
                { "const": "truth" }
            ]
        })
    }
}

/// Starts for records of one length.
pub(super) struct Starts {
    orders: Orders,
    /// The true model if it is the only start.
    truth: Option<LinearModel>,
    /// F, or A, by least squares, Steiglitz-McBride and refined IV.
    least_squares: Option<Regression>,
    iterations: Vec<OutputErrorIteration>,
    /// The regression for A and B given F, C and D.
    linear: Regression,
    /// A long autoregression of the noise, then C and D of it.
    long: Option<Regression>,
    /// For `w = C/D e` with e known: the regression of `[w, e]` on their past.
    noise: Option<Regression>,
    /// The denominators found so far, one after another. Each is combined with every noise model.
    denominators: Vec<f64>,
    /// F, C and D of the random starts.
    drawn: Vec<[Vec<f64>; 3]>,
    /// The next start.
    turn: usize,
    model: LinearModel,
    theta: Vec<f64>,
    u: Vec<f64>,
    y: Vec<f64>,
    e: Vec<f64>,
    scratch: Vec<f64>,
}

impl Starts {
    pub(super) fn new(orders: Orders, random: usize, window: usize) -> Result<Self, SetupError> {
        let Orders {
            na,
            nb,
            nc,
            nd,
            nf,
            nk,
        } = orders;
        let rows = Rows::Prewindow;
        let output_error = Orders {
            nb,
            nf,
            nk,
            ..Orders::default()
        };
        let mut iterations = Vec::new();
        let mut least_squares = None;
        if nf > 0 {
            least_squares = Some(Regression::new(Orders::arx(nf, nb, nk), rows, window)?);
            for refined in [false, true] {
                iterations.push(OutputErrorIteration::new(output_error, window, refined)?);
            }
        }
        let lags = LONG.min(window / 4);
        let has_noise = nc + nd > 0 && lags > 0;
        let regression = |orders| Regression::new(orders, rows, window);
        let signal = || vec![0.0; window];
        Ok(Self {
            least_squares,
            iterations,
            linear: regression(Orders::arx(na, nb, nk))?,
            long: if has_noise {
                Some(regression(Orders::arx(lags, 0, 1))?)
            } else {
                None
            },
            noise: if has_noise {
                Some(regression(Orders::arx(nd, nc, 1))?)
            } else {
                None
            },
            orders,
            truth: None,
            denominators: Vec::with_capacity(4 * (nf + 1)),
            drawn: (0..random as u64)
                .map(|number| draw(orders, number))
                .collect(),
            turn: 0,
            model: LinearModel::zero(orders),
            theta: vec![0.0; orders.parameters()],
            u: signal(),
            y: signal(),
            e: signal(),
            scratch: Vec::new(),
        })
    }

    /// Changes the starts to the true plant alone.
    pub(super) fn with_truth(mut self, truth: &KnownModel) -> Result<Self, SetupError> {
        let orders = self.orders;
        let truth = &truth.pass().model;
        let mut model = LinearModel::zero(orders);
        let denominator = if orders.na > 0 {
            &mut model.a
        } else {
            &mut model.f
        };
        let places = [(denominator, &truth.a), (&mut model.b, &truth.b)];
        for (place, of_truth) in places {
            let last = of_truth.iter().rposition(|value| *value != 0.0);
            let needed = last.map_or(0, |last| last + 1);
            if needed > place.len() {
                return Err(SetupError::TruthOfOtherOrders { orders });
            }
            place[..needed].copy_from_slice(&of_truth[..needed]);
        }
        if model.b[..orders.nk].iter().any(|value| *value != 0.0) {
            return Err(SetupError::TruthOfOtherOrders { orders });
        }
        self.truth = Some(model);
        Ok(self)
    }

    /// Computes the denominators for a record.
    pub(super) fn begin(&mut self, u: &[f64], y: &[f64]) {
        self.turn = 0;
        if self.truth.is_some() {
            return;
        }
        self.denominators.clear();
        self.take_denominator(None);
        let mut condition = f64::NAN;
        if let Some(mut regression) = self.least_squares.take() {
            if regression.solve(u, y, &mut condition).is_ok() {
                self.take_denominator(Some(&regression.theta()[..self.orders.nf]));
            }
            self.least_squares = Some(regression);
        }
        let mut iterations = std::mem::take(&mut self.iterations);
        for iteration in &mut iterations {
            // If it did not converge, the point where it stopped is a start too.
            let _ = iteration.find(u, y, &mut condition);
            self.take_denominator(Some(&iteration.model().f[1..]));
        }
        self.iterations = iterations;
    }

    /// Adds the denominator F = 1, or `1 + f_1 q^-1 + ...` if that is stable.
    fn take_denominator(&mut self, f: Option<&[f64]>) {
        let (first, degree) = (self.denominators.len(), self.orders.nf);
        self.denominators.resize(first + degree + 1, 0.0);
        let place = &mut self.denominators[first..];
        place[0] = 1.0;
        if let Some(f) = f {
            place[1..].copy_from_slice(f);
            if !(f.iter().all(|f| f.is_finite()) && stable(place, &mut self.scratch)) {
                self.denominators.truncate(first);
            }
        }
    }

    /// Returns the next start; `None` after the last.
    pub(super) fn next(&mut self, u: &[f64], y: &[f64]) -> Option<&[f64]> {
        if let Some(truth) = self.truth.take() {
            let first = self.turn == 0;
            self.turn = 1;
            self.model.assign(&truth);
            // Without a noise model that differs from white noise, C = D = 1.
            if first && !self.hannan_rissanen(u, y) {
                self.model.assign(&truth);
            }
            self.truth = Some(truth);
            self.take();
            return first.then_some(&self.theta);
        }
        let noises = if self.long.is_some() { 2 } else { 1 };
        let degree = self.orders.nf;
        loop {
            let structured = self.denominators.len() / (degree + 1) * noises;
            let turn = self.turn;
            if turn >= structured + self.drawn.len() {
                return None;
            }
            self.turn += 1;
            let ready = if turn < structured {
                let first = turn / noises * (degree + 1);
                let denominator = &self.denominators[first..=first + degree];
                self.model.f.copy_from_slice(denominator);
                for polynomial in [&mut self.model.c, &mut self.model.d] {
                    polynomial[1..].fill(0.0);
                }
                let found = self.solve_linear(u, y);
                if turn % noises == 1 {
                    found && self.hannan_rissanen(u, y) && self.solve_linear(u, y)
                } else {
                    found
                }
            } else {
                let [f, c, d] = &self.drawn[turn - structured];
                self.model.f.copy_from_slice(f);
                self.model.c.copy_from_slice(c);
                self.model.d.copy_from_slice(d);
                self.solve_linear(u, y)
            };
            if ready {
                break;
            }
        }
        self.take();
        Some(&self.theta)
    }

    /// Copies the parameters of the model to theta.
    fn take(&mut self) {
        for (theta, parameter) in self.theta.iter_mut().zip(self.model.parameters()) {
            *theta = parameter;
        }
    }

    /// Computes A and B that minimise the sum of squares given F, C and D: linear in `D/C y` and `D/(C F) u`.
    fn solve_linear(&mut self, u: &[f64], y: &[f64]) -> bool {
        let LinearModel { c, d, f, .. } = &self.model;
        for (to, from, with_f) in [(&mut self.u, u, true), (&mut self.y, y, false)] {
            filter(d, from, to);
            divide(c, to);
            if with_f {
                divide(f, to);
            }
        }
        let mut condition = f64::NAN;
        if self.linear.solve(&self.u, &self.y, &mut condition).is_err() {
            return false;
        }
        let (a, b) = self.linear.theta().split_at(self.orders.na);
        self.model.a[1..].copy_from_slice(a);
        self.model.b[self.orders.nk..].copy_from_slice(b);
        true
    }

    /// Computes C and D from the noise `w = A y - B/F u` of the present model: e by a long autoregression, then w on
    /// the past of both. Returns false if C is unstable.
    fn hannan_rissanen(&mut self, u: &[f64], y: &[f64]) -> bool {
        let (Some(long), Some(noise)) = (&mut self.long, &mut self.noise) else {
            return false;
        };
        // w, with C = D = 1.
        self.model.residuals(u, y, &mut self.e, &mut self.y);
        let w = &mut self.u;
        w.copy_from_slice(&self.e);
        self.y.fill(0.0);
        let mut condition = f64::NAN;
        if long.solve(&self.y, w, &mut condition).is_err() {
            return false;
        }
        self.scratch.clear();
        self.scratch.push(1.0);
        self.scratch.extend_from_slice(long.theta());
        filter(&self.scratch, w, &mut self.e);
        // w(k) = -d_1 w(k-1) - ... + c_1 e(k-1) + ... + e(k).
        if noise.solve(&self.e, w, &mut condition).is_err() {
            return false;
        }
        let (d, c) = noise.theta().split_at(self.orders.nd);
        self.model.d[1..].copy_from_slice(d);
        self.model.c[1..].copy_from_slice(c);
        stable(&self.model.c, &mut self.scratch)
    }
}

/// Draws F, C and D with random zeros.
fn draw(orders: Orders, number: u64) -> [Vec<f64>; 3] {
    let mut random = stream(SEED, number, Purpose::Plant);
    [orders.nf, orders.nc, orders.nd].map(|degree| match degree {
        0 => vec![1.0],
        degree => random_stable(degree, RADIUS, &mut random).denominator(),
    })
}
