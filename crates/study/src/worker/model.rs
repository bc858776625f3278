//! The models of a reply.

use super::layout::Form;
use super::message::Reply;
use asobench_identification::estimator::{Failure, FailureKind, Pass, Stage, StartState, StateEstimate, Window};
use asobench_identification::model::{LinearModel, Orders};
use asobench_identification::plant::polynomial_from_poles;
use faer::MatRef;

impl Reply {
    /// Checks that every status is valid.
    ///
    /// # Errors
    /// A description of the first invalid status.
    pub fn check(&self) -> Result<(), String> {
        let most = 1.0 + self.layout.reasons.len() as f64;
        let known = |status: &f64| *status >= 0.0 && *status <= most && status.fract() == 0.0;
        match self.numbers[..self.layout.trials].iter().find(|s| !known(s)) {
            None => Ok(()),
            Some(status) => Err(format!(
                "status {status}; expected 0, 1, or 2 + i for entry i of \"reasons\" (from i = 0)"
            )),
        }
    }

    /// Why a trial has no model, according to the worker; `None` if it has one.
    pub fn failure(&self, place: usize) -> Option<FailureKind> {
        match self.numbers[place] as usize {
            0 => None,
            1 => Some(FailureKind::Declined),
            status => Some(FailureKind::External(self.layout.reasons[status - 2])),
        }
    }

    /// The time of a trial in seconds, according to the worker.
    pub fn seconds(&self, place: usize) -> f64 {
        self.numbers[self.layout.trials + place]
    }

    /// Each block with its name, its numbers, and how many of them belong to one trial.
    pub fn blocks(&self) -> Vec<(&'static str, Vec<f64>, usize)> {
        let names = [("status", 1), ("seconds", 1)].into_iter();
        let mut from = 0;
        let all = names.chain(self.layout.form.blocks()).map(|(name, width)| {
            let to = from + self.layout.trials * width;
            let block = self.numbers[from..to].to_vec();
            from = to;
            (name, block, width)
        });
        all.collect()
    }

    /// The row of a trial in each block of the model.
    fn rows(&self, place: usize) -> Vec<&[f64]> {
        let trials = self.layout.trials;
        let mut from = 2 * trials;
        let rows = self.layout.form.blocks().into_iter().map(|(_, width)| {
            let row = &self.numbers[from + place * width..from + (place + 1) * width];
            from += trials * width;
            row
        });
        rows.collect()
    }

    /// Copies the model of a trial into a pass; if the worker gives no x0, stage 6 computes it.
    pub fn fill(&self, place: usize, window: Window<'_>, pass: &mut Pass) {
        if let Some(kind) = self.failure(place) {
            return pass.fail(kind.into());
        }
        let rows = self.rows(place);
        let made = match self.layout.form {
            Form::Polynomials { orders, .. } => Ok((polynomials(orders, &rows), None)),
            Form::Matrices { order } => matrices(order, &rows),
        };
        let made = made.and_then(|(model, x0)| Ok((pass.set_model(&model, f64::NAN)?, x0)));
        match made {
            Err(kind) => pass.fail(kind.into()),
            Ok(((), Some(x0))) => pass.set_initial_state(&x0),
            Ok(((), None)) if pass.a.len() > window.len() => {
                let kind = FailureKind::RankDeficient;
                pass.fail(Failure {
                    kind,
                    stage: Stage::InitialState,
                    pass: 0,
                });
            }
            Ok(((), None)) => {
                StateEstimate::new(pass.a.len(), StartState::Estimate).estimate(window, 0, pass);
            }
        }
    }
}

fn polynomials(orders: Orders, rows: &[&[f64]]) -> LinearModel {
    let mut model = LinearModel::zero(orders);
    model.set_parameters(rows[0]);
    if let [variance] = rows[1] {
        model.noise_variance = *variance;
    }
    if rows[2].iter().all(|value| value.is_finite()) {
        model.covariance.extend_from_slice(rows[2]);
    }
    model
}

/// Converts `x(k+1) = A x(k) + b u(k)`, `y(k) = c x(k) + d u(k)` to `B/F`, with F the characteristic polynomial of A.
/// Also returns x0 in the paper's coordinates, `c A^i x0`, unless it is NaN.
fn matrices(n: usize, rows: &[&[f64]]) -> Result<(LinearModel, Option<Vec<f64>>), FailureKind> {
    let [a, b, c, d, x0] = rows else {
        return Err(FailureKind::Malformed);
    };
    let d = d[0];
    let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
    let known = !x0.iter().all(|x| x.is_nan());
    if ![a, b, c].into_iter().all(|values| finite(values)) || !d.is_finite() || known && !finite(x0) {
        return Err(FailureKind::NonFinite);
    }
    // c A^i times a vector, i = 0 ... n-1.
    let series = |start: &[f64]| {
        let (mut x, mut values) = (start.to_vec(), Vec::with_capacity(n));
        for _ in 0..n {
            values.push(c.iter().zip(&x).map(|(c, x)| c * x).sum());
            let next = a.chunks(n).map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum());
            x = next.collect();
        }
        values
    };
    let matrix = MatRef::from_row_major_slice(a, n, n);
    let poles = matrix.eigenvalues().map_err(|_| FailureKind::NonFinite)?;
    let direct = usize::from(d != 0.0);
    let mut model = LinearModel::zero(Orders {
        nb: n + direct,
        nf: n,
        nk: 1 - direct,
        ..Orders::default()
    });
    for (f, coefficient) in model.f[1..].iter_mut().zip(polynomial_from_poles(&poles)) {
        *f = coefficient.re;
    }
    // B = F G, G = d + c b q^-1 + c A b q^-2 + ...
    let markov: Vec<f64> = series(b);
    let response = |i: usize| if i == 0 { d } else { markov[i - 1] };
    for i in 0..=n {
        model.b[i] = (0..=i).map(|j| model.f[j] * response(i - j)).sum();
    }
    model.b[0] = d;
    Ok((model, known.then(|| series(x0))))
}
