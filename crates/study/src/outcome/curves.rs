//! Quantiles of e_x(k) for every k, in memory that does not grow with the number of trials.
//!
//! They are over the first [`CURVE_TRIALS`] trials of a cell. Each k has a histogram with fixed logarithmic bins, 16
//! per octave from 2^-64 to 2^16. Counts are integers, so merging is exact in any order. A quantile is read as the
//! middle of its bin; its relative error is at most [`CURVE_BIN_ERROR`].

use crate::design::{BINS, BINS_PER_OCTAVE_LOG2, CURVE_TRIALS, CURVES_LIMIT, LOWEST_EXPONENT, curve_bytes};
use asobench_identification::real::{MOST_LANES, with_fma};
use serde::{Deserialize, Serialize, Serializer};
use std::ops::Range;

/// The largest relative error of a curve's quantile: half a bin, 1/32.
pub const CURVE_BIN_ERROR: f64 = 1.0 / 32.0;

/// Histograms of e_x(k) for the first and the last output of a trial, k = 0 ... K-1.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "Sparse")]
pub struct Curves {
    horizon: usize,
    /// The trials that are counted, those without the measure too.
    trials: u64,
    /// The first output's histograms, then the last's; nothing before the first error is counted.
    counts: Vec<u32>,
}

impl PartialEq for Curves {
    fn eq(&self, other: &Self) -> bool {
        (self.horizon, self.trials) == (other.horizon, other.trials) && self.filled().eq(other.filled())
    }
}

/// The nonempty bins, as they are stored.
#[derive(Serialize, Deserialize)]
struct Sparse {
    horizon: usize,
    trials: u64,
    bins: Vec<(u32, u32)>,
}

impl Serialize for Curves {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let sparse = Sparse {
            horizon: self.horizon,
            trials: self.trials,
            bins: self.filled().collect(),
        };
        sparse.serialize(serializer)
    }
}

impl TryFrom<Sparse> for Curves {
    type Error = &'static str;

    fn try_from(sparse: Sparse) -> Result<Self, &'static str> {
        if curve_bytes(sparse.horizon) > CURVES_LIMIT {
            return Err("curves of a record that is too long");
        }
        let mut curves = Self::new(sparse.horizon);
        curves.trials = sparse.trials;
        if !sparse.bins.is_empty() {
            // The length comes from a file, so it is used only if there is memory for it.
            let reserved = Vec::<u32>::new().try_reserve_exact(curves.len());
            reserved.map_err(|_| "curves that do not fit into memory")?;
            curves.make_room();
        }
        for (bin, count) in sparse.bins {
            match curves.counts.get_mut(bin as usize) {
                Some(place) if *place == 0 && count > 0 => *place = count,
                _ => return Err("a bin that is repeated, empty or out of range"),
            }
        }
        Ok(curves)
    }
}

/// Quantiles of e_x(k), k = 0 ... K-1, of one output; `None` (null) if the quantile falls among trials without the
/// measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveQuantiles {
    /// 5 % quantiles.
    pub q05: Vec<Option<f64>>,
    /// Medians.
    pub q50: Vec<Option<f64>>,
    /// 95 % quantiles.
    pub q95: Vec<Option<f64>>,
}

impl CurveQuantiles {
    /// Whether there are quantiles for each of K samples.
    pub(crate) fn are_of(&self, horizon: usize) -> bool {
        let all = [&self.q05, &self.q50, &self.q95];
        all.iter().all(|quantile| quantile.len() == horizon)
    }
}

/// Returns the bin of a number >= 0. The lowest and the highest bin include what lies beyond them.
#[inline(always)]
fn bin(value: f64) -> usize {
    const SHIFT: u32 = 52 - BINS_PER_OCTAVE_LOG2;
    const BASE: u64 = ((1023 + LOWEST_EXPONENT) as u64) << BINS_PER_OCTAVE_LOG2;
    let index = (value.to_bits() >> SHIFT).saturating_sub(BASE) as usize;
    index.min(BINS - 1)
}

/// Errors that wait to be counted. Errors of many trials at one k are counted together, while its histogram is in the
/// first-level cache.
pub(crate) struct Waiting {
    /// The bins of all trials at k = 0, then at k = 1, ...; [`BINS`] if there is no error.
    bins: Vec<u16>,
    count: usize,
}

