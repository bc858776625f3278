//! Errors of estimates in lock step: parameters, initial state, and stage 12's observer compared with the true plant.

use super::passes::PassPack;
use super::record::Record;
use super::{order, splat};
use asobench_identification::data::Truth;
use asobench_identification::metric::{relative_error, relative_error_as_printed};
use asobench_identification::observer::Gain;
use asobench_identification::plant::inlined::{observe, observe_step, simulate};
use asobench_identification::real::{MOST_LANES, Real};
use std::ops::Range;

/// Errors of one output, NaN where undefined.
#[derive(Clone, Copy)]
pub struct Errors<R> {
    /// The relative errors of a, b, h and x0.
    pub relative: [R; 4],
    /// The same errors by the formula as printed.
    pub as_printed: [R; 4],
    /// Maximum and root mean square of e_x(k) for k >= N.
    pub state: [R; 2],
    /// The same by the formula as printed.
    pub state_as_printed: [R; 2],
    /// Root mean square of `|x(k) - xhat(k)|` for k >= N.
    pub state_absolute: R,
}

impl<T: Copy> Errors<T> {
    /// The same for every error.
    pub(crate) fn all(value: T) -> Self {
        Self {
            relative: [value; 4],
            as_printed: [value; 4],
            state: [value; 2],
            state_as_printed: [value; 2],
            state_absolute: value,
        }
    }
}

impl<R: Real> Errors<R> {
    /// Nothing scored yet.
    pub fn unknown() -> Self {
        Self::all(R::splat(f64::NAN))
    }

    /// Stores the errors of each lane.
    #[inline(always)]
    pub fn store(self, to: &mut Errors<[f64; MOST_LANES]>) {
        let groups = [
            (&self.relative[..], &mut to.relative[..]),
            (&self.as_printed, &mut to.as_printed),
            (&self.state, &mut to.state),
            (&self.state_as_printed, &mut to.state_as_printed),
        ];
        for (errors, to) in groups {
            errors.iter().zip(to).for_each(|(error, to)| error.store(to));
        }
        self.state_absolute.store(&mut to.state_absolute);
    }
}

/// The errors to compute besides the relative ones.
#[derive(Clone, Copy)]
pub struct Wanted {
    /// The errors of the state by the formula as printed.
    pub states_as_printed: bool,
    /// The error of the state in the units of the state.
    pub states_absolute: bool,
    /// e_x(k) for every k.
    pub curves: bool,
}

/// The maximum and sum of a sequence of squares.
#[derive(Clone, Copy)]
struct Gathered<R> {
    maximum: R,
    sum: R,
}

impl<R: Real> Gathered<R> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            maximum: R::zero(),
            sum: R::zero(),
        }
    }

    #[inline(always)]
    fn add(&mut self, square: R) {
        self.maximum = R::select(self.maximum.less(square), square, self.maximum);
        self.sum = self.sum + square;
    }

    /// Returns the maximum and root mean square of `count` numbers; NaN if there are none or if `defined` is not set.
    #[inline(always)]
    fn finish(self, count: R, defined: R::Mask) -> [R; 2] {
        let undefined = R::splat(f64::NAN);
        let any = R::zero().less(count) & defined;
        let [maximum, rms] = [self.maximum.sqrt(), (self.sum / count).sqrt()];
        [R::select(any, maximum, undefined), R::select(any, rms, undefined)]
    }
}

/// Returns `|x - x_hat|^2`.
#[inline(always)]
fn distance<R: Real>(x: &[R], x_hat: &[R]) -> R {
    let mut distance = R::zero();
    for i in 0..x.len() {
        let difference = x[i] - x_hat[i];
        distance = difference.mul_add(difference, distance);
    }
    distance
}

/// Number of samples that are simulated, and then observed by every output while they are in the first cache.
const CHUNK: usize = 32;

/// A piece of the true trajectory.
struct Chunk<R> {
    /// The measured output.
    y: [R; CHUNK],
    /// The states, n for each k.
    states: Vec<R>,
    /// `1 / |x(k)|^2`, or 0 if x(k) = 0.
    sizes: [R; CHUNK],
    /// 1 over the sum of x(k), or 0 if that sum is not positive.
    sums: [R; CHUNK],
}

