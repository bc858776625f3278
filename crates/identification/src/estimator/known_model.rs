//! The true model as an estimator: what observers achieve if they know the plant.

use super::{Estimator, Pass, Stage, Window};
use crate::plant::StateSpace;

/// Returns (a, b, h) of the true plant and a given x0 as its estimate, without looking at the record. One pass.
#[derive(Clone, Debug)]
pub struct KnownModel {
    pass: Pass,
}

impl KnownModel {
    /// Returns the model of a plant with the initial state (n numbers) that observers start from.
    ///
    /// # Panics
    /// If `x0` is of another length than the plant's order.
    pub fn new(plant: &StateSpace, x0: &[f64]) -> Self {
        let mut pass = Pass::new(plant.order());
        let denominator = plant.denominator();
        let p = [&denominator[1..], &plant.h()].concat();
        match pass.set_parameters(&p, f64::NAN) {
            Ok(()) => {
                // Copied, because the way through T and back rounds.
                pass.b.copy_from_slice(plant.b());
                pass.set_initial_state(x0);
            }
            Err(kind) => pass.fail_at(Stage::Data, 0, kind),
        }
        Self { pass }
    }

    /// Returns the model.
    pub fn pass(&self) -> &Pass {
        &self.pass
    }
}

impl Estimator for KnownModel {
    fn estimate(&mut self, _: Window<'_>, passes: &mut [Pass]) {
        for pass in passes {
            pass.clone_from(&self.pass);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Numerator, nikolov2023};

    #[test]
    fn the_plant_to_the_last_bit() {
        let plant = nikolov2023(Numerator::StateSpace);
        let pass = KnownModel::new(&plant, &[2.0; 6]).pass;
        assert_eq!((&pass.a[..], &pass.b[..]), (plant.a(), plant.b()));
        assert_eq!(pass.h, plant.h());
        assert!(!pass.unstable && pass.failure.is_none());
        assert_eq!(pass.observed().unwrap().x0, [2.0; 6]);
    }
}
