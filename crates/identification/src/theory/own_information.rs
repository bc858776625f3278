//! The Fisher information of each record of a process, with the record's own input.

use super::cramer_rao::TrueModel;
use super::errors_in_variables::variances;
use super::fisher_information::{FisherInformation, output_error_orders, without_zeros};
use super::matrix::Matrix;
use super::missing::Missing;
use super::population::{NOISE, Population};
use super::record_information::RecordInformation;
use crate::data::{Feedback, NoiseColour, OutputFeedback, Process};
use crate::model::polynomial::multiply;
use crate::model::{LinearModel, Orders};
use crate::signal::NoiseLaw;

/// The records of a process: made once, then [`Self::of`] each record. Where [`FisherInformation::new`] takes all
/// signals as stationary and the mean over inputs, this takes the record from rest with its own input or reference
/// ([`RecordInformation`]), in the same coordinates.
///
/// A resonant plant sees few independent stretches of an input, so that information differs by a factor of four
/// between records of some hundred samples, and the law of d needs each record's own.
#[derive(Clone, Debug)]
pub struct OwnInformation {
    /// The truth; the variance of e is that of noise with the factor 1.
    model: LinearModel,
    law: NoiseLaw,
    feedback: Option<OutputFeedback>,
    /// The derivative of `p = (alpha, beta)` by the plant's parameters.
    slopes: Matrix,
    /// The orders of the truth, `A y = B/F u + C/D e` in lowest terms.
    pub orders: Orders,
    /// Where the input is measured with noise: the expected information, of every record.
    expected: Option<Matrix>,
}

impl OwnInformation {
    /// Prepares for records of `window` samples at noise level `eta`, in per cent. With a noisy input the information
    /// is expected, and is computed here, in O(N^2).
    ///
    /// # Errors
    /// [`Missing`]; [`Missing::NotAtRest`] if x(0) is not zero.
    pub fn new(process: &Process, eta: f64, window: usize) -> Result<Self, Missing> {
        let settings = process.settings();
        if settings.x0_deviation > 0.0 || settings.x0.iter().any(|x| *x != 0.0) {
            return Err(Missing::NotAtRest);
        }
        let law = match &settings.noise {
            NoiseColour::Filter(filter) => filter.law().clone(),
            NoiseColour::InverseDenominator => NoiseLaw::Gaussian,
        };
        let feedback = match &settings.feedback {
            Feedback::Output(law) => Some(law.clone()),
            Feedback::None | Feedback::Controlled(_) => None,
        };
        if settings.input_noise > 0.0 {
            let population = Population::of_record(process, eta)?;
            let model = output_error(&population);
            let variances = variances(process, &population)?;
            let of = RecordInformation::of_noisy_input(&model, variances, window)?;
            return Ok(Self {
                expected: Some(of.of_plant.clone()),
                slopes: Matrix::identity(of.of_plant.nrows()),
                orders: output_error_orders(&population),
                model,
                law,
                feedback,
            });
        }
        let population = Population::of_any_reference(process, eta)?;
        let TrueModel { mut model, slopes, .. } = TrueModel::new(&population)?;
        model.noise_variance /= population.sources[NOISE].variance;
        Ok(Self {
            orders: without_zeros(model.orders(), &population),
            model,
            law,
            feedback,
            slopes,
            expected: None,
        })
    }

    /// Computes the information of a record from its r ([`crate::data::Realisation::r`], the samples of the window)
    /// and the factor of its noise ([`crate::data::Realisation::scale`]).
    ///
    /// # Errors
    /// [`Missing`].
    pub fn of(&self, r: &[f64], scale: f64) -> Result<FisherInformation, Missing> {
        if let Some(expected) = &self.expected {
            return FisherInformation::about_p(expected, &self.slopes, 0.5, self.orders);
        }
        let model = LinearModel {
            noise_variance: self.model.noise_variance * scale * scale,
            ..self.model.clone()
        };
        let own = RecordInformation::new(&model, &self.law, self.feedback.as_ref(), r)?;
        FisherInformation::about_p(&own.of_plant, &self.slopes, 0.5, self.orders)
    }

    /// The same records for methods that do not know that plant and noise share A, `y = B/(A F) u + C/(A D) e` with all
    /// polynomials free; `None` where A is 1.
    pub fn separate(&self) -> Option<Self> {
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        let shared = a.iter().rposition(|a| *a != 0.0).filter(|na| *na > 0)?;
        let (f, d) = (multiply(a, f), multiply(&a[..=shared], d));
        let count = |of: &[f64]| of.len() - 1;
        let orders = Orders {
            na: 0,
            nb: count(b),
            nc: count(c),
            nd: count(&d),
            nf: count(&f),
            nk: 1,
        };
        let model = LinearModel {
            b: b.clone(),
            c: c.clone(),
            d,
            f,
            noise_variance: self.model.noise_variance,
            ..LinearModel::zero(orders)
        };
        let Orders { na, nd, nf, .. } = self.orders;
        Some(Self {
            slopes: Matrix::identity(self.slopes.nrows()),
            model,
            orders: Orders {
                na: 0,
                nf: na + nf,
                nd: na + nd,
                ..self.orders
            },
            ..self.clone()
        })
    }
}

/// `y = B/F u` with all coefficients of alpha and beta.
fn output_error(population: &Population) -> LinearModel {
    let n = population.plant.order();
    LinearModel {
        f: population.alpha.clone(),
        b: population.beta.clone(),
        ..LinearModel::zero(Orders::output_error(n, n, 1))
    }
}