/// The largest number of trials that wait.
const WAITING: usize = 256;

impl Waiting {
    /// Makes an empty set for records of K samples.
    pub(crate) fn new(horizon: usize) -> Self {
        Self {
            bins: vec![0; horizon * WAITING],
            count: 0,
        }
    }

    /// Whether there is no room for another pack.
    pub(crate) fn is_full(&self) -> bool {
        self.count + MOST_LANES > WAITING
    }

    /// Adds e_x(k) of a pack of so many trials, for the lanes whose bits are set.
    pub(crate) fn add(&mut self, errors: &[[f64; MOST_LANES]], lanes: usize, counted: u8) {
        // The compiler must know how many lanes there are; the next pack overwrites those that are too many.
        with_fma(
            #[inline(always)]
            || match lanes {
                ..=4 => self.put::<4>(errors, counted),
                _ => self.put::<MOST_LANES>(errors, counted),
            },
        );
        self.count += lanes;
    }

    #[inline(always)]
    fn put<const LANES: usize>(&mut self, errors: &[[f64; MOST_LANES]], counted: u8) {
        let at = self.count;
        for (errors, bins) in errors.iter().zip(self.bins.chunks_exact_mut(WAITING)) {
            let bins = &mut bins[at..at + LANES];
            for lane in 0..LANES {
                let counted = counted >> lane & 1 == 1 && !errors[lane].is_nan();
                bins[lane] = if counted { bin(errors[lane]) } else { BINS } as u16;
            }
        }
    }
}

/// Returns the middle of a bin.
fn middle(bin: usize) -> f64 {
    let per_octave = 1 << BINS_PER_OCTAVE_LOG2;
    let exponent = LOWEST_EXPONENT + (bin / per_octave) as i32;
    let within = ((bin % per_octave) as f64 + 0.5) / per_octave as f64;
    2.0_f64.powi(exponent) * (1.0 + within)
}

impl Curves {
    /// The number of samples K.
    pub(crate) fn horizon(&self) -> usize {
        self.horizon
    }

    /// Makes empty histograms for records of K samples.
    pub fn new(horizon: usize) -> Self {
        Self {
            horizon,
            trials: 0,
            counts: Vec::new(),
        }
    }

    /// The bins of all histograms.
    fn len(&self) -> usize {
        2 * self.horizon * BINS
    }

    /// Makes room for all bins.
    fn make_room(&mut self) {
        if self.counts.is_empty() {
            self.counts = vec![0; self.len()];
        }
    }

    /// Returns the bins that are not empty, with their counts.
    fn filled(&self) -> impl Iterator<Item = (u32, u32)> {
        let bins = (0..).zip(self.counts.iter().copied());
        bins.filter(|(_, count)| *count > 0)
    }

    /// Returns the histograms of the first or the last output, if anything is counted.
    fn half(&self, last: bool) -> Option<&[u32]> {
        let (first_half, last_half) = self.counts.split_at_checked(self.len() / 2)?;
        Some(if last { last_half } else { first_half })
    }

    /// Returns these curves, which are of some trials of a cell, and leaves empty ones of the same length.
    #[must_use]
    pub fn take(&mut self, trials: &Range<u64>) -> Self {
        let mut taken = Self::new(self.horizon);
        std::mem::swap(self, &mut taken);
        taken.trials = CURVE_TRIALS.min(trials.end) - CURVE_TRIALS.min(trials.start);
        taken
    }

    /// The trials that are counted: those among the first [`CURVE_TRIALS`].
    pub(crate) fn trials(&self) -> u64 {
        self.trials
    }

    /// Returns the first output's curves of one set and the last output's of another.
    ///
    /// # Panics
    /// If the horizons differ.
    pub(crate) fn of_ends(first: &Self, last: &Self) -> Self {
        assert_eq!(first.horizon, last.horizon);
        let mut ends = Self {
            trials: first.trials,
            ..Self::new(first.horizon)
        };
        for (of, last) in [(first, false), (last, true)] {
            if let Some(counts) = of.half(last) {
                ends.make_room();
                let from = usize::from(last) * counts.len();
                ends.counts[from..from + counts.len()].copy_from_slice(counts);
            }
        }
        ends
    }

