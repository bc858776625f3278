//! Random stable plants.

use super::{ORDER_LIMIT, StateSpace, polynomial_from_poles};
use crate::signal::{Stream, normal::fill_standard_normal};
use faer::c64;
use rand::Rng;

/// Draws a plant of order n with standard normal b and poles uniform on the disc of the given radius. Complex poles
/// come in conjugate pairs; for odd n the last pole is real, uniform on the diameter.
///
/// # Panics
/// If `order` is 0 or above [`ORDER_LIMIT`](super::ORDER_LIMIT), or `radius` is not in (0, 1).
pub fn random_stable(order: usize, radius: f64, stream: &mut Stream) -> StateSpace {
    assert!((1..=ORDER_LIMIT).contains(&order) && radius > 0.0 && radius < 1.0);
    let mut uniform = || (stream.next_u64() >> 11) as f64 / 2.0_f64.powi(52) - 1.0;
    let mut poles = Vec::with_capacity(order);
    while poles.len() < order {
        let (x, y) = (uniform(), uniform());
        if order - poles.len() == 1 {
            poles.push(c64::new(radius * x, 0.0));
        } else if x * x + y * y < 1.0 {
            poles.push(c64::new(radius * x, radius * y));
            poles.push(c64::new(radius * x, -radius * y));
        }
    }
    let phi = polynomial_from_poles(&poles);
    let a = phi.iter().rev().map(|phi| -phi.re).collect();
    let mut b = vec![0.0; order];
    fill_standard_normal(stream, &mut b);
    StateSpace::new(a, b).expect("poles inside the unit circle make finite coefficients")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};

    #[test]
    fn coefficients_of_the_largest_order_are_finite() {
        let mut stream = stream(1, 0, Purpose::Plant);
        let plant = random_stable(ORDER_LIMIT, 1.0 - 1e-9, &mut stream);
        assert_eq!(plant.order(), ORDER_LIMIT);
    }
}
