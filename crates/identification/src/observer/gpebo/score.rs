//! Sums up an observer's errors over a run: mean squares, and the times at which theta is reached.

use crate::real::{MOST_LANES, Mask, Real};

/// theta counts as reached if its relative error `|theta - theta_hat| / |theta|` is below this.
pub const BAND: f64 = 0.1;

/// Squared errors at one time: of x, the relative one of theta, and of x_1 ... x_n. NaN if a quantity does not exist.
pub type Squares<R> = [R];

/// Positions of the squared errors of x and of theta, and of the first of those of x_1 ... x_n.
const STATE: usize = 0;
pub(super) const THETA: usize = 1;
const STATES: usize = 2;

/// The errors of one observer over one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// `sqrt(mean over the scored time of |x - xhat|^2)`.
    pub rms_state: f64,
    /// The same for the relative error of theta; NaN without an estimate of theta, or if theta = 0.
    pub rms_theta: f64,
    /// The same for x_1 ... x_n.
    pub rms_states: Vec<f64>,
    /// Relative error of theta at the end; NaN without an estimate of theta, or if theta = 0.
    pub theta: f64,
    /// Seconds until the relative error of theta is below [`BAND`] for the first time.
    pub reached: Option<f64>,
    /// Seconds until the relative error of theta is below [`BAND`] for good, i.e. its last entry into the band. `None`
    /// if it is outside at the end.
    pub settled: Option<f64>,
    /// `rms_state`, `rms_theta` and `rms_states` once more, integrated through the middles of the steps as well. The
    /// difference is the error of the formula.
    pub finer: Vec<f64>,
}

impl Accuracy {
    /// Returns whether an error is too large for a number.
    pub fn overflows(&self) -> bool {
        let rms = self.root_means();
        rms.iter().chain([&self.theta]).any(|x| x.is_infinite())
    }

    /// Returns `rms_state`, `rms_theta` and `rms_states`, as [`Self::finer`] has them.
    pub(super) fn root_means(&self) -> Vec<f64> {
        let first = [self.rms_state, self.rms_theta].into_iter();
        first.chain(self.rms_states.iter().copied()).collect()
    }
}

/// The largest number of steps whose nodes are taken together, and of intervals of a Newton-Cotes formula.
const MOST: usize = 4;

/// Accumulates squared errors, one node at a time: at the middle and at the end of every step.
///
/// Errors are smooth between breakpoints, and no breakpoint lies within a base step. The ends of a base step's
/// parts are therefore taken together: by the trapezoidal rule, Simpson's rule (even numbers of
/// parts, order 4) or Boole's rule (multiples of four, order 6). Entries into the band are zeros of the polynomial of
/// degree 1, 2 or 4 through the same nodes. With four parts, their error is that of the estimate itself. The middles
/// serve [`Accuracy::finer`] alone: with them the formula is Simpson's, Boole's, or Boole's twice.
#[derive(Clone, Debug)]
pub struct Score<R> {
    /// The number of steps taken together: 1, 2 or 4.
    together: usize,
    /// Whether entries into the band are wanted.
    entries: bool,
    /// Time at the start of these steps.
    start: R,
    /// Squares at the start of these steps, then at the middle and the end of each, `n + 2` numbers a node.
    nodes: Vec<R>,
    filled: usize,
    /// Integrals over the scored time, `n + 2` numbers.
    integrals: Vec<R>,
    /// The same through the middles too.
    finer: Vec<R>,
    /// The lanes inside the band, as bits.
    inside: u8,
    /// The first and the last entry of each lane; that the last counts, `inside` says.
    reached: [Option<Entry>; MOST_LANES],
    settled: [Option<Entry>; MOST_LANES],
}

/// An entry into the band.
#[derive(Clone, Copy, Debug)]
enum Entry {
    /// At t = 0.
    AtOnce,
    /// Between two nodes; where, is found when it is asked for.
    Between {
        /// Time of the first node, and the length of a step.
        start: f64,
        h: f64,
        /// The number of the node before the entry.
        k: usize,
        /// The squared errors of theta at the ends of the steps taken together.
        theta: [f64; MOST + 1],
    },
}

