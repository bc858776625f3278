//! The Fisher information of one record from rest, with its own input.

use super::linear::without_noise;
use super::matrix::Matrix;
use super::missing::Missing;
use super::noisy_record::noisy_record;
use crate::data::OutputFeedback;
use crate::estimator::{InitialCondition, PredictionGradient};
use crate::model::polynomial::{delayed, divide, filter, multiply};
use crate::model::{LinearModel, Orders};
use crate::signal::{NoiseLaw, arithmetic::dot};

/// The Fisher information of a record `y(0) ... y(N-1)` of `A y = B/F u + C/D e` given what drives it, r: u itself in
/// open loop, the reference in a loop `u = r - K y`. All signals are zero before k = 0, and e begins there.
///
/// The prediction errors and their gradient `psi = -de/dtheta`, from rest, are linear in r and e: `psi = P_r r + P_e
/// e`. With `x = P_r r` and h_j the impulse response of P_e,
///
/// ```text
/// F = i (1/s2 sum_(k<N) x(k) x(k)' + sum_(j<N) (N - j) h_j h_j'),
/// ```
///
/// s2 the variance of e and i the information of its density of unit variance, [`NoiseLaw::information`]. No
/// stationarity and no expectation over r is in it: it is the information of the exact likelihood of this record. The
/// order of parameters is `a_1 ..., f_1 ..., b_nk ..., c_1 ..., d_1 ...`. s2 drops out, since the score of a scale is
/// uncorrelated with theirs.
///
/// Noise that was stationary before k = 0 has a little more or less information than this, by terms that do not grow
/// with N.
///
/// Source: Ljung, *System Identification*, 2nd ed., sections 7.4 and 13.4; of the density Lange, Little and Taylor,
/// JASA 84, 1989.
#[derive(Clone, Debug)]
pub struct RecordInformation {
    /// F about all parameters: `a, f, b, c, d`, or `f, b` and three variances.
    pub all: Matrix,
    /// F about the plant's parameters `a, f, b`, the others unknown: the Schur complement of their block.
    pub of_plant: Matrix,
}

impl RecordInformation {
    /// Computes the information in O(N p^2). `model` is the truth with the variance of e; `r` has what enters the
    /// loop, so where the law is `u = g r - K y` it is `g r`.
    ///
    /// # Errors
    /// [`Missing::UnstableModel`] if C or F is not stable; [`Missing::Singular`] if there is no noise, a number
    /// overflows or the parameters of the noise are not identifiable; [`Missing::DirectLoop`] if y(k) and u(k) depend
    /// on each other; [`Missing::Process`] for noise without a density.
    pub fn new(
        model: &LinearModel,
        law: &NoiseLaw,
        feedback: Option<&OutputFeedback>,
        r: &[f64],
    ) -> Result<Self, Missing> {
        let density = law.information();
        let density = density.ok_or(super::NoTheory::NotGaussian)?;
        if !(model.noise_variance > 0.0) {
            return Err(Missing::Singular);
        }
        let mut impulse = vec![0.0; r.len()];
        if let Some(first) = impulse.first_mut() {
            *first = 1.0;
        }
        let [given, noise] = signals(model, feedback, r, &impulse)?;
        let [mut x, h] = [columns(model, given)?, columns(model, noise)?];
        let of_plant = plant_parameters(model.orders());
        // r does not reach e, but for rounding.
        x[of_plant..].iter_mut().for_each(|x| x.fill(0.0));
        let samples = r.len() as f64;
        let left = (0..r.len()).map(|j| samples - j as f64);
        let weighted = h.iter().map(|h| h.iter().zip(left.clone()).map(|(h, n)| n * h));
        let weighted: Vec<Vec<f64>> = weighted.map(Iterator::collect).collect();
        let all = Matrix::from_fn(x.len(), x.len(), |i, j| {
            let (i, j) = (i.max(j), i.min(j));
            density * (dot(&x[i], &x[j]) / model.noise_variance + dot(&h[i], &weighted[j]))
        });
        Self::of(all, of_plant)
    }

