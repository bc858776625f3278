//! The bins of the histograms of e_x(k).

/// Bins of an octave, as a power of 2.
pub(crate) const BINS_PER_OCTAVE_LOG2: u32 = 4;

/// The lowest octave begins at 2 to this power.
pub(crate) const LOWEST_EXPONENT: i32 = -64;

/// The highest octave ends at 2 to this power.
pub(crate) const HIGHEST_EXPONENT: i32 = 16;

/// The bins of one histogram.
pub(crate) const BINS: usize = ((HIGHEST_EXPONENT - LOWEST_EXPONENT) << BINS_PER_OCTAVE_LOG2) as usize;

/// The largest size in bytes of a cell's histograms. Each thread holds some of them at a time.
pub(crate) const CURVES_LIMIT: usize = 1 << 30;

/// The trials of a cell that its curves are made of: the first ones. A picture of three quantiles shows no more: the
/// 5 % quantile of so many has a standard error of 0.2 % in probability.
pub const CURVE_TRIALS: u64 = 10_000;

/// Returns the bytes of the histograms for records of K samples.
pub(crate) fn curve_bytes(horizon: usize) -> usize {
    (2 * BINS * size_of::<u32>()).saturating_mul(horizon)
}
