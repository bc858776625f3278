//! The example plant of Nikolov et al. (2023).

use super::StateSpace;
use crate::names::named_enum;

named_enum! {
    /// The choice between the paper's two inconsistent numerators: reading E1.
    Numerator, "numerator" {
        /// The printed vector b (the default: the error e_b is defined on b).
        StateSpace = "state-space",
        /// The printed numerator h of W(z), with b from `T b = h`.
        TransferFunction = "transfer-function",
    }
}

/// Returns the paper's example: n = 6, poles 0.4, 0.3, 0.25, 0.2, 0.15, 0.1.
///
/// # Panics
/// Never: the printed coefficients form a plant.
pub fn nikolov2023(numerator: Numerator) -> StateSpace {
    let a = vec![-0.00009, 0.002835, -0.035525, 0.2275, -0.7875, 1.4];
    match numerator {
        Numerator::StateSpace => StateSpace::new(a, vec![0.6, 0.2, 0.1, 0.3, 0.4, 0.5]),
        Numerator::TransferFunction => {
            StateSpace::from_transfer_function(a, vec![0.6, 0.56, 0.2125, 0.3080, 0.5488, 0.7221])
        }
    }
    .expect("the printed coefficients are finite and of one length")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PoleFinder;

    /// E1: T b of the printed b, and T^-1 h of the printed h, by hand in exact decimals.
    #[test]
    fn the_two_numerators_differ_as_the_erratum_says() {
        let h = nikolov2023(Numerator::StateSpace).h();
        let expected = [0.6, -0.64, 0.2925, 0.181, 0.034565, 0.158904];
        assert!(h.iter().zip(expected).all(|(h, e)| (h - e).abs() < 1e-14));
        let plant = nikolov2023(Numerator::TransferFunction);
        let expected = [0.6, 1.4, 1.7, 1.722, 1.918035, 2.38999];
        assert!(plant.b().iter().zip(expected).all(|(b, e)| (b - e).abs() < 1e-14));
    }

    #[test]
    fn the_poles_are_the_printed_ones() {
        let plant = nikolov2023(Numerator::StateSpace);
        let poles = PoleFinder::new(6).poles(plant.a());
        for (pole, expected) in poles.iter().zip([0.4, 0.3, 0.25, 0.2, 0.15, 0.1]) {
            assert!((pole.re - expected).abs() < 1e-9 && pole.im.abs() < 1e-9);
        }
        assert!(plant.is_stable());
    }
}
