//! Sums up an observer's errors over a run: mean squares, and the times at which theta is reached.

/// theta counts as reached if its relative error `|theta - theta_hat| / |theta|` is below this.
pub const BAND: f64 = 0.1;

/// Squared errors at one time: of x, of x_1, of x_2, and the relative one of theta. NaN if a quantity does not exist.
pub type Squares = [f64; 4];

/// The errors of one observer over one run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// `sqrt(mean over the scored time of |x - xhat|^2)`, then the same for x_1, x_2 and the relative error of theta.
    /// NaN if a quantity does not exist.
    pub rms: [f64; 4],
    /// Relative error of theta at the end; NaN without an estimate of theta, or if theta = 0.
    pub theta: f64,
    /// Seconds until the relative error of theta is below [`BAND`] for the first time.
    pub reached: Option<f64>,
    /// Seconds until the relative error of theta is below [`BAND`] for good, i.e. its last entry into the band. `None`
    /// if it is outside at the end.
    pub settled: Option<f64>,
}

impl Accuracy {
    /// Returns whether an error is too large for a number.
    pub fn overflows(&self) -> bool {
        self.rms
            .iter()
            .chain([&self.theta])
            .any(|error| error.is_infinite())
    }
}

/// The largest number of steps whose nodes are taken together.
const MOST: usize = 4;

/// Accumulates squared errors, one node at a time.
///
/// Errors are smooth between breakpoints, and no breakpoint lies within a base step. The nodes of a base step, one
/// after each of its parts, are therefore taken together: by the trapezoidal rule, Simpson's rule (even numbers of
/// parts, order 4) or Boole's rule (multiples of four, order 6). Entries into the band are zeros of the polynomial of
/// degree 1, 2 or 4 through the same nodes. With four parts, their error is that of the estimate itself.
#[derive(Clone, Debug)]
pub struct Score {
    /// The number of steps taken together: 1, 2 or 4.
    together: usize,
    /// Time and squares at the start of these steps, then squares after each.
    start: f64,
    nodes: [Squares; MOST + 1],
    filled: usize,
    /// Integrals over the scored time.
    integrals: Squares,
    reached: Option<f64>,
    settled: Option<f64>,
}

impl Score {
    /// Starts at t = 0, for base steps divided into `refine` parts.
    pub fn new(refine: usize, squares: Squares) -> Self {
        let together = [MOST, 2, 1]
            .into_iter()
            .find(|count| refine.is_multiple_of(*count));
        let at_once = is_inside(&squares).then_some(0.0);
        Self {
            together: together.unwrap_or(1),
            start: 0.0,
            nodes: [squares; MOST + 1],
            filled: 0,
            integrals: [0.0; 4],
            reached: at_once,
            settled: at_once,
        }
    }

    /// Adds the node at t, h seconds after the previous one. Errors count from the time `from` on, which no step
    /// crosses.
    #[inline]
    pub fn add(&mut self, t: f64, h: f64, from: f64, squares: Squares) {
        self.filled += 1;
        self.nodes[self.filled] = squares;
        if self.filled < self.together {
            return;
        }
        if self.start + 0.5 * h > from {
            self.integrate(h);
        }
        for k in 0..self.together {
            self.note_entry(k, h);
        }
        (self.start, self.nodes[0], self.filled) = (t, squares, 0);
    }

    /// Adds the integral over the filled nodes by the Newton-Cotes formula of 2, 3 or 5 nodes.
    fn integrate(&mut self, h: f64) {
        let weights: &[f64] = match self.together {
            1 => &[0.5, 0.5],
            2 => &[1.0 / 3.0, 4.0 / 3.0, 1.0 / 3.0],
            _ => &[
                14.0 / 45.0,
                64.0 / 45.0,
                24.0 / 45.0,
                64.0 / 45.0,
                14.0 / 45.0,
            ],
        };
        for (weight, squares) in weights.iter().zip(&self.nodes) {
            for (integral, square) in self.integrals.iter_mut().zip(squares) {
                *integral += h * weight * square;
            }
        }
    }

    /// Notes whether theta enters or leaves the band between nodes k and k + 1.
    #[inline]
    fn note_entry(&mut self, k: usize, h: f64) {
        if !is_inside(&self.nodes[k + 1]) {
            self.settled = None;
        } else if self.settled.is_none() {
            let entry = self.start + h * self.entry(k);
            self.settled = Some(entry);
            self.reached = self.reached.or(Some(entry));
        }
    }

