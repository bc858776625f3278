//! Rates: log-log slopes over cells that share their random numbers.

use super::estimate::nan_is_null;
use super::{Sample, Worse};
use crate::names::named_enum;
use serde::{Deserialize, Serialize};

/// Groups of trials that the jackknife leaves out in turn. A trial's group is its index modulo this number.
pub const JACKKNIFE_GROUPS: usize = 20;

/// Student's 97.5 % point for `JACKKNIFE_GROUPS - 1` = 19 degrees of freedom.
const T19: f64 = 2.093_024_054_408_263;

named_enum! {
    /// The statistic of a cell that the rate is fitted to.
    SlopeOf, "statistic" {
        /// Root mean square over trials.
        Rmse = "rmse",
        /// Median over trials.
        Median = "median",
    }
}

/// A slope of log(statistic) on log(x).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// The slope by ordinary least squares.
    #[serde(with = "nan_is_null")]
    pub value: f64,
    /// The jackknife's standard error, from G = [`JACKKNIFE_GROUPS`] groups. NaN for medians if a group has a single
    /// measure: leaving one value out moves a median by a single gap, whatever the distribution.
    #[serde(with = "nan_is_null")]
    pub mcse: f64,
    /// Number of cells.
    pub points: usize,
}

impl Slope {
    /// The 95 % interval `value -+ t mcse`, with t = 2.093 of Student's law with G - 1 = 19 degrees of freedom. An
    /// error from 20 groups is too uncertain for 1.96, which would cover 93.5 %.
    pub fn interval(&self) -> (f64, f64) {
        (self.value - T19 * self.mcse, self.value + T19 * self.mcse)
    }
}

/// The statistic of a cell, as a slope needs it: over all trials, and with each group left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jackknife {
    all: f64,
    without: [f64; JACKKNIFE_GROUPS],
    /// Whether the spread of `without` can be used as an error.
    has_error: bool,
}

/// Why there is no slope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoSlope {
    /// There must be as many abscissas as cells, and at least two.
    #[error("a slope needs at least two points, each with its cell")]
    TooFewPoints,
    /// An abscissa is not positive and finite, or all are equal.
    #[error("abscissas must be positive, finite and not all equal")]
    Abscissa,
    /// A cell does not have [`JACKKNIFE_GROUPS`] groups, each with a trial; the cell's index.
    #[error("cell {0} has too few trials: 20 groups with a measure in each are needed")]
    Groups(usize),
    /// A cell's statistic, over all trials or with a group left out, is zero, negative or undefined; the cell's index.
    #[error("cell {0}: the statistic is zero, negative or undefined, so it has no logarithm")]
    Statistic(usize),
}

/// Computes the slope of log(statistic) on log(x) by ordinary least squares over cells, with its standard error.
///
/// `cells[i]` has the measure at x\[i\] in [`JACKKNIFE_GROUPS`] samples, one per group of trials. Cells that share
/// their random numbers are dependent, so the residuals of the line do not give its error. Instead the same group is
/// left out of all cells at once: `MCSE^2 = (G - 1)/G sum_g (b_(g) - mean b)^2` (Efron and Stein 1981). This is the
/// error of the slope of the best-fitting line; it does not tell whether a line fits.
///
/// Logarithms are those of the platform, so the last bits may differ between machines.
///
/// # Errors
/// [`NoSlope`] if the slope is undefined.
pub fn slope(x: &[f64], cells: &[Vec<Sample>], statistic: SlopeOf) -> Result<Slope, NoSlope> {
    let cells: Vec<Option<Jackknife>> = cells
        .iter()
        .map(|groups| Jackknife::from_groups(groups, statistic, Worse::Larger))
        .collect();
    slope_of_statistics(x, &cells)
}