/// The observer of one output.
#[derive(Clone)]
pub struct PackedObserver<R: Real, const N: usize> {
    g: [R; N],
    x: [R; N],
    relative: Gathered<R>,
    as_printed: Gathered<R>,
    /// The sum of `|x(k) - xhat(k)|^2` for k >= N.
    absolute: R,
    /// e_x(k)^2, if wanted.
    pub curve: Vec<R>,
}

impl<R: Real, const N: usize> PackedObserver<R, N> {
    /// Makes an observer with room for `samples` errors e_x(k): all, or 0 if they are not wanted.
    pub fn new(samples: usize) -> Self {
        let zero = [R::zero(); N];
        Self {
            g: zero,
            x: zero,
            relative: Gathered::new(),
            as_printed: Gathered::new(),
            absolute: R::zero(),
            curve: vec![R::zero(); samples],
        }
    }

    #[inline(always)]
    fn gathering(&self, wanted: Wanted, counts: bool) -> Gathering<R> {
        Gathering {
            relative: self.relative,
            as_printed: self.as_printed,
            absolute: self.absolute,
            wanted,
            counts,
        }
    }

    #[inline(always)]
    fn keep(&mut self, gathering: &Gathering<R>) {
        self.relative = gathering.relative;
        self.as_printed = gathering.as_printed;
        self.absolute = gathering.absolute;
    }
}

/// The errors gathered for an observer. During a chunk these are separate variables, so that they stay in registers.
struct Gathering<R> {
    relative: Gathered<R>,
    as_printed: Gathered<R>,
    absolute: R,
    wanted: Wanted,
    /// Whether k has reached N, from which errors count.
    counts: bool,
}

impl<R: Real> Gathering<R> {
    /// Adds the error at x(k), given the reciprocals of the state's size and sum, and stores e_x(k)^2 if it is kept.
    #[inline(always)]
    fn add(&mut self, x: &[R], x_hat: &[R], size: R, sum: R, curve: Option<&mut R>) {
        let distance = distance(x, x_hat);
        let square = distance * size;
        if self.counts {
            self.relative.add(square);
            if self.wanted.states_as_printed {
                self.as_printed.add(distance * sum);
            }
            if self.wanted.states_absolute {
                self.absolute = self.absolute + distance;
            }
        }
        if let Some(curve) = curve {
            // Undefined if x(k) = 0.
            let defined = R::zero().less(size);
            *curve = R::select(defined, square, R::splat(f64::NAN));
        }
    }
}

/// The measures of one cell, with buffers.
pub struct PackedScorer<R, const N: usize> {
    n: usize,
    window: usize,
    horizon: usize,
    gain: Gain,
    /// a, b, h and x0.
    truth: [[R; N]; 4],
    wanted: Wanted,
    chunk: Chunk<R>,
    /// The true state at the start of the next chunk.
    x: [R; N],
    /// The number of k >= N with `|x(k)| > 0`.
    size_count: R,
    /// The number of k >= N with a positive sum of x(k).
    sum_count: R,
}

impl<R: Real, const N: usize> PackedScorer<R, N> {
    /// Makes a scorer of estimates against this truth.
    pub fn new(window: usize, horizon: usize, gain: Gain, truth: &Truth, wanted: Wanted) -> Self {
        let n = truth.a.len();
        let zeros = [R::zero(); CHUNK];
        Self {
            n,
            window,
            horizon,
            gain,
            truth: [&truth.a, &truth.b, &truth.h, &truth.x0].map(|numbers| splat(numbers)),
            wanted,
            chunk: Chunk {
                y: zeros,
                states: vec![R::zero(); n * CHUNK],
                sizes: zeros,
                sums: zeros,
            },
            x: [R::zero(); N],
            size_count: R::zero(),
            sum_count: R::zero(),
        }
    }