    /// Computes the expected information of N samples of `u = r + w_u`, `y = B/F r + w_y` from rest, r, `w_u` and
    /// `w_y` white and Gaussian with these variances, none of them known:
    ///
    /// ```text
    /// F_ij = tr(S^-1 S_i S^-1 S_j) / 2,   S = [(s_r + s_u) I, s_r T'; s_r T, s_r T T' + s_y I],
    /// ```
    ///
    /// T the Toeplitz matrix of B/F. After b come the variances `s_r, s_u, s_y`, eliminated as the noise's parameters.
    /// r is not known, so there is no information of one record. Takes O(N^2 p n).
    ///
    /// # Errors
    /// [`Missing::NoisyInput`] if the model has A, C or D; [`Missing::Singular`] if the parameters are not
    /// identifiable.
    pub fn of_noisy_input(model: &LinearModel, variances: [f64; 3], samples: usize) -> Result<Self, Missing> {
        let Orders { na, nc, nd, .. } = model.orders();
        if na + nc + nd > 0 {
            return Err(Missing::NoisyInput);
        }
        let all = noisy_record(model, variances, samples).ok_or(Missing::Singular)?;
        Self::of(all, plant_parameters(model.orders()))
    }

    fn of(all: Matrix, of_plant: usize) -> Result<Self, Missing> {
        if !all.is_all_finite() {
            return Err(Missing::Singular);
        }
        let half = without_noise(&all, of_plant)?;
        let of_plant = Matrix::from_fn(of_plant, of_plant, |i, j| 0.5 * (half[(i, j)] + half[(j, i)]));
        if !of_plant.is_all_finite() {
            return Err(Missing::Singular);
        }
        Ok(Self { all, of_plant })
    }
}

fn plant_parameters(Orders { na, nb, nf, .. }: Orders) -> usize {
    na + nf + nb
}

/// u and y that come from r, and from an impulse of e. In a loop with `K = M/L`, `P = A F L + B M`:
/// `u = A F L/P r - M F C/(P D) e`, `y = B L/P r + L F C/(P D) e`.
fn signals(
    model: &LinearModel,
    feedback: Option<&OutputFeedback>,
    r: &[f64],
    e: &[f64],
) -> Result<[[Vec<f64>; 2]; 2], Missing> {
    let LinearModel { a, b, c, d, f, .. } = model;
    let through = |top: &[f64], bottoms: [&[f64]; 2], x: &[f64]| {
        let mut y = vec![0.0; x.len()];
        filter(top, x, &mut y);
        for of in bottoms {
            divide(of, &mut y);
        }
        y
    };
    let Some(feedback) = feedback else {
        let given = [r.to_vec(), through(b, [a, f], r)];
        let noise = through(c, [a, d], e);
        return Ok([given, [vec![0.0; r.len()], noise]]);
    };
    let (m, l) = (feedback.numerator(), feedback.denominator());
    if b.first().is_some_and(|b| *b != 0.0) && m[0] != 0.0 {
        return Err(Missing::DirectLoop);
    }
    let open = multiply(&multiply(a, f), &l);
    let closed = super::population::sum(&open, &multiply(b, m));
    let one = [1.0];
    let given = [&open, &multiply(b, &l)].map(|top| through(top, [&closed, &one], r));
    let noise = multiply(f, c);
    let minus: Vec<f64> = m.iter().map(|m| -m).collect();
    let noise = [&minus, &l].map(|by| through(&multiply(by, &noise), [&closed, d], e));
    Ok([given, noise])
}

/// The columns of `-psi`, in the order A, F, B, C, D.
fn columns(model: &LinearModel, [u, y]: [Vec<f64>; 2]) -> Result<Vec<Vec<f64>>, Missing> {
    let found = PredictionGradient::new(model, &u, &y, InitialCondition::Zero);
    let found = found.ok_or(Missing::UnstableModel)?;
    let mut columns = Vec::new();
    for (signal, delays) in found.signals {
        columns.extend(delays.map(|delay| delayed(&signal, delay, 1.0)));
    }
    // A, B, C, D, F is the order of the gradient.
    let Orders { na, nf, .. } = model.orders();
    columns[na..].rotate_right(nf);
    Ok(columns)
}
