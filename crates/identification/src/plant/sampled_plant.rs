//! A plant in continuous time as its samples show it.

use crate::signal::Hold;

/// The largest degree of a denominator in s. Above it the coefficients of the sampled plant mean nothing.
pub const SAMPLED_DEGREE_LIMIT: usize = 40;

/// How a plant `num(s)/den(s) e^(-delay s)` is driven and sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// The sampling time T in seconds.
    pub interval: f64,
    /// The delay in seconds; need not be a multiple of T.
    pub delay: f64,
    /// The course of u(t) between two samples.
    pub hold: Hold,
}

/// Why a plant cannot be sampled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SamplingError(String);

/// The responses of a strictly proper plant to a unit step and to a unit ramp. Time is in units of `1/rate`, so that no
/// coefficient of the denominator is above 1.
struct Responses {
    /// `x' = M x`: n states of the companion form, the input, the input's slope.
    generator: Vec<Vec<f64>>,
    /// The output's coefficient of every state.
    output: Vec<f64>,
    /// The direct term.
    direct: f64,
    /// T in the unit of time.
    interval: f64,
}

impl Sampling {
    /// Returns A(q) and B(q) with `A(q) y(k) = B(q) u(k)` at every sample, both in powers of q^-1 from 0 on.
    ///
    /// A is the characteristic polynomial of `e^(F T)`, F the companion matrix of den. With the response g(t) to a unit
    /// step, sampled pulses are `h_k = g(kT - delay) - g((k-1)T - delay)` with a zero-order hold. With straight lines
    /// between the samples, `h_k = (r((k+1)T - delay) - 2 r(kT - delay) + r((k-1)T - delay)) / T`, r the response to a
    /// unit ramp. `B = A h`. Both responses are entries of one matrix exponential. Plain arithmetic gives the same bits
    /// on every machine.
    ///
    /// Source: K. J. Astrom, B. Wittenmark, *Computer-Controlled Systems*, 3rd ed., sections 2.3 and 2.6; C. Van Loan,
    /// Computing integrals involving the matrix exponential, IEEE Trans. Automatic Control 23 (1978) 395-404.
    ///
    /// # Errors
    /// [`SamplingError`].
    pub fn polynomials(&self, num: &[f64], den: &[f64]) -> Result<[Vec<f64>; 2], SamplingError> {
        let (whole, part) = self.delay_in_samples()?;
        let responses = Responses::new(significant("num", num)?, significant("den", den)?, self.interval)?;
        let n = responses.output.len();
        let a = responses.denominator();
        // Nonzero coefficients of B: a part of a sample gives one more, and straight lines begin one earlier.
        let last = n + whole + usize::from(part > 0.0);
        let first = whole + usize::from(self.hold == Hold::Zero && responses.direct == 0.0);
        let at = |k: usize, shift: f64| (k as f64 + shift - whole as f64 - part) * responses.interval;
        let pulse = |k: usize| match self.hold {
            Hold::Zero => responses.step(at(k, 0.0)) - responses.step(at(k, -1.0)),
            Hold::Linear => {
                let [before, now, after] = [-1.0, 0.0, 1.0].map(|shift| responses.ramp(at(k, shift)));
                (after - 2.0 * now + before) / responses.interval
            }
        };
        let pulses: Vec<f64> = (0..=last).map(pulse).collect();
        let product = |k: usize| a.iter().zip(pulses[..=k].iter().rev()).map(|(a, h)| a * h).sum();
        let b: Vec<f64> = (0..=last).map(|k| if k < first { 0.0 } else { product(k) }).collect();
        if !a.iter().chain(&b).all(|x| x.is_finite()) {
            let what = "the sampled plant has coefficients that are not finite; expected another unit of time or of y";
            return Err(SamplingError(what.to_owned()));
        }
        if b[0] != 0.0 {
            let by = match self.hold {
                Hold::Zero => "num of the degree of den",
                Hold::Linear => "the straight line from u(k-1) to u(k)",
            };
            return Err(SamplingError(format!(
                "y(k) would depend on u(k), by {by}; expected a plant whose first input is u(k-1), such as one with a \
                 delay of a sample"
            )));
        }
        Ok([a, b])
    }

