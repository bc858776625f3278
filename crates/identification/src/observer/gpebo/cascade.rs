//! The run: plant, first mixing and all observers on one time grid.

use super::check::{check, check_delays};
use super::delay::{DelayLine, whole_steps};
use super::estimators::{Estimator, MixedNodes};
use super::filter::{half_simpson, simpson};
use super::grid::Grid;
use super::linear::{LinearState, LinearSystem, Propagator};
use super::mixing::Mixer;
use super::observer_spec::ObserverSpec;
use super::recursive::LeastSquaresIntegrals;
use super::refusal::CascadeError;
use super::scalar::At;
use super::scenario::{GpeboOptions, Scenario};
use super::score::{Score, squares};
use super::summary::{ObserverEstimate, ObserverSummary, Outcome, Sample, Summary};
use crate::plant::ContinuousPlant;

/// A plant, a scenario and observers that fit together.
#[derive(Clone, Debug)]
pub struct Cascade {
    n: usize,
    horizon: f64,
    scored_from: f64,
    /// The true theta = x(0) - xi(0).
    theta: Vec<f64>,
    specs: Vec<ObserverSpec>,
    system: LinearSystem,
    /// The rows of M that delays make, from 1 on, with the delay in seconds.
    delays: Vec<(usize, f64)>,
    grid: Grid,
}

impl Cascade {
    /// Checks the settings and prepares the matrices and the grid.
    ///
    /// # Errors
    /// If a length does not fit the plant's order, a filter or gain is not positive, filters are not distinct, or the
    /// step or a signal does not fit the horizon. Also if there is a delay and not all steps are equal and a whole part
    /// of it, or if there would be more than [`super::LARGEST_STEPS`] steps,
    /// [`super::LARGEST_BREAKPOINTS`] breakpoints or [`super::LARGEST_LENGTHS`] different step lengths.
    pub fn new(
        plant: &ContinuousPlant,
        scenario: &Scenario,
        options: &GpeboOptions,
        observers: &[ObserverSpec],
    ) -> Result<Self, CascadeError> {
        check(plant.order(), scenario, options, observers)?;
        let grid = Grid::new(scenario)?;
        check_delays(&grid, options, observers)?;
        Ok(Self {
            n: plant.order(),
            horizon: scenario.horizon,
            scored_from: scenario.scored_from,
            theta: scenario
                .x0
                .iter()
                .zip(&options.xi0)
                .map(|(x, xi)| x - xi)
                .collect(),
            specs: observers.to_vec(),
            system: LinearSystem::new(plant, scenario, options, observers),
            delays: (1..)
                .zip(&options.filters)
                .filter_map(|(row, operator)| Some((row, operator.delay()?)))
                .collect(),
            grid,
        })
    }

    /// Returns the number of observers.
    pub fn observers(&self) -> usize {
        self.specs.len()
    }

    /// Returns the true theta = x(0) - xi(0), of length n.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Runs with each base step divided into `refine` parts (0 counts as 1). Calls `visit` at t = 0 and after each base
    /// step.
    pub fn run(&self, refine: usize, mut visit: impl FnMut(&Sample<'_>)) -> Summary {
        let mut run = self.start(refine);
        visit(&run.sample());
        while run.advance() {
            visit(&run.sample());
        }
        run.summary()
    }

    /// Starts a run at t = 0, with each base step divided into `refine` parts (0 counts as 1).
    pub fn start(&self, refine: usize) -> Run<'_> {
        let n = self.n;
        let refine = refine.max(1);
        let lengths = self
            .grid
            .lengths
            .iter()
            .map(|length| length / refine as f64);
        let steps = lengths
            .map(|h| (h, self.system.propagator(h / 2.0)))
            .collect();
        let estimates = self.specs.iter().map(|spec| ObserverEstimate {
            x: vec![0.0; n],
            theta: if spec.is_gpebo() {
                vec![0.0; n]
            } else {
                vec![]
            },
        });
        let h = self.grid.lengths.first().copied().unwrap_or_default() / refine as f64;
        let mut run = Run {
            cascade: self,
            refine,
            steps,
            gap: 0,
            done: 0,
            taken: 0,
            t: 0.0,
            linear: self.system.initial(),
            middle: self.system.initial(),
            estimators: Estimator::all(&self.specs, n, h),
            information: LeastSquaresIntegrals::new(n),
            information_middle: LeastSquaresIntegrals::new(n),
            mixing: Mixing::new(n, &self.delays, h),
            estimates: estimates.collect(),
            scores: vec![],
            squares: vec![f64::NAN; n + 2],
            outcomes: vec![Outcome::Finite; self.specs.len()],
            outcome: Outcome::Finite,
        };
        self.system.start_step(&mut run.linear, 0.0, h / 2.0);
        run.mixing.observe(self, &run.linear, 2);
        run.finish_step(0.0);
        for number in 0..run.estimates.len() {
            run.note_squares(At::End, number);
            run.scores.push(Score::new(refine, &run.squares));
        }
        run
    }
}

