//! The search for the lowest minimum, from several starts.

use super::descent::{Descent, Found, Watch};
use super::kernels::Triangle;
use super::starts::Starts;
use crate::estimator::FailureKind;

/// The scaled gradient at which the search from each start ends, and at which the final search from the best ends.
const NEAR: f64 = 1e-4;
const REST: f64 = 1e-10;

/// Losses that agree to this relative accuracy at the end of searches belong to the same minimum.
const SAME: f64 = 1e-6;

/// After this many iterations a search is given up if the best step that its linearisation predicts does not reach the
/// lowest minimum so far.
const SCREENED: usize = 16;

/// A search is at a known minimum if its linearisation puts the minimum this close: the squared distance is this share
/// of the sum, and so is the difference of the sums at most.
const MERGED: f64 = 1e-3;

/// A point that is no minimum is taken if the lowest minimum is this much less likely, in twice the logarithm:
/// chi-squared with one degree of freedom exceeds it with probability 0.001.
const EVIDENCE: f64 = 10.828;

/// Random starts end when fewer minima than this are expected besides those found.
const MISSED: f64 = 0.25;

/// A minimum, or the best point of a search that did not end at one.
struct Point {
    theta: Vec<f64>,
    found: Found,
}

/// The reason to end a search early.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stopped {
    /// It came to a known minimum.
    Merged,
    /// It cannot reach the lowest minimum.
    Behind,
}

/// Stops searches that lead to nothing new.
struct Screen<'a> {
    minima: &'a [Point],
    stopped: Option<Stopped>,
    difference: Vec<f64>,
}

impl Watch for Screen<'_> {
    fn stops(&mut self, iterations: usize, theta: &[f64], sums: [f64; 2], psi: &Triangle) -> bool {
        let [sum, predicted] = sums;
        let r = psi.r();
        for known in self.minima {
            if (sum - known.found.sum).abs() > MERGED * sum {
                continue;
            }
            self.difference.clear();
            let pairs = theta.iter().zip(&known.theta);
            self.difference.extend(pairs.map(|(x, y)| x - y));
            let square = |i: usize| {
                let row = (i..theta.len()).map(|j| r[(i, j)] * self.difference[j]);
                row.sum::<f64>().powi(2)
            };
            if (0..theta.len()).map(square).sum::<f64>() <= MERGED * sum {
                self.stopped = Some(Stopped::Merged);
                return true;
            }
        }
        let lowest = self.minima.iter().map(|known| known.found.sum);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        if iterations >= SCREENED && predicted > lowest {
            self.stopped = Some(Stopped::Behind);
        }
        self.stopped.is_some()
    }
}

/// Searches from start after start.
pub(super) struct Search {
    starts: Starts,
    pub(super) descent: Descent,
    /// The minima found, each once.
    found: Vec<Point>,
    /// The best point of a search that did not end at a minimum.
    unfinished: Option<Point>,
    pub(super) theta: Vec<f64>,
    /// The share of a minimum's sum below which a point that is no minimum is taken instead.
    much_lower: f64,
}

impl Search {
    pub(super) fn new(starts: Starts, descent: Descent, window: usize) -> Self {
        Self {
            theta: descent.theta().to_vec(),
            starts,
            descent,
            found: Vec::new(),
            unfinished: None,
            much_lower: (-EVIDENCE / window as f64).exp(),
        }
    }

    /// Returns the parameters found.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Returns the number of distinct minima found.
    pub(super) fn minima(&self) -> usize {
        self.found.len()
    }

    /// Searches for the lowest minimum of a record, in which B is in units of `gain`, from the models given too. The
    /// model of `other` is a start if the search has not ended when its turn comes.
    pub(super) fn run(
        &mut self,
        u: &[f64],
        y: &[f64],
        gain: f64,
        given: &[Vec<f64>],
        other: impl FnOnce() -> Option<Vec<f64>>,
    ) -> Found {
        self.found.clear();
        self.unfinished = None;
        let mut failed = FailureKind::NotIdentifiable;
        let (mut drawn, mut searches, mut iterations) = (0, 0, 0);
        let mut agree = true;
        self.starts.begin(gain);
        let (mut models, mut other) = (given.iter(), Some(other));
        loop {
            let lowest = self.found.iter().min_by(|a, b| a.found.sum.total_cmp(&b.found.sum));
            let best = lowest.or(self.unfinished.as_ref());
            let best = best.map(|point| point.theta.as_slice());
            let of_other = other
                .take_if(|_| self.starts.is_turn_of_other())
                .and_then(|other| other());
            let of_other = of_other.as_deref();
            let given = of_other.or_else(|| models.next().map(Vec::as_slice));
            let Some(start) = given.or_else(|| self.starts.next(u, y, best)) else {
                break;
            };
            // No minimum that is known by then ends the search from the other method's model.
            let minima = if of_other.is_some() { &[] } else { self.found.as_slice() };
            let mut screen = Screen {
                minima,
                stopped: None,
                difference: Vec::new(),
            };
            let found = self.descent.run_watched(u, y, start, NEAR, &mut screen);
            iterations += found.iterations;
            let stopped = screen.stopped;
            drawn += usize::from(given.is_none() && self.starts.was_drawn());
            searches += usize::from(given.is_none());
            agree &= stopped == Some(Stopped::Merged) || found.failure.is_none();
            if stopped.is_none() {
                if let Some(kind) = found.failure {
                    failed = kind;
                }
                self.keep(found);
            }
            if agree && self.is_agreed(searches) || is_enough(drawn, self.found.len()) {
                break;
            }
        }
        let mut result = self.finish(u, y, failed);
        result.iterations += iterations;
        result
    }