    /// Counts e_x(0) ... e_x(K-1) of one trial, for the last output or (`last` false) the first. NaN is not counted.
    ///
    /// # Panics
    /// If there are not K errors.
    pub fn add(&mut self, last: bool, errors: impl IntoIterator<Item = f64>) {
        self.make_room();
        let from = usize::from(last) * self.horizon * BINS;
        let mut histograms = self.counts[from..].chunks_exact_mut(BINS).take(self.horizon);
        for error in errors {
            let histogram = histograms.next().expect("K errors");
            if !error.is_nan() {
                histogram[bin(error)] += 1;
            }
        }
        assert!(histograms.next().is_none(), "K errors");
    }

    /// Counts the waiting errors, and empties the queue.
    ///
    /// # Panics
    /// If the horizons differ.
    pub(crate) fn add_waiting(&mut self, last: bool, waiting: &mut Waiting) {
        assert_eq!(waiting.bins.len(), self.horizon * WAITING);
        self.make_room();
        let from = usize::from(last) * self.horizon * BINS;
        let histograms = self.counts[from..].chunks_exact_mut(BINS);
        for (bins, histogram) in waiting.bins.chunks_exact(WAITING).zip(histograms) {
            for &bin in &bins[..waiting.count] {
                if let Some(count) = histogram.get_mut(usize::from(bin)) {
                    *count += 1;
                }
            }
        }
        waiting.count = 0;
    }

    /// Adds another worker's counts.
    ///
    /// # Panics
    /// If the horizons differ.
    pub fn merge(&mut self, other: Self) {
        assert_eq!(self.horizon, other.horizon);
        self.trials += other.trials;
        if self.counts.is_empty() {
            self.counts = other.counts;
            return;
        }
        for (count, other) in self.counts.iter_mut().zip(&other.counts) {
            *count += other;
        }
    }

    /// Returns quantiles of the first or the last output. Trials without the measure rank last.
    pub fn quantiles(&self, last: bool) -> CurveQuantiles {
        let at = |q: f64| match self.half(last) {
            Some(histograms) => {
                let histograms = histograms.chunks_exact(BINS);
                histograms
                    .map(|histogram| histogram_quantile(histogram, self.trials, q))
                    .collect()
            }
            None => vec![None; self.horizon],
        };
        CurveQuantiles {
            q05: at(0.05),
            q50: at(0.5),
            q95: at(0.95),
        }
    }
}

/// Returns the middle of the bin with the order statistic of rank `ceil(q M)`; `None` if that is a trial without the
/// measure.
fn histogram_quantile(histogram: &[u32], trials: u64, q: f64) -> Option<f64> {
    let rank = ((q * trials as f64).ceil() as u64).max(1);
    let mut below = 0;
    let found = histogram.iter().position(|&count| {
        below += u64::from(count);
        below >= rank
    });
    found.map(middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantile_is_within_the_stated_error() {
        let mut curves = Curves::new(1);
        let mut values: Vec<f64> = (0..9999).map(|i| libm::exp(f64::from(i % 997) / 50.0 - 15.0)).collect();
        for value in &values {
            curves.add(true, [*value]);
        }
        values.sort_by(f64::total_cmp);
        let curves = curves.take(&(0..9999));
        let found = curves.quantiles(true);
        for (found, q) in [(&found.q05, 0.05), (&found.q50, 0.5), (&found.q95, 0.95)] {
            let exact = values[(q * 9999.0_f64).ceil() as usize - 1];
            assert!((found[0].unwrap() / exact - 1.0).abs() <= CURVE_BIN_ERROR);
        }
        assert_eq!(curves.quantiles(false).q50, [None]);
    }

    #[test]
    fn what_is_beyond_the_bins_is_kept_and_nan_is_not() {
        assert_eq!((bin(0.0), bin(1e-300), bin(1e300)), (0, 0, BINS - 1));
        assert_eq!(bin(f64::INFINITY), BINS - 1);
        let mut curves = Curves::new(2);
        curves.add(false, [f64::NAN, 1.0]);
        let curves = curves.take(&(0..1));
        let mut other = curves.clone();
        other.merge(curves);
        let found = other.quantiles(false);
        assert_eq!(found.q50, [None, Some(1.0 + 1.0 / 32.0)]);
    }
}