/// The first mixing at the nodes of a step, with its buffers.
#[derive(Clone, Debug)]
struct Mixing {
    mixer: Mixer,
    /// z and phi for each row of M that a delay makes.
    delays: Vec<(usize, DelayLine)>,
    m: Vec<f64>,
    zbar: Vec<f64>,
    nodes: MixedNodes,
    /// mbar at the last node observed.
    mbar: Vec<f64>,
    dbar: Vec<f64>,
    largest_dbar: Vec<f64>,
}

impl Mixing {
    /// Starts with steps of length h, which matters to delays only.
    fn new(n: usize, delays: &[(usize, f64)], h: f64) -> Self {
        let line = |&(row, delay): &(usize, f64)| {
            Some((row, DelayLine::new(n + 1, whole_steps(delay, h)?)))
        };
        Self {
            mixer: Mixer::new(n),
            delays: delays.iter().filter_map(line).collect(),
            m: vec![0.0; n * n],
            zbar: vec![0.0; n],
            nodes: MixedNodes {
                delta: [0.0; 3],
                mbar: vec![[0.0; 3]; n],
                phi: vec![[0.0; 3]; n],
                z: [0.0; 3],
            },
            mbar: vec![0.0; n],
            dbar: vec![0.0; n],
            largest_dbar: vec![0.0; n],
        }
    }

    /// Computes node `k` from the linear state, Eqs. (9), (10).
    fn observe(&mut self, cascade: &Cascade, linear: &LinearState, k: usize) {
        cascade.system.observe(linear, &mut self.m, &mut self.zbar);
        for (row, line) in &self.delays {
            let [z, phi @ ..] = line.delayed() else {
                continue;
            };
            self.zbar[*row] = z[k];
            for (m, phi) in self.m[row * cascade.n..].iter_mut().zip(phi) {
                *m = phi[k];
            }
        }
        let delta = self.mixer.mix(&self.m, &self.zbar, &mut self.mbar);
        self.nodes.delta[k] = delta;
        self.nodes.z[k] = self.zbar[0];
        for (i, theta) in cascade.theta.iter().enumerate() {
            self.nodes.phi[i][k] = self.m[i];
            self.nodes.mbar[i][k] = self.mbar[i];
            self.dbar[i] = self.mbar[i] - delta * theta;
            self.largest_dbar[i] = self.largest_dbar[i].max(self.dbar[i].abs());
        }
    }

    /// Lets the delays have the step that ends.
    fn delay(&mut self) {
        let nodes = &self.nodes;
        for (_, line) in &mut self.delays {
            let signals = std::iter::once(&nodes.z).chain(&nodes.phi);
            for (to, from) in line.delayed_mut().iter_mut().zip(signals) {
                *to = *from;
            }
            line.advance();
        }
    }

    /// Makes the end of a step the start of the next.
    fn shift(&mut self) {
        let nodes = &mut self.nodes;
        let signals = [&mut nodes.delta, &mut nodes.z].into_iter();
        for signal in signals.chain(&mut nodes.mbar).chain(&mut nodes.phi) {
            signal[0] = signal[2];
        }
    }
}

/// A run in progress.
#[derive(Clone, Debug)]
pub struct Run<'a> {
    cascade: &'a Cascade,
    refine: usize,
    /// Step length and half-step propagator for each length of the grid.
    steps: Vec<(f64, Propagator)>,
    gap: usize,
    /// Base steps done in this gap.
    done: usize,
    taken: usize,
    t: f64,
    linear: LinearState,
    /// The linear state in the middle of the last step.
    middle: LinearState,
    estimators: Vec<Estimator>,
    information: LeastSquaresIntegrals,
    /// The integrals up to the middle of the last step.
    information_middle: LeastSquaresIntegrals,
    mixing: Mixing,
    estimates: Vec<ObserverEstimate>,
    /// One for each estimate.
    scores: Vec<Score>,
    /// Buffer for the squared errors of one estimate.
    squares: Vec<f64>,
    outcomes: Vec<Outcome>,
    outcome: Outcome,
}

