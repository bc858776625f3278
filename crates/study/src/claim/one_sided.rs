//! One-sided tests of a number against a limit: a p-value, and what more trials would make of it.

use asobench_identification::metric::tails::{binomial_at_most, normal_above, normal_point};

/// The side of a limit on which a number is claimed to lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Below,
    Above,
}

/// A one-sided test against a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OneSided {
    /// Its p-value.
    pub(crate) p: f64,
    /// Its prospect with more trials.
    pub(crate) prospect: Prospect,
}

/// The prospect of a test with more trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Prospect {
    /// Nothing.
    Stays,
    /// Its distance from the limit in standard errors grows with the root of the number of trials.
    Root,
    /// Few successes among the trials, if each has this chance at the limit, with a share of the level.
    Few {
        count: u64,
        total: u64,
        chance: f64,
        share: f64,
    },
    /// The logarithm of a gambler's capital has this mean and standard deviation for each trial.
    Gain { mean: f64, spread: f64, trials: f64 },
}

/// More trials than there are, and what they may find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct More {
    /// The number of trials over the present one.
    pub(crate) factor: f64,
    /// The truth, in present standard errors from the present estimate: positive on the side of a limit on which it is
    /// to be certain.
    pub(crate) shift: f64,
}

impl OneSided {
    pub(crate) const SURE: Self = Self {
        p: 0.0,
        prospect: Prospect::Stays,
    };
    pub(crate) const NEVER: Self = Self {
        p: 1.0,
        prospect: Prospect::Stays,
    };

    pub(crate) fn of(is_sure: bool) -> Self {
        if is_sure { Self::SURE } else { Self::NEVER }
    }

    /// Few successes among the trials, if each has this chance at the limit.
    pub(crate) fn few(count: u64, total: u64, chance: f64) -> Self {
        Self {
            p: binomial_at_most(count, total, chance),
            prospect: Prospect::Few {
                count,
                total,
                chance,
                share: 1.0,
            },
        }
    }

    /// Returns how far on the right side of the limit the number lies, in approximate standard errors.
    pub(crate) fn margin(self) -> f64 {
        match self.prospect {
            // Counts tell numbers apart whose p-values are 0 or 1.
            Prospect::Few {
                count, total, chance, ..
            } => {
                let (n, k) = (total as f64, count as f64);
                (n * chance - k) / (n * chance * (1.0 - chance)).sqrt().max(1e-300)
            }
            _ => normal_point(self.p),
        }
    }

    /// Returns the chance that p is at most `level` with more trials.
    pub(crate) fn power(self, More { factor, shift }: More, level: f64) -> f64 {
        match self.prospect {
            Prospect::Stays => f64::from(u8::from(self.p <= level)),
            Prospect::Root => normal_above(normal_point(level) - (normal_point(self.p) + shift) * factor.sqrt()),
            Prospect::Few {
                count,
                total,
                chance,
                share: of_level,
            } => {
                let n = total as f64;
                let share = count as f64 / n;
                // Not 0 where no trial or every trial counts.
                let spread = (share * (1.0 - share)).max(1.0 / (n + 1.0)) / n;
                let share = (share - shift * spread.sqrt()).clamp(0.0, 1.0);
                few((n * factor).round() as u64, share, chance, of_level * level)
            }
            Prospect::Gain { mean, spread, trials } => {
                let (spread, n) = (spread.max(1e-12), trials * factor);
                let mean = mean + shift * spread / trials.sqrt();
                normal_above(((10.0 / level).ln() - n * mean) / (spread * n.sqrt()))
            }
        }
    }
}

/// Returns P(P(K <= k) <= level). Here k and K count successes among `trials`, of probability `share` for k and
/// `chance` for K.
fn few(trials: u64, share: f64, chance: f64, level: f64) -> f64 {
    /// From this variance on, the normal approximation suffices.
    const LARGE: f64 = 1000.0;
    let n = trials as f64;
    let deviation = |p: f64| (n * p * (1.0 - p)).sqrt();
    if deviation(chance) * deviation(chance) > LARGE && deviation(share) > 0.0 {
        let critical = n * chance - normal_point(level) * deviation(chance);
        return normal_above((n * share - critical) / deviation(share));
    }
    // Bisection for the smallest count that is not significant.
    let (mut low, mut high) = (0, trials + 1);
    while low < high {
        let middle = low + (high - low) / 2;
        if binomial_at_most(middle, trials, chance) <= level {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low.checked_sub(1)
        .map_or(0.0, |most| binomial_at_most(most, trials, share))
}
