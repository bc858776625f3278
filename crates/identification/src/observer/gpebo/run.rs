//! One run of several trials in lock step.

use super::cascade::Cascade;
use super::estimators::Estimator;
use super::least_squares::LeastSquaresIntegrals;
use super::linear::{LinearState, Propagator, Propagators};
use super::mixed_signals::Mixing;
use super::oscillators::Oscillators;
use super::scalar::At;
use super::score::{Accuracy, Score, squares};
use super::settings::ObserverSpec;
use super::summary::{ObserverEstimate, ObserverSummary, Outcome, Sample, Summary};
use crate::real::{MOST_LANES, Mask, Real};

/// A base step of each lane.
#[derive(Debug, Default)]
pub struct Start {
    /// Its length on the grid, and its start and end.
    pub length: [f64; MOST_LANES],
    pub from: [f64; MOST_LANES],
    pub to: [f64; MOST_LANES],
    /// The lanes in which it is the first one of a gap, as bits.
    pub first: u8,
}

/// A run in progress.
#[derive(Debug)]
pub struct Run<'a, R> {
    cascade: &'a Cascade,
    refine: usize,
    /// The squarings of its exponentials beyond those needed. Each of the runs that are compared has its own, so that
    /// their rounding differs, which is seen in the differences then.
    squarings: i32,
    /// Whether all of the summary is wanted; else its accuracy alone, without entries into the band.
    whole: bool,
    /// Whether the integrals of least squares are.
    integrals: bool,
    /// The length on the grid of the propagators of each lane.
    lengths: [f64; MOST_LANES],
    half: Propagator<R>,
    h: R,
    taken: usize,
    linear: LinearState<R>,
    /// The linear state in the middle of the last step.
    middle: LinearState<R>,
    estimators: Vec<Estimator<R>>,
    information: LeastSquaresIntegrals<R>,
    /// The integrals up to the middle of the last step.
    information_middle: LeastSquaresIntegrals<R>,
    mixing: Mixing<R>,
    pub(super) estimates: Vec<ObserverEstimate<R>>,
    /// One for each estimate.
    scores: Vec<Score<R>>,
    /// Buffer for the squared errors of one estimate.
    squares: Vec<R>,
    outcomes: Vec<[Outcome; MOST_LANES]>,
    outcome: [Outcome; MOST_LANES],
}