    /// Returns the delay as whole samples and a part of one. A delay that is a multiple of T up to rounding has no
    /// part.
    fn delay_in_samples(&self) -> Result<(usize, f64), SamplingError> {
        let number =
            |what: &str, found: f64, expected: &str| SamplingError(format!("{what}: {found}; expected {expected}"));
        if !(self.interval > 0.0 && self.interval.is_finite()) {
            return Err(number("Ts", self.interval, "a sampling time above 0 in seconds"));
        }
        let samples = self.delay / self.interval;
        if !(0.0..=crate::plant::ORDER_LIMIT as f64).contains(&samples) {
            return Err(number("delay", self.delay, "seconds from 0 to 1000 Ts"));
        }
        let nearest = samples.round();
        if (samples - nearest).abs() <= 8.0 * f64::EPSILON * nearest {
            return Ok((nearest as usize, 0.0));
        }
        Ok((samples.floor() as usize, samples - samples.floor()))
    }
}

/// Returns a polynomial without the zeros at its beginning.
fn significant<'a>(what: &str, given: &'a [f64]) -> Result<&'a [f64], SamplingError> {
    let first = given.iter().position(|x| *x != 0.0);
    match first {
        Some(first) if given.iter().all(|x| x.is_finite()) => Ok(&given[first..]),
        _ => Err(SamplingError(format!(
            "{what}: expected finite coefficients, the highest power of s first, not all of them 0"
        ))),
    }
}

impl Responses {
    fn new(num: &[f64], den: &[f64], interval: f64) -> Result<Self, SamplingError> {
        let n = den.len() - 1;
        if num.len() > den.len() {
            return Err(SamplingError(format!(
                "num has degree {} and den {n} in s; expected at most the degree of den",
                num.len() - 1
            )));
        }
        if n > SAMPLED_DEGREE_LIMIT {
            return Err(SamplingError(format!(
                "den has degree {n} in s; expected at most {SAMPLED_DEGREE_LIMIT}"
            )));
        }
        let a: Vec<f64> = den[1..].iter().map(|a| a / den[0]).collect();
        let direct = if num.len() == den.len() { num[0] / den[0] } else { 0.0 };
        let missing = n.saturating_sub(num.len());
        let strict = &num[num.len().saturating_sub(n)..];
        let strict = std::iter::repeat_n(0.0, missing).chain(strict.iter().map(|c| c / den[0]));
        let strict: Vec<f64> = strict.zip(&a).map(|(c, a)| c - direct * a).collect();
        // A power of two, so that scaling is exact.
        let power = |rate: f64, i: usize| rate.powi(i as i32 + 1);
        let fits = |rate: f64| (0..n).all(|i| a[i].abs() <= power(rate, i));
        let mut rate = 1.0;
        while !fits(rate) && rate < f64::MAX / 2.0 {
            rate *= 2.0;
        }
        while a.iter().any(|a| *a != 0.0) && fits(rate / 2.0) && rate > f64::MIN_POSITIVE {
            rate /= 2.0;
        }
        let mut generator = vec![vec![0.0; n + 2]; n + 2];
        for i in 0..n {
            // The state after the last one is the input.
            generator[i][i + 1] = 1.0;
            generator[n - 1][n - 1 - i] = -a[i] / power(rate, i);
        }
        generator[n][n + 1] = 1.0;
        let output = (0..n).rev().map(|i| strict[i] / power(rate, i)).collect();
        Ok(Self {
            generator,
            output,
            direct,
            interval: interval * rate,
        })
    }

    /// Returns the response to a unit step at time 0.
    fn step(&self, time: f64) -> f64 {
        let n = self.output.len();
        if time < 0.0 {
            0.0
        } else {
            self.at(time, n) + self.direct
        }
    }

    /// Returns the response to a unit ramp from time 0 on.
    fn ramp(&self, time: f64) -> f64 {
        let n = self.output.len();
        if time <= 0.0 {
            0.0
        } else {
            self.at(time, n + 1) + self.direct * time
        }
    }

    /// Returns the output of the states that a column of the exponential has.
    fn at(&self, time: f64, column: usize) -> f64 {
        let states = exponential(&self.generator, time);
        let terms = self.output.iter().zip(&states);
        terms.map(|(c, row)| c * row[column]).sum()
    }