    /// Computes the errors of a pass's parameters and initial state.
    pub fn parameters(&self, pass: &PassPack<R, N>, errors: &mut Errors<R>) {
        let truth = &self.truth;
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(self.n);
                let undefined = R::splat(f64::NAN);
                let parts = [
                    (&pass.a, pass.parameters),
                    (&pass.b, pass.parameters),
                    (&pass.h, pass.parameters),
                    (&pass.x0, pass.state),
                ];
                for i in 0..4 {
                    let (found, known) = parts[i];
                    let (truth, found) = (&truth[i][..n], &found[..n]);
                    let error = relative_error(truth, found);
                    errors.relative[i] = R::select(known, error, undefined);
                    let error = relative_error_as_printed(truth, found);
                    errors.as_printed[i] = R::select(known, error, undefined);
                }
            },
        );
    }

    /// Makes the observer of stage 12 from a pass, starting at `x0`. If e_x(k) is not wanted before k = N, it runs
    /// through the window immediately.
    pub fn start(
        &self,
        pass: &PassPack<R, N>,
        x0: &[R; N],
        record: &Record<R, N>,
        observer: &mut PackedObserver<R, N>,
    ) {
        let gain = &self.gain;
        observer.x = *x0;
        observer.relative = Gathered::new();
        observer.as_printed = Gathered::new();
        observer.absolute = R::zero();
        let PackedObserver { g, x, .. } = observer;
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(self.n);
                let (a, b) = (&pass.a[..n], &pass.b[..n]);
                // A variable that changes from k to k + 1 is a local copy, so that it stays in registers.
                let (mut of_g, mut of_x) = (*g, *x);
                gain.compute(a, &mut of_g[..n]);
                if !self.wanted.curves {
                    observe(
                        a,
                        b,
                        &of_g[..n],
                        &mut of_x[..n],
                        &record.u[..self.window],
                        &record.y,
                        #[inline(always)]
                        |_, _| (),
                    );
                }
                (*g, *x) = (of_g, of_x);
            },
        );
    }

    /// Prepares the comparison of observers; returns its first k.
    pub fn begin(&mut self, record: &Record<R, N>) -> usize {
        self.size_count = R::zero();
        self.sum_count = R::zero();
        if self.wanted.curves {
            self.x = record.x0;
            0
        } else {
            self.x = record.x_window;
            self.window
        }
    }

    /// Whether the first output's observer runs together with the true plant. Each recursion waits for its own last
    /// result, so the two can share the time, but 16 registers cannot hold both.
    pub const BESIDE: bool = R::REGISTERS >= 32;

    /// Simulates the true plant for some k, up to the end of a chunk at most, together with the first output's observer
    /// if [`Self::BESIDE`]. Keeps what [`Self::observe`] needs if `KEEP`.
    pub fn advance<const KEEP: bool>(
        &mut self,
        record: &Record<R, N>,
        from: usize,
        pass: &PassPack<R, N>,
        observer: &mut PackedObserver<R, N>,
    ) -> Range<usize> {
        let mut to = self.horizon.min(from + CHUNK);
        if from < self.window {
            to = to.min(self.window);
        }
        let (u, f) = (&record.u[from..to], &record.noise()[from..to]);
        let (wanted, gather) = (self.wanted, from >= self.window);
        let (printed, count) = (wanted.states_as_printed, to - from);
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(self.n);
                let (zero, one) = (R::zero(), R::splat(1.0));
                let (mut size_count, mut sum_count) = (zero, zero);
                let (mut x, mut of_x) = (self.x, observer.x);
                let (scale, f) = (record.scale, &f[..count]);
                let chunk = &mut self.chunk;
                let (y, sizes) = (&mut chunk.y[..count], &mut chunk.sizes[..count]);
                let (sums, states) = (&mut chunk.sums[..count], &mut chunk.states[..n * count]);
                let (a, b, g) = (&pass.a[..n], &pass.b[..n], &observer.g[..n]);
                let x_hat = &mut of_x[..n];
                let mut gathering = observer.gathering(wanted, gather);
                let curve = &mut observer.curve[..];
                simulate(
                    &record.a[..n],
                    &record.b[..n],
                    &mut x[..n],
                    u,
                    #[inline(always)]
                    |k, x| {
                        let of_y = scale.mul_add(f[k], x[0]);
                        let mut size = zero;
                        for i in 0..n {
                            size = x[i].mul_add(x[i], size);
                        }
                        let defined = zero.less(size);
                        let size = R::select(defined, one / size, zero);
                        size_count = size_count + R::select(defined, one, zero);
                        let mut sum = zero;
                        if printed {
                            for i in 0..n {
                                sum = sum + x[i];
                            }
                            let defined = zero.less(sum);
                            sum = R::select(defined, one / sum, zero);
                            sum_count = sum_count + R::select(defined, one, zero);
                        }
                        if KEEP {
                            (y[k], sizes[k]) = (of_y, size);
                            if printed {
                                sums[k] = sum;
                            }
                            let to = &mut states[n * k..n * (k + 1)];
                            for (to, x) in to.iter_mut().zip(x) {
                                *to = *x;
                            }
                        }
                        if Self::BESIDE {
                            gathering.add(x, x_hat, size, sum, curve.get_mut(from + k));
                            observe_step(a, b, g, x_hat, u[k], of_y);
                        }
                    },
                );
                self.x = x;
                if gather {
                    self.size_count = self.size_count + size_count;
                    self.sum_count = self.sum_count + sum_count;
                }
                if Self::BESIDE {
                    observer.x = of_x;
                    observer.keep(&gathering);
                }
            },
        );
        from..to
    }

    /// Runs an observer through the chunk kept by [`Self::advance`].
    pub fn observe(
        &self,
        pass: &PassPack<R, N>,
        record: &Record<R, N>,
        k: Range<usize>,
        observer: &mut PackedObserver<R, N>,
    ) {
        let (from, count) = (k.start, k.len());
        let (u, chunk) = (&record.u[k], &self.chunk);
        let (wanted, gather) = (self.wanted, from >= self.window);
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(self.n);
                let (of_g, mut of_x) = (observer.g, observer.x);
                let states = &chunk.states[..n * count];
                let (sizes, sums) = (&chunk.sizes[..count], &chunk.sums[..count]);
                let mut gathering = observer.gathering(wanted, gather);
                let curve = &mut observer.curve[..];
                observe(
                    &pass.a[..n],
                    &pass.b[..n],
                    &of_g[..n],
                    &mut of_x[..n],
                    u,
                    &chunk.y[..count],
                    #[inline(always)]
                    |k, x_hat| {
                        let x = &states[n * k..n * (k + 1)];
                        gathering.add(x, x_hat, sizes[k], sums[k], curve.get_mut(from + k));
                    },
                );
                observer.x = of_x;
                observer.keep(&gathering);
            },
        );
    }

    /// Computes the errors of an observer at the horizon; returns the lanes in which the observer and its errors are
    /// finite.
    pub fn finish(&self, pass: &PassPack<R, N>, observer: &PackedObserver<R, N>, errors: &mut Errors<R>) -> R::Mask {
        R::run(
            #[inline(always)]
            || {
                let mut check = R::zero();
                for i in 0..order::<N>(self.n) {
                    check = observer.x[i].mul_add(R::zero(), check);
                    check = observer.g[i].mul_add(R::zero(), check);
                }
                let known = pass.state & check.is_finite();
                errors.state = observer.relative.finish(self.size_count, known);
                if self.wanted.states_as_printed {
                    errors.state_as_printed = observer.as_printed.finish(self.sum_count, known);
                }
                if self.wanted.states_absolute {
                    let count = R::splat((self.horizon - self.window) as f64);
                    let rms = (observer.absolute / count).sqrt();
                    let any = R::zero().less(count) & known;
                    errors.state_absolute = R::select(any, rms, R::splat(f64::NAN));
                }
                // Squares overflow before the state does.
                let infinite = R::splat(f64::INFINITY);
                let Errors {
                    state: [maximum, rms],
                    state_as_printed: [maximum_printed, rms_printed],
                    state_absolute,
                    ..
                } = errors;
                let all = [maximum, rms, maximum_printed, rms_printed, state_absolute];
                let mut finite = check.is_finite();
                for i in 0..all.len() {
                    finite = finite & !infinite.at_most(*all[i]);
                }
                for measure in all {
                    *measure = R::select(finite, *measure, R::splat(f64::NAN));
                }
                finite
            },
        )
    }
}
