//! Polynomials with random zeros.

use crate::plant::canonical::reverse_negated;
use crate::plant::{PoleFinder, polynomial_from_poles, random_stable};
use crate::signal::Stream;
use faer::c64;
use rand::Rng as _;

/// Random zeros have moduli up to this.
const RADIUS: f64 = 0.98;

/// Draws a polynomial with random zeros.
pub(super) fn draw(polynomial: &mut [f64], random: &mut Stream) {
    if polynomial.len() > 1 {
        let drawn = random_stable(polynomial.len() - 1, RADIUS, random);
        polynomial.copy_from_slice(&drawn.denominator());
    }
}

/// Draws a polynomial with real zeros whose distances from 1 lie between 2^-13 and 1/2, as often in each octave: zeros
/// of a plant that is sampled fast.
pub(super) fn draw_slow(polynomial: &mut [f64], random: &mut Stream) {
    let mut zero = || {
        let octave = (random.next_u64() % 12) as i32;
        let place = (random.next_u64() >> 11) as f64 / 2.0_f64.powi(53);
        c64::new(1.0 - (1.0 + place) * 2.0_f64.powi(octave - 13), 0.0)
    };
    let zeros: Vec<c64> = (1..polynomial.len()).map(|_| zero()).collect();
    for (coefficient, phi) in polynomial[1..].iter_mut().zip(polynomial_from_poles(&zeros)) {
        *coefficient = phi.re;
    }
}

/// Moves a pair of zeros of one of the polynomials, chosen by their degrees, to a random place: two conjugate or two
/// real zeros, or the only one. Minima often differ in zeros that others nearly cancel.
pub(super) fn move_zeros(polynomials: &mut [&mut Vec<f64>], random: &mut Stream) {
    let all: usize = polynomials.iter().map(|polynomial| polynomial.len() - 1).sum();
    if all == 0 {
        return;
    }
    let mut chosen = random.next_u64() as usize % all;
    let Some(polynomial) = polynomials.iter_mut().find(|polynomial| {
        let here = chosen < polynomial.len() - 1;
        if !here {
            chosen -= polynomial.len() - 1;
        }
        here
    }) else {
        return;
    };
    let degree = polynomial.len() - 1;
    let mut a = vec![0.0; degree];
    reverse_negated(&polynomial[1..], &mut a);
    let mut zeros = PoleFinder::new(degree).poles(&a);
    if zeros.len() < degree {
        return;
    }
    let moved = zeros.swap_remove(chosen);
    // Its conjugate, or another real zero.
    let partner = (0..zeros.len())
        .filter(|i| (zeros[*i].im == 0.0) == (moved.im == 0.0))
        .min_by(|i, j| {
            let distance = |i: usize| (zeros[i] - moved.conj()).norm();
            distance(*i).total_cmp(&distance(*j))
        });
    if let Some(partner) = partner {
        zeros.swap_remove(partner);
    }
    let mut uniform = || RADIUS * ((random.next_u64() >> 11) as f64 / 2.0_f64.powi(52) - 1.0);
    let (x, y, which) = (uniform(), uniform(), uniform());
    match degree - zeros.len() {
        2 if which > 0.0 => {
            // From the square to the disc.
            let scale = x.abs().max(y.abs()) / (x * x + y * y).sqrt().max(f64::MIN_POSITIVE);
            let zero = c64::new(scale * x, scale * y);
            zeros.extend([zero, zero.conj()]);
        }
        2 => zeros.extend([c64::new(x, 0.0), c64::new(y, 0.0)]),
        _ => zeros.push(c64::new(x, 0.0)),
    }
    for (coefficient, phi) in polynomial[1..].iter_mut().zip(polynomial_from_poles(&zeros)) {
        *coefficient = phi.re;
    }
}