    /// Returns the characteristic polynomial of `e^(F T)` by Faddeev's and Leverrier's recursion, the highest power
    /// first.
    fn denominator(&self) -> Vec<f64> {
        let n = self.output.len();
        let mut transition = exponential(&self.generator, self.interval);
        transition.truncate(n);
        for row in &mut transition {
            row.truncate(n);
        }
        let mut coefficients = vec![1.0];
        let mut product = vec![vec![0.0; n]; n];
        for k in 1..=n {
            for (i, row) in product.iter_mut().enumerate() {
                row[i] += coefficients[k - 1];
            }
            product = times(&transition, &product);
            let trace: f64 = (0..n).map(|i| product[i][i]).sum();
            coefficients.push(-trace / k as f64);
        }
        coefficients
    }
}

fn times(left: &[Vec<f64>], right: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let entry = |row: &[f64], j: usize| row.iter().zip(right).map(|(x, other)| x * other[j]).sum();
    let columns = right.first().map_or(0, Vec::len);
    let row = |row: &Vec<f64>| (0..columns).map(|j| entry(row, j)).collect();
    left.iter().map(row).collect()
}

/// Returns `e^(M t)` by scaling, the Taylor polynomial of degree 18 at a norm of at most 1/2, and squaring. The
/// remainder is below `2^-19 / 19!`, 2e-23. Entries of small matrices keep their own relative accuracy, which faer's
/// products do not have to on every machine.
fn exponential(m: &[Vec<f64>], t: f64) -> Vec<Vec<f64>> {
    const DEGREE: u32 = 18;
    let rows = m.iter().map(|row| row.iter().map(|x| (x * t).abs()).sum::<f64>());
    let (mut norm, mut squarings) = (rows.fold(0.0, f64::max), 0);
    while norm > 0.5 && norm.is_finite() {
        (norm, squarings) = (norm / 2.0, squarings + 1);
    }
    let scale = t * 0.5_f64.powi(squarings);
    let scaled: Vec<Vec<f64>> = m.iter().map(|row| row.iter().map(|x| x * scale).collect()).collect();
    let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
    let mut result: Vec<Vec<f64>> = (0..m.len())
        .map(|i| (0..m.len()).map(|j| identity(i, j)).collect())
        .collect();
    // Horner's scheme.
    for degree in (1..=DEGREE).rev() {
        result = times(&scaled, &result);
        for (i, row) in result.iter_mut().enumerate() {
            for x in row.iter_mut() {
                *x /= f64::from(degree);
            }
            row[i] += 1.0;
        }
    }
    for _ in 0..squarings {
        result = times(&result, &result);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(num: &[f64], den: &[f64], interval: f64, delay: f64, hold: Hold) -> [Vec<f64>; 2] {
        Sampling { interval, delay, hold }.polynomials(num, den).unwrap()
    }

    fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        let scale = expected.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() <= tolerance * scale, "{found:?} {expected:?}");
        }
    }

    /// `scipy.signal.cont2discrete((num, den), T, "zoh")`, which leaves rounding errors of some 1e-15 of A in B.
    #[test]
    fn zero_order_hold_as_in_scipy() {
        let resonant = [-1.5881390788285354, 0.8187307530779823];
        type Case<'a> = (&'a [f64], &'a [f64], f64, &'a [f64], &'a [f64]);
        let cases: [Case<'_>; 5] = [
            (
                &[104.0],
                &[1.0, 4.0, 104.0],
                0.05,
                &[0.1191700272875067, 0.11142164696194001],
                &resonant,
            ),
            (
                &[2.0, 1.0],
                &[1.0, 3.0, 3.0, 1.0],
                0.3,
                &[0.07027313304444505, -0.005764508449107142, -0.0470980380990112],
                &[-2.2224546620451555, 1.6464349082820826, -0.4065696597406004],
            ),
            (&[1.0], &[1.0, 0.0], 0.25, &[0.25], &[-1.0]),
            (
                &[0.0, 5e6],
                &[1.0, 3e3, 4e6],
                1e-3,
                &[0.8749703309528547, 0.3003794332484141],
                &[-0.10950725700684921, 0.04978706836786401],
            ),
            (
                &[1.0],
                &[1.0, 2.0, 0.0],
                0.1,
                &[0.004682688269495472, 0.004380774076605309],
                &[-1.8187307530779817, 0.8187307530779818],
            ),
        ];
        for (num, den, interval, b, a) in cases {
            let found = sampled(num, den, interval, 0.0, Hold::Zero);
            assert_close(&found[0], &[&[1.0], a].concat(), 4e-15);
            assert_close(&found[1], &[&[0.0], b].concat(), 1e-13);
        }
    }

    /// By hand: `1/(s + 1)^n` after T has `A = (1 - e^-T q^-1)^n` and static gain 1. The gain has A's rounding errors
    /// over A(1).
    #[test]
    fn a_pole_of_high_multiplicity() {
        let binomial = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];
        let [a, b] = sampled(&[1.0], &binomial, 0.5, 0.0, Hold::Zero);
        let decay = (-0.5_f64).exp();
        let expected: Vec<f64> = (0..7).map(|i| binomial[i] * (-decay).powi(i as i32)).collect();
        assert_close(&a, &expected, 1e-14);
        let at_one = |x: &[f64]| x.iter().sum::<f64>();
        let bound = 7.0 * 20.0 * f64::EPSILON / (1.0 - decay).powi(6);
        assert!((at_one(&b) / at_one(&a) - 1.0).abs() < bound, "{bound:e}");
    }

    /// A delay of 0.4 samples: `scipy.linalg.expm` for both parts of a period, then `scipy.signal.ss2tf`. Straight
    /// lines:
    /// `scipy.signal.lsim` of a triangle on a grid of 0.01 s, and `cont2discrete(..., "foh")` after a whole sample.
    #[test]
    fn delays_and_straight_lines() {
        let (num, den) = ([104.0], [1.0, 4.0, 104.0]);
        let of = |delay: f64, hold: Hold| sampled(&num, &den, 0.05, delay, hold)[1].clone();
        let plain = of(0.0, Hold::Zero);
        let later = of(0.15, Hold::Zero);
        assert_eq!(later[..4], [0.0; 4]);
        assert_close(&later[3..], &plain, 1e-15);
        let part = of(0.02, Hold::Zero);
        assert_close(
            &part,
            &[0.0, 0.04463588698438303, 0.1685237140088487, 0.01743207325621502],
            1e-13,
        );
        let lines = of(0.05, Hold::Linear);
        let foh = [0.0, 0.04072641525812637, 0.15302987969409876, 0.03683537929722169];
        assert_close(&lines, &foh, 1e-13);
        let lines = of(0.07, Hold::Linear);
        assert_close(
            &lines,
            &[
                0.0,
                0.009043803137431253,
                0.1264703499968987,
                0.09276560535392894,
                0.0023119157611879437,
            ],
            1e-12,
        );
    }

    #[test]
    fn refusals() {
        let of = |num: &[f64], den: &[f64], interval, delay, hold| {
            let found = Sampling { interval, delay, hold }.polynomials(num, den);
            found.unwrap_err().to_string()
        };
        let zero = Hold::Zero;
        let one = [1.0, 1.0];
        for (found, part) in [
            (
                of(&[1.0], &one, 0.0, 0.0, zero),
                "Ts: 0; expected a sampling time above 0",
            ),
            (
                of(&[1.0], &one, 0.1, -0.1, zero),
                "delay: -0.1; expected seconds from 0",
            ),
            (of(&[1.0], &[0.0], 0.1, 0.0, zero), "den: expected finite coefficients"),
            (
                of(&[f64::NAN], &one, 0.1, 0.0, zero),
                "num: expected finite coefficients",
            ),
            (of(&[1.0, 0.0, 0.0], &one, 0.1, 0.0, zero), "num has degree 2 and den 1"),
            (of(&one, &one, 0.1, 0.0, zero), "y(k) would depend on u(k), by num"),
            (of(&[1.0], &one, 0.1, 0.05, Hold::Linear), "by the straight line"),
            (of(&[1.0], &[1.0; 42], 0.1, 0.0, zero), "den has degree 41"),
            (of(&[1.0], &[1.0, -1e5], 1.0, 0.0, zero), "not finite"),
        ] {
            assert!(found.contains(part), "{found}");
        }
        // With a delay the direct term is one more coefficient.
        let [a, b] = sampled(&[1.0, 3.0, 5.0], &[1.0, 2.0, 10.0], 0.1, 0.2, zero);
        assert_close(&b[2..], &[1.0, -1.6629374328774782, 0.7078786072405172], 1e-13);
        assert_eq!((a.len(), &b[..2]), (3, &[0.0; 2][..]));
    }
}
