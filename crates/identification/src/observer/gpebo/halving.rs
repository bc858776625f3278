//! How far the results depend on the step.

use super::cascade::Cascade;
use super::grid::REFINEMENTS;
use super::linear::Propagators;
use super::runs::Runs;
use super::score::{Accuracy, THETA};
use super::summary::{Sample, Summary};
use crate::real::Real;

/// The influence of the step length on one observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// The error of xhat, in the unit of x.
    pub state: StepError,
    /// The error of theta_hat, in the unit of theta; all zero for observers without one.
    pub theta: StepError,
    /// The largest error of the observer's measures. The error of a root mean square is that of its integration, by
    /// the same formula with twice the nodes, plus Richardson's estimate from three runs by the same formula on the
    /// same nodes. It is relative to the root mean square, or, if it is mere rounding, to the size of the estimated
    /// quantity. Richardson's estimate for the relative error of theta at the end is taken as it is.
    pub measures: f64,
}

impl Convergence {
    /// Returns the largest of the relative errors of xhat, of theta_hat and of the measures; NaN if a run was not
    /// finite.
    pub fn relative(&self) -> f64 {
        let estimates = larger(self.state.relative(), self.theta.relative());
        larger(estimates, self.measures)
    }
}

/// The influence of the step length on one vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepError {
    /// Estimated error of the finest run by Richardson: the largest difference of any component over time between
    /// the runs with h/2 and h/4, divided by `2^p - 1`. p is the observed order, limited to 0.1 ... 2, or 1/2 if
    /// unknown. The scalar estimators are of order 2. Where more is observed, steps are too long for an order or
    /// differences are rounding, and a larger divisor would say too little; where less is, the runs hardly converge.
    /// NaN if a run was not finite.
    pub error: f64,
    /// The scale to compare with: the largest component over time of the finest run's vector or of the true one.
    pub largest: f64,
    /// `log2` of the ratio of the largest differences of neighbouring runs. `None` if these are rounding, i.e. below
    /// eps times `largest` for each propagation of the finest run.
    pub order: Option<f64>,
}

impl StepError {
    /// Returns the error divided by the largest component; 0 if the error is 0.
    pub fn relative(&self) -> f64 {
        if self.error == 0.0 {
            0.0
        } else {
            self.error / self.largest
        }
    }
}

/// The result of three runs with different steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Halving {
    /// The summary of the finest run, h/4.
    pub summary: Summary,
    /// One for each observer, in their order.
    pub observers: Vec<Convergence>,
}

/// The largest differences of the runs' estimates of one vector, and the largest number of each component of the finest
/// and of the true one.
#[derive(Clone, Debug)]
struct Differences<R> {
    coarse: R,
    fine: R,
    largest: Vec<R>,
}

/// Returns the larger number; NaN if one is NaN.
#[inline(always)]
fn larger<R: Real>(a: R, b: R) -> R {
    let nan = !a.at_most(a);
    R::select(b.at_most(a) | nan, a, b)
}

/// Returns the larger number, not NaN if one is a number.
#[inline(always)]
fn larger_number<R: Real>(a: R, b: R) -> R {
    let nan = !b.at_most(b);
    R::select(b.less(a) | nan, a, b)
}

/// Returns the possible rounding of two propagations in each of `steps` steps.
fn rounding(largest: f64, steps: usize) -> f64 {
    f64::EPSILON * largest * 2.0 * steps as f64
}

impl<R: Real> Differences<R> {
    fn new(components: usize) -> Self {
        Self {
            coarse: R::zero(),
            fine: R::zero(),
            largest: vec![R::zero(); components],
        }
    }

    /// Compares three vectors and notes the size of the finest and of the true one.
    #[inline(always)]
    fn note(&mut self, [coarse, middle, fine]: [&[R]; 3], truth: impl Fn(usize) -> R) {
        for i in 0..fine.len() {
            self.coarse = larger(self.coarse, (coarse[i] - middle[i]).abs());
            self.fine = larger(self.fine, (middle[i] - fine[i]).abs());
            let size = larger_number(fine[i].abs(), truth(i).abs());
            self.largest[i] = larger(self.largest[i], size);
        }
    }

