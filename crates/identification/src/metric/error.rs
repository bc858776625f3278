//! Errors of estimates, Eq. (7), in the two readings of E3.

use crate::real::Real;

/// Computes `|| v - v_hat || / || v ||`: the reading `relative`.
///
/// # Panics
/// If the lengths differ.
#[inline(always)]
pub fn relative_error<R: Real>(v: &[R], v_hat: &[R]) -> R {
    let mut size = R::zero();
    for v in v {
        size = size + *v * *v;
    }
    (square_distance(v, v_hat) / size).sqrt()
}

/// Computes `sqrt( sum (v - v_hat)^2 / sum v )`: the reading `as-printed` without its minus sign. NaN (undefined) if
/// `sum v <= 0`.
///
/// # Panics
/// If the lengths differ.
#[inline(always)]
pub fn relative_error_as_printed<R: Real>(v: &[R], v_hat: &[R]) -> R {
    let mut sum = R::zero();
    for v in v {
        sum = sum + *v;
    }
    let error = (square_distance(v, v_hat) / sum).sqrt();
    R::select(R::zero().less(sum), error, R::splat(f64::NAN))
}

#[inline(always)]
fn square_distance<R: Real>(v: &[R], v_hat: &[R]) -> R {
    assert_eq!(v.len(), v_hat.len());
    let mut sum = R::zero();
    for (v, w) in v.iter().zip(v_hat) {
        sum = sum + (*v - *w) * (*v - *w);
    }
    sum
}

/// Collects the state errors e_x(k) over k: maximum and root mean square, in both readings of E3.
#[derive(Clone, Copy, Debug, Default)]
pub struct StateError {
    /// `e_x(k)` in the reading `relative`; NaN if no k was added.
    pub relative: Gathered,
    /// In the reading `as-printed`, over the k where it is defined; NaN if there is none.
    pub as_printed: Gathered,
    /// `||x(k) - xhat(k)||`; NaN if no k was added.
    pub absolute: Gathered,
}

/// Maximum and mean of the squares of a sequence.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    count: u32,
    maximum: f64,
    sum: f64,
}

impl Gathered {
    /// Adds a square if it is defined. There is no branch: whether a sum of states is positive cannot be predicted.
    #[inline(always)]
    fn add(&mut self, square: f64, defined: bool) {
        self.count += u32::from(defined);
        self.sum += if defined { square } else { 0.0 };
        // NaN is kept.
        let larger = defined && !(square <= self.maximum);
        self.maximum = if larger { square } else { self.maximum };
    }

    /// The largest; NaN if nothing was added.
    pub fn maximum(self) -> f64 {
        if self.count == 0 { f64::NAN } else { self.maximum.sqrt() }
    }

    /// The root mean square; NaN if nothing was added.
    pub fn rms(self) -> f64 {
        (self.sum / f64::from(self.count)).sqrt()
    }
}

impl StateError {
    /// Adds x(k) and its estimate. Returns `e_x(k)^2` in the reading `relative`, NaN if undefined.
    ///
    /// A reading leaves out every k where it is undefined: x(k) = 0 for `relative`, `sum x(k) <= 0` for `as-printed`.
    #[inline(always)]
    pub fn add(&mut self, x: &[f64], x_hat: &[f64]) -> f64 {
        let (mut distance, mut size, mut sum) = (0.0, 0.0, 0.0);
        for (x, x_hat) in x.iter().zip(x_hat) {
            distance = (x - x_hat).mul_add(x - x_hat, distance);
            size = x.mul_add(*x, size);
            sum += x;
        }
        let relative = if size > 0.0 { distance / size } else { f64::NAN };
        self.absolute.add(distance, true);
        self.relative.add(relative, size > 0.0);
        self.as_printed.add(distance / sum, sum > 0.0);
        relative
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_readings_by_hand() {
        let (v, w) = ([3.0, 4.0], [3.0, 3.0]);
        assert_eq!(relative_error(&v, &w), 0.2);
        assert_eq!(relative_error_as_printed(&v, &w), (1.0_f64 / 7.0).sqrt());
        assert!(relative_error_as_printed(&[1.0, -1.0], &w).is_nan());
        let mut errors = StateError::default();
        assert!(errors.relative.maximum().is_nan() && errors.relative.rms().is_nan());
        assert_eq!(errors.add(&v, &w), 0.04);
        errors.add(&[-3.0, -4.0], &[-3.0, -4.0]);
        errors.add(&[0.0, 0.0], &[1.0, 1.0]);
        assert_eq!(errors.relative.maximum(), 0.2);
        assert!((errors.relative.rms() - 0.02_f64.sqrt()).abs() < 1e-16);
        // The squares of three samples are 1, 0 and 2; this measure includes x = 0.
        assert_eq!(errors.absolute.rms(), 1.0);
        assert_eq!(errors.as_printed.maximum(), (1.0_f64 / 7.0).sqrt());
        errors.add(&[1.0, 1.0], &[f64::NAN, 1.0]);
        assert!(errors.relative.maximum().is_nan());
    }
}