    /// Returns where the squared error enters the band between nodes k (outside) and k + 1 (inside), in steps from the
    /// first node, by bisection. A NaN is outside.
    fn entry(&self, k: usize) -> f64 {
        let (mut outside, mut inside) = (k as f64, (k + 1) as f64);
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (outside + inside);
            if self.theta_at(middle) < BAND * BAND {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }

    /// Returns the squared error of theta `s` steps after the first node, on the Lagrange polynomial through the nodes.
    fn theta_at(&self, s: f64) -> f64 {
        let nodes = &self.nodes[..=self.together];
        let term = |(i, squares): (usize, &Squares)| {
            let others = (0..nodes.len()).filter(|j| *j != i);
            let factor = |j: usize| (s - j as f64) / (i as f64 - j as f64);
            squares[3] * others.map(factor).product::<f64>()
        };
        nodes.iter().enumerate().map(term).sum()
    }

    /// Returns the accuracy, given the scored time in seconds.
    pub fn accuracy(&self, time: f64) -> Accuracy {
        Accuracy {
            rms: self.integrals.map(|integral| (integral / time).sqrt()),
            theta: self.nodes[self.filled][3].sqrt(),
            reached: self.reached,
            settled: self.settled,
        }
    }
}

fn is_inside(squares: &Squares) -> bool {
    squares[3] < BAND * BAND
}

/// Returns the squared errors of an estimate; `theta_hat` is empty if there is none.
pub fn squares(x: &[f64], x_hat: &[f64], theta: &[f64], theta_hat: &[f64]) -> Squares {
    let square = |(a, b): (&f64, &f64)| (a - b) * (a - b);
    let of_state = |i: usize| x.get(i).zip(x_hat.get(i)).map_or(f64::NAN, square);
    let relative = if theta_hat.is_empty() {
        f64::NAN
    } else {
        let size: f64 = theta.iter().map(|theta| theta * theta).sum();
        let error: f64 = theta.iter().zip(theta_hat).map(square).sum();
        if size > 0.0 { error / size } else { f64::NAN }
    };
    let all = x.iter().zip(x_hat).map(square).sum();
    [all, of_state(0), of_state(1), relative]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scores a squared relative error of theta over [0, 6] with base steps of 1, each divided into `refine` parts. The
    /// squared error of x is twice that of theta.
    fn scored(refine: usize, from: f64, theta: impl Fn(f64) -> f64) -> Accuracy {
        let squares = |t: f64| [2.0 * theta(t), 2.0 * theta(t), f64::NAN, theta(t)];
        let mut score = Score::new(refine, squares(0.0));
        let h = 1.0 / refine as f64;
        for k in 1..=6 * refine {
            let t = k as f64 * h;
            score.add(t, h, from, squares(t));
        }
        score.accuracy(6.0 - from)
    }

    /// The integral of t^d / 100 from 2 to 6 is exact up to the degree of the formula, and not beyond.
    #[test]
    fn formulas_have_their_degrees() {
        for (refine, degree) in [(1, 1), (2, 3), (3, 1), (4, 5), (8, 5)] {
            for d in 0..=degree + 1 {
                let found = scored(refine, 2.0, |t| t.powi(d) / 100.0);
                let exact = (6_f64.powi(d + 1) - 2_f64.powi(d + 1)) / f64::from(d + 1) / 400.0;
                let [x, _, none, theta] = found.rms;
                let error = (theta * theta / exact - 1.0).abs();
                assert_eq!(error < 1e-14, d <= degree, "{refine} {d} {error}");
                assert!((x * x - 2.0 * theta * theta).abs() < 1e-14 * x * x && none.is_nan());
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
        let found = squares(&[1.0, 2.0], &[1.5, 0.0], &[3.0, 4.0], &[3.0, 3.5]);
        assert_eq!(found, [4.25, 0.25, 4.0, 0.01]);
        assert!(
            squares(&[1.0], &[1.0], &[1.0], &[])[2..]
                .iter()
                .all(|x| x.is_nan())
        );
        assert!(squares(&[1.0], &[1.0], &[0.0], &[0.5])[3].is_nan());
    }
}