    /// Whether the independent starts, which settled at minima, did so at one inside the border.
    fn is_agreed(&mut self, searches: usize) -> bool {
        let [minimum] = self.found.as_slice() else {
            return false;
        };
        self.starts.are_enough(searches, &minimum.theta) && !self.descent.is_at_the_border(&minimum.theta)
    }

    /// Keeps the end of a search if it is new.
    fn keep(&mut self, found: Found) {
        let point = Point {
            theta: self.descent.theta().to_vec(),
            found,
        };
        match found.failure {
            None => {
                let same = |other: &Point| (found.sum - other.found.sum).abs() <= SAME * other.found.sum;
                match self.found.iter_mut().find(|other| same(other)) {
                    Some(other) if found.sum < other.found.sum => *other = point,
                    Some(_) => {}
                    None => self.found.push(point),
                }
            }
            Some(kind) => {
                let lower = |other: &Point| found.sum < other.found.sum;
                if kind.leaves_a_model() && self.unfinished.as_ref().is_none_or(lower) {
                    self.unfinished = Some(point);
                }
            }
        }
    }

    /// Searches from the lowest minimum to its end; from the next if that fails. The best point of the other searches
    /// is taken instead if there is no minimum, or if it is so much lower that no minimum explains the record.
    fn finish(&mut self, u: &[f64], y: &[f64], failed: FailureKind) -> Found {
        self.found.sort_by(|a, b| a.found.sum.total_cmp(&b.found.sum));
        let mut best = Found {
            sum: f64::INFINITY,
            iterations: 0,
            failure: Some(failed),
        };
        let mut iterations = 0;
        for point in &self.found {
            let found = self.descent.run(u, y, &point.theta, REST);
            iterations += found.iterations;
            let first = best.sum.is_infinite();
            if found.failure.is_none() || (first && found.failure.is_some_and(FailureKind::leaves_a_model)) {
                self.theta.copy_from_slice(self.descent.theta());
                best = found;
            }
            if found.failure.is_none() {
                break;
            }
        }
        if let Some(point) = &self.unfinished
            && point.found.sum < best.sum * self.much_lower
        {
            self.theta.copy_from_slice(&point.theta);
            best = point.found;
        }
        Found { iterations, ..best }
    }
}

/// The stopping rule of Boender and Rinnooy Kan: with w minima after n searches from random starts, w (n-1) / (n-w-2)
/// are expected in all.
fn is_enough(searches: usize, minima: usize) -> bool {
    let (n, w) = (searches as f64, minima as f64);
    w > 0.0 && n > w + 2.0 && w * (n - 1.0) / (n - w - 2.0) < w + MISSED
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Runs;
    use crate::estimator::prediction_error::predictor::OfRecord;
    use crate::estimator::test_setup::{normal, plant};
    use crate::model::Orders;
    use crate::signal::Purpose;

    /// Where the independent starts agree, the search ends at the minimum that all starts find, after far fewer
    /// linearisations.
    #[test]
    fn independent_starts_that_agree_are_enough() {
        let truth = plant("nb=2,nf=2,nk=1", &[1.0, 0.5, -1.5, 0.7]);
        for (orders, n) in [("nb=2,nf=2", 98), ("nb=2,nf=2", 998), ("na=2,nb=2,nc=2", 998)] {
            let orders: Orders = format!("{orders},nk=1").parse().unwrap();
            let descent = || Descent::new(orders, OfRecord::default(), Runs::new(&[n]));
            let starts = || Starts::new(orders, 16, n);
            let mut short = Search::new(starts(), descent(), n);
            let mut whole = Search::new(starts().all(), descent(), n);
            let mut linearisations = [0; 2];
            for trial in 0..20 {
                let u = normal(64, trial, Purpose::Input, n);
                let mut y = vec![0.0; n];
                truth.simulate(&u, &mut y);
                let noise = normal(64, trial, Purpose::NoiseDrive, n);
                y.iter_mut().zip(noise).for_each(|(y, noise)| *y += 0.4 * noise);
                let found = [&mut short, &mut whole].map(|search| search.run(&u, &y, 1.0, &[], || None));
                assert!(
                    found[0].failure.is_none() && found[1].failure.is_none(),
                    "{orders} {trial}"
                );
                assert!(found[0].sum <= found[1].sum * (1.0 + 1e-9), "{orders} {trial}");
                for (all, found) in linearisations.iter_mut().zip(found) {
                    *all += found.iterations;
                }
            }
            println!("{orders}, N = {n}: {linearisations:?} linearisations of 20 records, agreed and whole");
            assert!(
                3 * linearisations[0] < linearisations[1],
                "{orders}: {linearisations:?}"
            );
        }
    }
}