    /// Returns those of one lane.
    fn lane(&self, lane: usize) -> Differences<f64> {
        Differences {
            coarse: self.coarse.lane(lane),
            fine: self.fine.lane(lane),
            largest: self.largest.iter().map(|size| size.lane(lane)).collect(),
        }
    }
}

impl Differences<f64> {
    fn step_error(&self, steps: usize) -> StepError {
        let largest = self.largest.iter().copied().fold(0.0, larger);
        let rounding = rounding(largest, steps);
        StepError {
            error: richardson(self.coarse, self.fine, rounding),
            largest,
            order: order(self.coarse, self.fine, rounding),
        }
    }
}

/// Returns the observed order of two differences of neighbouring runs; `None` if one is mere rounding.
fn order(coarse: f64, fine: f64, rounding: f64) -> Option<f64> {
    (fine > rounding && coarse > rounding).then(|| (coarse / fine).log2())
}

/// Returns the error of the finest run by [`StepError::error`]'s rule.
fn richardson(coarse: f64, fine: f64, rounding: f64) -> f64 {
    let order = order(coarse, fine, rounding).unwrap_or(0.5);
    fine / (order.clamp(0.1, 2.0).exp2() - 1.0)
}

/// Runs with steps h, h/2 and h/4 side by side. Calls `visit` with the finest at t = 0 and after each base step.
pub fn halve(cascade: &Cascade, mut visit: impl FnMut(&Sample<'_>)) -> Halving {
    let visit = |runs: &Runs<'_, f64>| visit(&runs.sample());
    let mut found = run_lanes(vec![cascade], &mut Propagators::default(), visit);
    found.remove(0)
}

/// Does the same for several trials, as many as there are lanes in lock step, if they fit each other. Each result
/// has the bits that it has alone.
pub fn halve_pack<R: Real>(cascades: &[Cascade], known: &mut Propagators) -> Vec<Halving> {
    let mut found = Vec::with_capacity(cascades.len());
    for pack in cascades.chunks(R::LANES) {
        if pack.len() > 1 && pack.iter().all(|cascade| pack[0].fits(cascade)) {
            found.append(&mut run_lanes::<R>(pack.iter().collect(), known, |_| {}));
            continue;
        }
        for cascade in pack {
            found.append(&mut run_lanes::<f64>(vec![cascade], known, |_| {}));
        }
    }
    found
}

/// Runs trials that fit each other, no more than lanes, and returns their results.
fn run_lanes<R: Real>(
    cascades: Vec<&Cascade>,
    known: &mut Propagators,
    mut visit: impl FnMut(&Runs<'_, R>),
) -> Vec<Halving> {
    let [first, ..] = cascades[..] else {
        return vec![];
    };
    let mut found = vec![None; cascades.len()];
    let mut runs = Runs::<R>::start(cascades, &REFINEMENTS, known);
    let sizes = [first.n, first.n].map(Differences::new);
    let mut differences = vec![sizes; first.observers()];
    let mut running = (1_u16 << found.len()) - 1;
    loop {
        visit(&runs);
        compare(&runs, first, &mut differences);
        let left = running & u16::from(runs.going_on());
        for lane in (0..found.len()).filter(|lane| (running & !left) >> lane & 1 == 1) {
            let lane_of = |all: &[Differences<R>; 2]| all.each_ref().map(|of| of.lane(lane));
            let differences = differences.iter().map(lane_of);
            let differences: Vec<_> = differences.collect();
            found[lane] = Some(conclude(&runs, first, &differences, lane));
        }
        running = left;
        if running == 0 {
            break;
        }
        runs.advance(known);
    }
    found.into_iter().flatten().collect()
}

/// Compares the estimates of the three runs.
fn compare<R: Real>(runs: &Runs<'_, R>, cascade: &Cascade, differences: &mut [[Differences<R>; 2]]) {
    let [coarse, middle, fine] = &runs.refined[..] else {
        return;
    };
    let (x, theta) = (fine.x(), cascade.theta());
    R::run(
        #[inline(always)]
        || {
            for i in 0..differences.len() {
                let of = [&coarse.estimates[i], &middle.estimates[i], &fine.estimates[i]];
                let [states, thetas] = &mut differences[i];
                let [a, b, c] = of;
                states.note(
                    [&a.x, &b.x, &c.x],
                    #[inline(always)]
                    |k| x[k],
                );
                thetas.note(
                    [&a.theta, &b.theta, &c.theta],
                    #[inline(always)]
                    |k| R::splat(theta[k]),
                );
            }
        },
    );
}

/// Returns the result of a lane that has ended.
fn conclude<R: Real>(
    runs: &Runs<'_, R>,
    cascade: &Cascade,
    differences: &[[Differences<f64>; 2]],
    lane: usize,
) -> Halving {
    let summary = runs.summary(lane);
    let size = cascade.theta().iter().map(|theta| theta * theta).sum::<f64>();
    let convergence = |(number, differences): (usize, &[Differences<f64>; 2])| {
        let [state, theta] = differences.each_ref().map(|runs| runs.step_error(summary.steps));
        // Of the root mean squares: of x, of the relative error of theta, and of x_1 ... x_n, each in its own unit.
        let mut scales = vec![state.largest, theta.largest / size.sqrt()];
        scales.extend(&differences[0].largest);
        let fine = &summary.observers[number].accuracy;
        let [coarse, middle] = [0, 1].map(|run| runs.refined[run].accuracy(number, lane));
        let accuracies = [&coarse, &middle, fine];
        Convergence {
            state,
            theta,
            measures: measures(accuracies, &scales, summary.steps),
        }
    };
    Halving {
        observers: differences.iter().enumerate().map(convergence).collect(),
        summary,
    }
}

/// Computes [`Convergence::measures`]. The scales are the largest values of the quantities whose errors enter the root
/// mean squares, in the order of [`Accuracy::finer`].
fn measures(runs: [&Accuracy; 3], scales: &[f64], steps: usize) -> f64 {
    let [coarse, middle, fine] = runs;
    let differ = |a: f64, b: f64| (a - b).abs();
    // Zero where there is no theta.
    let end = richardson(
        differ(coarse.theta, middle.theta).max(0.0),
        differ(middle.theta, fine.theta).max(0.0),
        rounding(scales[THETA], steps),
    );
    let (ends, finer) = (runs.map(Accuracy::root_means), runs.map(|run| &run.finer));
    let mut most = end;
    for (k, found) in ends[2].iter().enumerate() {
        // The measure does not exist.
        if found.is_nan() {
            continue;
        }
        let scale = scales[k];
        let rounding = rounding(scale, steps);
        // Simpson's rule on the ends of h/2, which are the middles of h, and Boole's on those of h/4.
        let coarse = differ(finer[0][k], ends[1][k]);
        let fine = differ(finer[1][k], ends[2][k]);
        let error = differ(finer[2][k], *found) + richardson(coarse, fine, rounding);
        let relative = error / if error <= rounding { scale } else { *found };
        most = larger(most, if error == 0.0 { 0.0 } else { relative });
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn richardson() {
        let differences = Differences {
            coarse: 1.6,
            fine: 0.1,
            largest: vec![1.0, 2.0],
        };
        let found = differences.step_error(100);
        assert_eq!(found.order, Some(4.0));
        assert_eq!(found.error, 0.1 / 3.0);
        let slow = Differences {
            coarse: 0.11,
            fine: 0.1,
            largest: vec![2.0],
        }
        .step_error(100);
        assert!((slow.error - 0.1 / (1.1 - 1.0)).abs() < 1e-13);
        let rounding = Differences {
            coarse: 1e-16,
            fine: 1e-16,
            largest: vec![1.0],
        }
        .step_error(100);
        assert_eq!(rounding.order, None);
        assert!((rounding.error / 1e-16 - (2.0_f64.sqrt() + 1.0)).abs() < 1e-13);
        assert!(larger(f64::NAN, 1.0).is_nan() && larger(1.0, f64::NAN).is_nan());
    }
}