/// Computes [`slope`] from what it needs of each cell; `None` for a cell without its groups.
///
/// # Errors
/// [`NoSlope`] if the slope is undefined.
pub fn slope_of_statistics(x: &[f64], cells: &[Option<Jackknife>]) -> Result<Slope, NoSlope> {
    if x.len() != cells.len() || x.len() < 2 {
        return Err(NoSlope::TooFewPoints);
    }
    let weights = slope_weights(x).ok_or(NoSlope::Abscissa)?;
    let (mut whole, mut deleted) = (0.0, [0.0; JACKKNIFE_GROUPS]);
    let mut has_error = true;
    for (cell, (statistics, weight)) in cells.iter().zip(weights).enumerate() {
        let statistics = statistics.ok_or(NoSlope::Groups(cell))?;
        let Jackknife { all, without, .. } = statistics;
        has_error &= statistics.has_error;
        let log = |statistic: f64| {
            if statistic > 0.0 && statistic.is_finite() {
                Ok(statistic.ln())
            } else {
                Err(NoSlope::Statistic(cell))
            }
        };
        whole += weight * log(all)?;
        for (slope, statistic) in deleted.iter_mut().zip(without) {
            *slope += weight * log(statistic)?;
        }
    }
    let groups = JACKKNIFE_GROUPS as f64;
    let mean = deleted.iter().sum::<f64>() / groups;
    let squares: f64 = deleted.iter().map(|b| (b - mean) * (b - mean)).sum();
    Ok(Slope {
        value: whole,
        mcse: if has_error {
            ((groups - 1.0) / groups * squares).sqrt()
        } else {
            f64::NAN
        },
        points: x.len(),
    })
}

impl Jackknife {
    /// Computes the statistics of a cell's groups; `None` unless there are [`JACKKNIFE_GROUPS`] groups, each with a
    /// measure.
    pub fn from_groups(groups: &[Sample], statistic: SlopeOf, worse: Worse) -> Option<Self> {
        if groups.len() != JACKKNIFE_GROUPS || groups.iter().any(|group| group.count() == 0) {
            return None;
        }
        let of = |samples: &mut dyn Iterator<Item = &Sample>| match statistic {
            SlopeOf::Rmse => Sample::rmse_of_all(samples),
            SlopeOf::Median => {
                let mut merged = Sample::default();
                samples.for_each(|sample| merged.merge(sample));
                merged.median_value(worse)
            }
        };
        let without = |left_out: usize| {
            let others = groups.iter().enumerate();
            of(&mut others.filter_map(|(g, group)| (g != left_out).then_some(group)))
        };
        Some(Self {
            all: of(&mut groups.iter()),
            without: std::array::from_fn(without),
            has_error: statistic == SlopeOf::Rmse || groups.iter().all(|group| group.count() > 1),
        })
    }
}