impl<'a, R: Real> Run<'a, R> {
    /// Starts a run at t = 0, with each base step divided into `refine` parts; `coarser` is its number from the finest
    /// on, of the runs that are compared.
    pub fn start(
        lanes: &[&'a Cascade],
        refine: usize,
        coarser: usize,
        known: &mut Propagators,
        oscillators: &mut Oscillators,
    ) -> Self {
        let (whole, squarings) = (coarser == 0, coarser as i32);
        let cascade = lanes[0];
        let n = cascade.n;
        let lengths = std::array::from_fn(|lane| {
            let cascade = lanes[lane.min(lanes.len() - 1)];
            cascade.grid.lengths.first().copied().unwrap_or_default()
        });
        let h = lengths[0] / refine as f64;
        let estimates = cascade.specs.iter().map(|spec| ObserverEstimate {
            x: vec![R::zero(); n],
            theta: vec![R::zero(); if spec.is_gpebo() { n } else { 0 }],
        });
        let squared =
            |spec: &ObserverSpec| matches!(spec, ObserverSpec::KalmanBucy { .. } | ObserverSpec::LsDrem { .. });
        let mut run = Self {
            cascade,
            refine,
            squarings,
            whole,
            integrals: whole || cascade.specs.iter().any(squared),
            lengths: [lengths[0]; MOST_LANES],
            half: Propagator::splat(&known.get(&cascade.system, h / 2.0, squarings)),
            h: R::splat(h),
            taken: 0,
            linear: cascade.system.initial(),
            middle: cascade.system.initial(),
            estimators: Estimator::all(&cascade.specs, n, h),
            information: LeastSquaresIntegrals::new(n),
            information_middle: LeastSquaresIntegrals::new(n),
            mixing: Mixing::new(&cascade.theta, &cascade.delays, h),
            estimates: estimates.collect(),
            scores: vec![],
            squares: vec![R::splat(f64::NAN); n + 2],
            outcomes: vec![[Outcome::Finite; MOST_LANES]; cascade.specs.len()],
            outcome: [Outcome::Finite; MOST_LANES],
        };
        run.set_lengths(&lengths, lanes, known);
        let zero = [0.0; MOST_LANES];
        let lines = run.lines(lanes, &zero);
        let oscillators = oscillators.at(lanes, &zero, 0, refine);
        cascade.system.start_step(&mut run.linear, &lines, oscillators);
        let all = R::Mask::from_bits(u8::MAX);
        run.mixing.observe(&cascade.system, &run.linear, 2, all);
        run.note_plant(&zero);
        for i in 0..run.estimates.len() {
            run.finish(At::End, i, R::zero(), &zero, true);
        }
        run
    }

    /// Whether the plant's state is finite in a lane.
    pub fn is_finite(&self, lane: usize) -> bool {
        self.outcome[lane] == Outcome::Finite
    }

    /// Sets the lengths of the lanes' base steps.
    fn set_lengths(&mut self, lengths: &[f64; MOST_LANES], lanes: &[&Cascade], known: &mut Propagators) {
        for lane in 0..lanes.len() {
            let length = lengths[lane];
            if self.lengths[lane] == length {
                continue;
            }
            // At once for all lanes that change to this length.
            let same = (0..lanes.len()).filter(|other| lengths[*other] == length);
            let bits = same.fold(0, |bits, other| bits | 1 << other);
            let mask = R::Mask::from_bits(bits);
            let h = length / self.refine as f64;
            let half = known.get(&self.cascade.system, h / 2.0, self.squarings);
            self.half.set(mask, &half);
            self.h = R::select(mask, R::splat(h), self.h);
            for other in mask.lanes() {
                self.lengths[other] = length;
            }
        }
    }

    /// Returns the lines of u and delta in the step that starts at t, in each lane.
    fn lines(&self, lanes: &[&Cascade], t: &[f64; MOST_LANES]) -> [[[f64; MOST_LANES]; 2]; 2] {
        let mut h = [0.0; MOST_LANES];
        self.h.store(&mut h);
        let mut lines = [[[0.0; MOST_LANES]; 2]; 2];
        for (lane, cascade) in lanes.iter().enumerate() {
            let found = cascade.system.line(t[lane], t[lane] + h[lane] / 2.0);
            for (line, (value, slope)) in lines.iter_mut().zip(found) {
                (line[0][lane], line[1][lane]) = (value, slope);
            }
        }
        lines
    }

    /// Advances one base step.
    pub fn advance(
        &mut self,
        step: &Start,
        lanes: &[&Cascade],
        known: &mut Propagators,
        oscillators: &mut Oscillators,
    ) {
        self.set_lengths(&step.length, lanes, known);
        let mut h = [0.0; MOST_LANES];
        self.h.store(&mut h);
        for k in 0..self.refine {
            let first = if k == 0 { step.first } else { 0 };
            let time = |part: usize| std::array::from_fn(|lane| step.from[lane] + part as f64 * h[lane]);
            let t: [f64; MOST_LANES] = time(k);
            let end = if k + 1 == self.refine {
                step.to
            } else {
                std::array::from_fn(|lane| t[lane] + h[lane])
            };
            let lines = self.lines(lanes, &t);
            let oscillators = oscillators.at(lanes, &t, k, self.refine);
            self.step(&lines, oscillators, R::Mask::from_bits(first));
            let middle = std::array::from_fn(|lane| t[lane] + h[lane] / 2.0);
            for i in 0..self.estimates.len() {
                self.finish(At::Middle, i, self.h, &middle, false);
            }
            self.note_plant(&end);
            for i in 0..self.estimates.len() {
                self.finish(At::End, i, self.h, &end, false);
            }
        }
    }

    /// Advances one step. The signals may jump at its start in the lanes in which it is the first of a gap, delayed
    /// ones in any step.
    fn step(&mut self, lines: &[[[f64; MOST_LANES]; 2]; 2], oscillators: &[[[f64; MOST_LANES]; 2]], first: R::Mask) {
        let jump = R::run(
            #[inline(always)]
            || self.propagate(lines, oscillators, first),
        );
        let (h, nodes) = (self.h, &self.mixing.nodes);
        let information = [&self.information_middle, &self.information];
        for estimator in &mut self.estimators {
            R::run(
                #[inline(always)]
                || estimator.step(h, nodes, jump, information),
            );
        }
        self.taken += 1;
    }

    /// Advances the linear systems, the first mixing and the integrals of least squares. Returns whether the signals
    /// may have jumped in any lane.
    #[inline(always)]
    fn propagate(
        &mut self,
        lines: &[[[f64; MOST_LANES]; 2]; 2],
        oscillators: &[[[f64; MOST_LANES]; 2]],
        first: R::Mask,
    ) -> bool {
        let (system, n, h) = (&self.cascade.system, self.cascade.n, self.h);
        system.start_step(&mut self.linear, lines, oscillators);
        let jump = self.mixing.shift(system, &self.linear, first);
        for node in 1..3 {
            self.linear.advance(&self.half, n);
            let all = R::Mask::from_bits(u8::MAX);
            self.mixing.observe(system, &self.linear, node, all);
            if node == 1 {
                self.middle.copy_from(&self.linear);
            }
        }
        self.mixing.delay();
        if self.integrals {
            let nodes = &self.mixing.nodes;
            self.information_middle.copy_from(&self.information);
            let halfway = &mut self.information_middle;
            halfway.add(At::Middle, h, &nodes.phi, &nodes.z);
            self.information.add(At::End, h, &nodes.phi, &nodes.z);
        }
        jump
    }

    /// Notes whether the plant's state is finite at the times t.
    fn note_plant(&mut self, t: &[f64; MOST_LANES]) {
        let n = self.cascade.n;
        let finite = R::run(
            #[inline(always)]
            || all_finite(self.linear.x(n), &[]),
        );
        for lane in (!finite).lanes() {
            self.outcome[lane].note(false, t[lane]);
        }
    }

    /// Computes an observer's estimate at a place in the last step, at the times t, and adds it to the score; at t = 0
    /// it starts the score. At the end of a step it notes what has been learnt, and whether all is finite.
    fn finish(&mut self, at: At, i: usize, h: R, t: &[f64; MOST_LANES], starts: bool) {
        R::run(
            #[inline(always)]
            || self.estimate(at, i, h, t, starts),
        );
        if starts {
            let score = Score::new(self.refine, self.whole, &self.squares);
            self.scores.push(score);
        }
    }

    #[inline(always)]
    fn estimate(&mut self, at: At, i: usize, h: R, t: &[f64; MOST_LANES], starts: bool) {
        let n = self.cascade.n;
        let (linear, information) = match at {
            At::Middle => (&self.middle, &self.information_middle),
            At::End => (&self.linear, &self.information),
        };
        let (estimator, estimate) = (&mut self.estimators[i], &mut self.estimates[i]);
        estimator.estimate(at, linear, information, estimate);
        if self.whole && matches!(at, At::End) {
            estimator.record(t);
            let finite = all_finite(&estimate.x, &estimate.theta) & all_finite(linear.x(n), &[]);
            if (!finite).any() {
                for lane in (!finite).lanes() {
                    self.outcomes[i][lane].note(false, t[lane]);
                }
            }
        }
        let theta = &self.cascade.theta;
        squares(&mut self.squares, linear.x(n), &estimate.x, theta, &estimate.theta);
        if !starts {
            let from = R::splat(self.cascade.scored_from);
            self.scores[i].add(R::load(t), h, from, &self.squares);
        }
    }

    /// Returns what there is of an observer so far, in a lane.
    fn summary_of(&self, i: usize, lane: usize) -> ObserverSummary {
        ObserverSummary {
            outcome: self.outcomes[i][lane],
            accuracy: self.accuracy(i, lane),
            excitation: self.estimators[i].excitation(self.cascade.horizon, lane),
        }
    }

    /// Returns the summary of the run so far, in a lane.
    pub fn summary(&self, lane: usize) -> Summary {
        let largest_dbar = self.mixing.largest_dbar.iter();
        let eigenvalue = || self.information.smallest_eigenvalue(lane);
        Summary {
            outcome: self.outcome[lane],
            observers: (0..self.scores.len()).map(|i| self.summary_of(i, lane)).collect(),
            largest_dbar: largest_dbar.map(|dbar| dbar.lane(lane)).collect(),
            smallest_eigenvalue: if self.whole { eigenvalue() } else { None },
            steps: self.taken,
        }
    }

    /// Returns the accuracy of an observer so far, in a lane.
    pub fn accuracy(&self, i: usize, lane: usize) -> Accuracy {
        let time = self.cascade.horizon - self.cascade.scored_from;
        self.scores[i].accuracy(time, lane)
    }

    /// Returns x at the end of the last step.
    pub fn x(&self) -> &[R] {
        self.linear.x(self.cascade.n)
    }
}

/// Returns the lanes in which all numbers are finite.
#[inline(always)]
fn all_finite<R: Real>(x: &[R], theta: &[R]) -> R::Mask {
    let mut finite = R::Mask::from_bits(u8::MAX);
    for i in 0..x.len() {
        finite = finite & x[i].is_finite();
    }
    for i in 0..theta.len() {
        finite = finite & theta[i].is_finite();
    }
    finite
}

impl Run<'_, f64> {
    /// Returns the state of the run at the time t of the last base step.
    pub fn sample(&self, t: f64) -> Sample<'_> {
        Sample {
            t,
            x: self.x(),
            estimates: &self.estimates,
            mbar: &self.mixing.mbar,
            delta: self.mixing.nodes.delta[2],
            dbar: &self.mixing.dbar,
        }
    }
}
