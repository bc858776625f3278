//! The units of a record.

/// The unit of u and r, and that of y. A record that is divided by powers of two near the sizes of its signals is the
/// same numbers whatever powers of two they were multiplied with, so what is computed of it has the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// The unit of u and r.
    pub input: f64,
    /// The unit of y and of states.
    pub output: f64,
}

impl Units {
    /// The units of the record as it is.
    pub const ONE: Self = Self::shared(1.0);

    /// One unit for all signals.
    pub const fn shared(unit: f64) -> Self {
        Self {
            input: unit,
            output: unit,
        }
    }

    /// The unit of B.
    pub const fn gain(self) -> f64 {
        self.output / self.input
    }
}

/// Multiplies a number; notes whether the product leaves the normal numbers.
pub(crate) fn multiply(number: &mut f64, by: f64, lost: &mut bool) {
    let was = *number;
    *number *= by;
    *lost |= was.is_finite() && was != 0.0 && !number.is_normal();
}

/// Multiplies rows and columns of a square matrix.
pub(crate) fn multiply_part(matrix: &mut [f64], size: usize, part: std::ops::Range<usize>, by: f64, lost: &mut bool) {
    if matrix.is_empty() {
        return;
    }
    for i in part {
        for j in 0..size {
            multiply(&mut matrix[i * size + j], by, lost);
            multiply(&mut matrix[j * size + i], by, lost);
        }
    }
}