impl Entry {
    /// Returns the time, given how many steps were taken together.
    fn time(&self, together: usize) -> f64 {
        match self {
            Self::AtOnce => 0.0,
            Self::Between { start, h, k, theta } => start + h * entry(*k, &theta[..=together]),
        }
    }
}

/// Returns where the squared error enters the band between nodes k (outside) and k + 1 (inside), in steps from the
/// first node, by bisection. A NaN is outside.
fn entry(k: usize, theta: &[f64]) -> f64 {
    let (mut outside, mut inside) = (k as f64, (k + 1) as f64);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (outside + inside);
        if theta_at(middle, theta) < BAND * BAND {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// Returns the squared error of theta `s` steps after the first node, on the Lagrange polynomial through the nodes.
fn theta_at(s: f64, theta: &[f64]) -> f64 {
    let nodes = 0..theta.len();
    let term = |i: usize| {
        let others = nodes.clone().filter(|j| *j != i);
        let factor = |j: usize| (s - j as f64) / (i as f64 - j as f64);
        theta[i] * others.map(factor).product::<f64>()
    };
    nodes.clone().map(term).sum()
}

impl<R: Real> Score<R> {
    /// Starts at t = 0, for base steps divided into `refine` parts; with or without entries into the band.
    pub fn new(refine: usize, entries: bool, squares: &Squares<R>) -> Self {
        let together = [MOST, 2, 1].into_iter().find(|count| refine.is_multiple_of(*count));
        let inside = is_inside(squares).bits();
        let at_once = |lane| (inside >> lane & 1 == 1).then_some(Entry::AtOnce);
        let at_once = std::array::from_fn(at_once);
        Self {
            together: together.unwrap_or(1),
            entries,
            start: R::zero(),
            nodes: squares.repeat(2 * MOST + 1),
            filled: 0,
            integrals: vec![R::zero(); squares.len()],
            finer: vec![R::zero(); squares.len()],
            inside,
            reached: at_once,
            settled: at_once,
        }
    }

    /// Adds the node at t, the middle or the end of a step of h seconds. Errors count from the time `from` on, which
    /// no step crosses.
    #[inline(always)]
    pub fn add(&mut self, t: R, h: R, from: R, squares: &Squares<R>) {
        self.filled += 1;
        let width = squares.len();
        self.nodes[self.filled * width..][..width].copy_from_slice(squares);
        if self.filled < 2 * self.together {
            return;
        }
        let counts = from.less(self.start + R::splat(0.5) * h);
        if counts.any() {
            self.integrate(h, counts);
        }
        if self.entries {
            for k in 0..self.together {
                let inside = is_inside(self.node(k + 1)).bits();
                let entering = inside & !self.inside;
                self.inside = inside;
                if entering != 0 {
                    self.note_entry(k, h, entering);
                }
            }
        }
        self.nodes[..width].copy_from_slice(squares);
        (self.start, self.filled) = (t, 0);
    }

    /// Returns the squares at the end of the k-th step; those at the start for k = 0.
    #[inline(always)]
    fn node(&self, k: usize) -> &Squares<R> {
        let width = self.integrals.len();
        &self.nodes[2 * k * width..][..width]
    }

    /// Adds the integrals over the filled nodes, in the lanes that count.
    #[inline(always)]
    fn integrate(&mut self, h: R, counts: R::Mask) {
        let Self {
            nodes,
            integrals,
            finer,
            ..
        } = self;
        newton_cotes(integrals, counts, h, self.together, (nodes, 2));
        let intervals = (2 * self.together).min(MOST);
        let half = h / R::splat(2.0);
        newton_cotes(finer, counts, half, intervals, (nodes, 1));
        if intervals < 2 * self.together {
            let nodes = &nodes[intervals * finer.len()..];
            newton_cotes(finer, counts, half, intervals, (nodes, 1));
        }
    }

    /// Notes that theta enters the band between nodes k and k + 1.
    #[cold]
    #[inline(never)]
    fn note_entry(&mut self, k: usize, h: R, lanes: u8) {
        for lane in R::Mask::from_bits(lanes).lanes() {
            let mut theta = [0.0; MOST + 1];
            for (i, theta) in theta.iter_mut().enumerate().take(self.together + 1) {
                *theta = self.node(i)[THETA].lane(lane);
            }
            let (start, h) = (self.start.lane(lane), h.lane(lane));
            let entry = Some(Entry::Between { start, h, k, theta });
            self.settled[lane] = entry;
            self.reached[lane] = self.reached[lane].or(entry);
        }
    }

    /// Returns the accuracy in a lane, given the scored time in seconds.
    pub fn accuracy(&self, time: f64, lane: usize) -> Accuracy {
        let rms = |integral: &R| (integral.lane(lane) / time).sqrt();
        let inside = self.inside >> lane & 1 == 1;
        let when = |entry: Option<Entry>| entry.map(|entry| entry.time(self.together));
        Accuracy {
            rms_state: rms(&self.integrals[STATE]),
            rms_theta: rms(&self.integrals[THETA]),
            rms_states: self.integrals[STATES..].iter().map(rms).collect(),
            theta: self.node(0)[THETA].lane(lane).sqrt(),
            reached: when(self.reached[lane]),
            settled: when(self.settled[lane].filter(|_| inside)),
            finer: self.finer.iter().map(rms).collect(),
        }
    }
}

/// Adds the integral over the first nodes of those given, of which every so many is one, h apart, by the Newton-Cotes
/// formula of 1, 2 or 4 intervals; in the lanes that count.
#[inline(always)]
fn newton_cotes<R: Real>(integrals: &mut [R], counts: R::Mask, h: R, intervals: usize, (nodes, every): (&[R], usize)) {
    let weights: &[f64] = match intervals {
        1 => &[0.5, 0.5],
        2 => &[1.0 / 3.0, 4.0 / 3.0, 1.0 / 3.0],
        _ => &[14.0 / 45.0, 64.0 / 45.0, 24.0 / 45.0, 64.0 / 45.0, 14.0 / 45.0],
    };
    let width = integrals.len();
    for i in 0..width {
        let mut sum = integrals[i];
        for (k, weight) in weights.iter().enumerate() {
            sum = sum + h * R::splat(*weight) * nodes[every * k * width + i];
        }
        integrals[i] = R::select(counts, sum, integrals[i]);
    }
}

#[inline(always)]
fn is_inside<R: Real>(squares: &Squares<R>) -> R::Mask {
    squares[THETA].less(R::splat(BAND * BAND))
}

/// Writes the squared errors of an estimate, `n + 2` numbers; `theta_hat` is empty if there is none.
#[inline(always)]
pub fn squares<R: Real>(found: &mut Squares<R>, x: &[R], x_hat: &[R], theta: &[f64], theta_hat: &[R]) {
    // The sum of nothing is -0.
    let nothing = R::splat(-0.0);
    let mut relative = R::splat(f64::NAN);
    if !theta_hat.is_empty() {
        let mut size = -0.0;
        let mut error = nothing;
        for i in 0..theta.len().min(theta_hat.len()) {
            size += theta[i] * theta[i];
            let difference = R::splat(theta[i]) - theta_hat[i];
            error = error + difference * difference;
        }
        if size > 0.0 {
            relative = error / R::splat(size);
        }
    }
    let mut sum = nothing;
    for i in 0..x.len() {
        let square = (x[i] - x_hat[i]) * (x[i] - x_hat[i]);
        sum = sum + square;
        found[STATES + i] = square;
    }
    found[STATE] = sum;
    found[THETA] = relative;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scores a squared relative error of theta over [0, 6] with base steps of 1, each divided into `refine` parts.
    /// The squared error of x is twice that of theta.
    fn scored(refine: usize, from: f64, theta: impl Fn(f64) -> f64) -> Accuracy {
        let squares = |t: f64| [2.0 * theta(t), theta(t), f64::NAN, 2.0 * theta(t)];
        let mut score = Score::<f64>::new(refine, true, &squares(0.0));
        let h = 1.0 / refine as f64;
        for k in 1..=12 * refine {
            let t = 0.5 * k as f64 * h;
            score.add(t, h, from, &squares(t));
        }
        score.accuracy(6.0 - from, 0)
    }

    /// The integral of t^d / 100 from 2 to 6 is exact up to the degree of the formula, and not beyond.
    #[test]
    fn formulas_have_their_degrees() {
        for (refine, degree) in [(1, 1), (2, 3), (3, 1), (4, 5), (8, 5)] {
            for d in 0..=degree + 1 {
                let found = scored(refine, 2.0, |t| t.powi(d) / 100.0);
                let exact = (6_f64.powi(d + 1) - 2_f64.powi(d + 1)) / f64::from(d + 1) / 400.0;
                let (x, theta) = (found.rms_state, found.rms_theta);
                let [none, state] = found.rms_states[..] else {
                    panic!("{found:?}")
                };
                let error = (theta * theta / exact - 1.0).abs();
                assert_eq!(error < 1e-14, d <= degree, "{refine} {d} {error}");
                assert!((x * x - 2.0 * theta * theta).abs() < 1e-14 * x * x && none.is_nan());
                assert_eq!(state, x);
            }
        }
    }

    /// `(t - 1)^2 (t - 4)^2 / 100 = 0.01` where `(t - 1) (t - 4) = +-1`. The error enters the band at
    /// `2.5 - sqrt 3.25`, leaves it, and enters again at `2.5 + sqrt 1.25`; it then stays, or is outside at the end.
    /// The polynomial through five nodes is the error itself.
    #[test]
    fn entries_of_a_polynomial() {
        let error = |t: f64| ((t - 1.0) * (t - 4.0)).powi(2) / 100.0;
        let first = 2.5 - 3.25_f64.sqrt();
        let again = 2.5 + 1.25_f64.sqrt();
        let found = scored(4, 0.0, error);
        assert!((found.reached.unwrap() - first).abs() < 1e-14, "{found:?}");
        assert_eq!((found.settled, found.theta), (None, 1.0));
        // The same, except that the error stays inside.
        let staying = |t: f64| if t > 4.0 { 0.0 } else { error(t) };
        let found = scored(4, 0.0, staying);
        assert!((found.settled.unwrap() - again).abs() < 1e-14, "{found:?}");
        assert!((found.reached.unwrap() - first).abs() < 1e-14);
        // With straight lines the entry is found too late.
        let found = scored(1, 0.0, staying);
        assert!((found.settled.unwrap() - again).abs() > 1e-3);
    }

    #[test]
    fn what_never_enters_or_never_leaves() {
        let never = scored(4, 0.0, |t| 1.0 + t);
        assert_eq!((never.reached, never.settled), (None, None));
        let always = scored(4, 0.0, |_| 0.0);
        assert_eq!((always.reached, always.settled), (Some(0.0), Some(0.0)));
        let undefined = scored(4, 0.0, |_| f64::NAN);
        assert_eq!((undefined.reached, undefined.settled), (None, None));
    }

    /// theta = (3, 4) estimated as (3, 3.5): an error of 0.5 relative to 5. It is undefined without an estimate or if
    /// theta is zero.
    #[test]
    fn relative_errors() {
        let mut found = [f64::NAN; 5];
        squares(&mut found, &[1.0, 2.0, 3.0], &[1.5, 0.0, 0.0], &[3.0, 4.0], &[3.0, 3.5]);
        assert_eq!(found, [13.25, 0.01, 0.25, 4.0, 9.0]);
        let relative = |theta: &[f64], theta_hat: &[f64]| {
            let mut found = [0.0; 3];
            squares(&mut found, &[1.0], &[1.0], theta, theta_hat);
            found[THETA]
        };
        assert!(relative(&[1.0], &[]).is_nan() && relative(&[0.0], &[0.5]).is_nan());
    }
}