impl Run<'_> {
    /// Advances one base step. Returns false, without doing anything, at the horizon or if the plant's state is not
    /// finite.
    pub fn advance(&mut self) -> bool {
        let Some(gap) = self.cascade.grid.gaps.get(self.gap).copied() else {
            return false;
        };
        if self.outcome != Outcome::Finite {
            return false;
        }
        let h = self.steps[gap.length].0;
        let (start, end) = (gap.time(self.done), gap.time(self.done + 1));
        for k in 1..=self.refine {
            let first = self.done == 0 && k == 1;
            let t = start + (k - 1) as f64 * h;
            self.step(t, gap.length, first);
            self.estimate(At::Middle);
            self.score(At::Middle, t + h / 2.0, h);
            let t = if k == self.refine { end } else { t + h };
            self.finish_step(t);
            self.score(At::End, t, h);
        }
        self.t = end;
        self.done += 1;
        if self.done == gap.count {
            (self.gap, self.done) = (self.gap + 1, 0);
        }
        true
    }

    /// Advances one step from t. The signals may jump before the first step of a gap, delayed ones before any step.
    fn step(&mut self, t: f64, length: usize, first: bool) {
        let (cascade, n) = (self.cascade, self.cascade.n);
        let (h, half) = &self.steps[length];
        cascade.system.start_step(&mut self.linear, t, t + h / 2.0);
        if first || !self.mixing.delays.is_empty() {
            self.mixing.observe(cascade, &self.linear, 0);
        } else {
            self.mixing.shift();
        }
        for node in 1..3 {
            self.linear.advance(half, n);
            self.mixing.observe(cascade, &self.linear, node);
            if node == 1 {
                self.middle.copy_from(&self.linear);
            }
        }
        self.mixing.delay();
        let nodes = &self.mixing.nodes;
        self.information_middle.copy_from(&self.information);
        let halfway = &mut self.information_middle;
        halfway.add(half_simpson, *h, &nodes.phi, &nodes.z);
        self.information.add(simpson, *h, &nodes.phi, &nodes.z);
        let information = [&self.information_middle, &self.information];
        for estimator in &mut self.estimators {
            estimator.step(*h, nodes, information);
        }
        self.taken += 1;
    }

    /// Computes the estimates at a place in the last step.
    fn estimate(&mut self, at: At) {
        let (linear, information) = match at {
            At::Middle => (&self.middle, &self.information_middle),
            At::End => (&self.linear, &self.information),
        };
        for (estimator, estimate) in self.estimators.iter_mut().zip(&mut self.estimates) {
            estimator.estimate(at, linear, information, estimate);
        }
    }

    /// Computes the estimates at t, the end of a step, and notes whether they are finite.
    fn finish_step(&mut self, t: f64) {
        self.estimate(At::End);
        let plant = self.linear.x(self.cascade.n).iter().all(|x| x.is_finite());
        self.outcome.note(plant, t);
        let all = self
            .estimators
            .iter_mut()
            .zip(&self.estimates)
            .zip(&mut self.outcomes);
        for ((estimator, estimate), outcome) in all {
            estimator.record(t);
            let finite = estimate
                .x
                .iter()
                .chain(&estimate.theta)
                .all(|v| v.is_finite());
            outcome.note(finite && plant, t);
        }
    }

    /// Scores the estimates at t, in the middle or at the end of a step of length h.
    fn score(&mut self, at: At, t: f64, h: f64) {
        for i in 0..self.scores.len() {
            self.note_squares(at, i);
            self.scores[i].add(t, h, self.cascade.scored_from, &self.squares);
        }
    }

    /// Computes the squared errors of an estimate into the buffer.
    fn note_squares(&mut self, at: At, number: usize) {
        let linear = match at {
            At::Middle => &self.middle,
            At::End => &self.linear,
        };
        let x = linear.x(self.cascade.n);
        let estimate = &self.estimates[number];
        squares(
            &mut self.squares,
            x,
            &estimate.x,
            &self.cascade.theta,
            &estimate.theta,
        );
    }

    /// Returns the state of the run after the last base step.
    pub fn sample(&self) -> Sample<'_> {
        Sample {
            t: self.t,
            x: self.linear.x(self.cascade.n),
            estimates: &self.estimates,
            mbar: &self.mixing.mbar,
            delta: self.mixing.nodes.delta[2],
            dbar: &self.mixing.dbar,
        }
    }

    /// Returns the summary of the run so far.
    pub fn summary(&self) -> Summary {
        let time = self.cascade.horizon - self.cascade.scored_from;
        let observers = self.estimators.iter().zip(&self.outcomes);
        Summary {
            outcome: self.outcome,
            observers: observers
                .zip(&self.scores)
                .map(|((estimator, outcome), score)| ObserverSummary {
                    outcome: *outcome,
                    accuracy: score.accuracy(time),
                    excitation: estimator.excitation(self.cascade.horizon),
                })
                .collect(),
            largest_dbar: self.mixing.largest_dbar.clone(),
            smallest_eigenvalue: self.information.smallest_eigenvalue(),
            steps: self.taken,
        }
    }
}