/// The weights w in the slope `sum_i w_i log(statistic_i)`: `w_i = (l_i - mean l) / sum (l - mean l)^2` with l = log x.
pub fn slope_weights(x: &[f64]) -> Option<Vec<f64>> {
    if !x.iter().all(|x| *x > 0.0 && x.is_finite()) || x.iter().all(|other| *other == x[0]) {
        return None;
    }
    let logs: Vec<f64> = x.iter().map(|x| x.ln()).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    let squares: f64 = logs.iter().map(|l| (l - mean) * (l - mean)).sum();
    (squares > 0.0).then(|| logs.iter().map(|l| (l - mean) / squares).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::normal::fill_standard_normal;
    use crate::signal::{Purpose, stream};

    fn groups(values: &[f64]) -> Vec<Sample> {
        let group = |g: usize| values[g..].iter().step_by(JACKKNIFE_GROUPS).copied();
        (0..JACKKNIFE_GROUPS).map(|g| Sample::from_values(group(g))).collect()
    }

    fn normals(trial: u64, count: usize) -> Vec<f64> {
        let mut z = vec![0.0; count];
        fill_standard_normal(&mut stream(31, trial, Purpose::NoiseDrive), &mut z);
        z
    }

    /// Cells that are multiples x^-1/2 of the same numbers: the slope is -1/2 without error, for medians to the
    /// resolution of the bins.
    #[test]
    fn shared_numbers_leave_no_error() {
        let z: Vec<f64> = normals(0, 400).iter().map(|z| z.abs()).collect();
        let x = [10.0, 100.0, 1000.0];
        let cell = |x: &f64| groups(&z.iter().map(|z| z / x.sqrt()).collect::<Vec<_>>());
        let cells: Vec<_> = x.iter().map(cell).collect();
        let found = slope(&x, &cells, SlopeOf::Rmse).unwrap();
        assert!((found.value + 0.5).abs() < 1e-14 && found.mcse < 1e-14 && found.points == 3);
        let found = slope(&x, &cells, SlopeOf::Median).unwrap();
        assert!((found.value + 0.5).abs() < 1e-3 && found.mcse < 1e-3);
    }

    /// Two cells, RMSE: the slope is log(R2/R1)/log(x2/x1), and the jackknife is written out.
    #[test]
    fn two_cells_by_hand() {
        let (a, b) = (normals(1, 200), normals(2, 200));
        let cells = [groups(&a), groups(&b)];
        let found = slope(&[1.0, std::f64::consts::E], &cells, SlopeOf::Rmse).unwrap();
        let log_ratio = |keep: &dyn Fn(usize) -> bool| {
            let square = |z: &[f64]| -> f64 {
                let kept = z.iter().enumerate().filter(|(i, _)| keep(i % 20));
                kept.map(|(_, z)| z * z).sum()
            };
            0.5 * (square(&b) / square(&a)).ln()
        };
        assert!((found.value - log_ratio(&|_| true)).abs() < 1e-14);
        let deleted: Vec<f64> = (0..20).map(|g| log_ratio(&|i| i != g)).collect();
        let mean = deleted.iter().sum::<f64>() / 20.0;
        let squares: f64 = deleted.iter().map(|b| (b - mean).powi(2)).sum();
        assert!((found.mcse - (0.95 * squares).sqrt()).abs() < 1e-13);
        // In theory the log of an RMSE of 200 normal numbers has error 1/sqrt(400); here there are two of them.
        assert!((found.mcse / (2.0_f64 / 400.0).sqrt() - 1.0).abs() < 0.5);
    }

    /// A group of one trial is not enough for the error of a median.
    #[test]
    fn medians_need_two_trials_in_every_group() {
        for (trials, known) in [(20, false), (39, false), (40, true)] {
            let cells = [1, 2].map(|cell| {
                let z = normals(cell, trials);
                groups(&z.iter().map(|z| z.abs()).collect::<Vec<_>>())
            });
            let slope_of = |statistic| slope(&[1.0, 2.0], &cells, statistic).unwrap();
            assert!(slope_of(SlopeOf::Median).value.is_finite());
            assert_eq!(slope_of(SlopeOf::Median).mcse.is_finite(), known, "{trials}");
            assert!(slope_of(SlopeOf::Rmse).mcse.is_finite());
        }
    }

    #[test]
    fn reasons_for_no_slope() {
        let full = groups(&normals(3, 40));
        let zero = groups(&[0.0; 40]);
        let short = groups(&normals(3, 19));
        let rmse_slope = |x: &[f64], cells: &[Vec<Sample>]| slope(x, cells, SlopeOf::Rmse);
        let two = [full.clone(), full.clone()];
        assert_eq!(rmse_slope(&[1.0], &two), Err(NoSlope::TooFewPoints));
        assert_eq!(rmse_slope(&[1.0], &two[..1]), Err(NoSlope::TooFewPoints));
        assert_eq!(rmse_slope(&[1.0, 0.0], &two), Err(NoSlope::Abscissa));
        assert_eq!(rmse_slope(&[2.0, 2.0], &two), Err(NoSlope::Abscissa));
        let found = rmse_slope(&[1.0, 2.0], &[full.clone(), zero]);
        assert_eq!(found, Err(NoSlope::Statistic(1)));
        let found = rmse_slope(&[1.0, 2.0], &[short, full.clone()]);
        assert_eq!(found, Err(NoSlope::Groups(0)));
        let found = rmse_slope(&[1.0, 2.0], &[full.clone(), full[..5].to_vec()]);
        assert_eq!(found, Err(NoSlope::Groups(1)));
    }
}
