//! One period of the periodic inputs that people identify with: pseudo-random binary sequences, multisines, steps.
//!
//! Each is a list of samples for [`super::Input::Samples`], which repeats it, of root mean square 1 but for steps.

use super::normal::turn;

/// The lengths of registers for which [`prbs`] has feedback taps.
pub const REGISTERS: std::ops::RangeInclusive<usize> = 2..=18;

/// Taps of shift registers whose sequences have the longest period `2^n - 1`, for n from 2 on: the exponents of a
/// primitive polynomial, of which the first is n (P. Alfke, *Efficient Shift Registers, LFSR Counters, and Long
/// Pseudo-Random Sequence Generators*, Xilinx XAPP052, 1996, table 3).
const TAPS: [&[usize]; 17] = [
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
];

/// Returns one period of a pseudo-random binary sequence of longest period: `(2^register - 1) clock` samples of +1 and
/// -1, each held for `clock` samples. The register starts with ones. `None` if [`REGISTERS`] has no such register or
/// `clock` is 0.
///
/// With `clock = 1` the mean over a period of P samples is `1/P` in size, and the correlation `sum u(k) u(k + i) / P`
/// is
/// 1 for `i = 0` and `-1/P` for all other i below P.
pub fn prbs(register: usize, clock: usize) -> Option<Vec<f64>> {
    let taps = TAPS.get(register.checked_sub(2)?).filter(|_| clock > 0)?;
    let ones = (1_u32 << register) - 1;
    let mut bits = ones;
    let mut u = Vec::with_capacity(ones as usize * clock);
    for _ in 0..ones {
        let sign = if bits >> (register - 1) & 1 == 1 { 1.0 } else { -1.0 };
        u.extend(std::iter::repeat_n(sign, clock));
        let sum = taps.iter().fold(0, |sum, tap| sum ^ bits >> (tap - 1) & 1);
        bits = (bits << 1 | sum) & ones;
    }
    Some(u)
}

/// Returns the lines of a period of `period` samples whose frequencies are in a band: the numbers k of periods in it
/// with `2 k / period` from `band[0]` to `band[1]`, as shares of the Nyquist frequency, which itself is left out, as is
/// the mean. `odd`: only odd k.
pub fn lines(period: usize, band: [f64; 2], odd: bool) -> Vec<usize> {
    let share = |k: usize| 2.0 * k as f64 / period as f64;
    let all = 1..period.div_ceil(2);
    all.filter(|k| (band[0]..=band[1]).contains(&share(*k)) && !(odd && k % 2 == 0))
        .collect()
}

/// Returns one period of a multisine: `u(t) = sqrt(2/F) sum_i cos(2 pi k_i t / period + phi_i)` over the F given lines
/// k_i, with Schroeder's phases `phi_i = -pi i (i - 1) / F`, i from 1, which keep its peaks low (M. R. Schroeder,
/// *Synthesis of low-peak-factor signals and binary sequences with low autocorrelation*, IEEE Trans. Information Theory
/// 16(1), 1970). Without lines it is 0.
pub fn multisine(period: usize, lines: &[usize]) -> Vec<f64> {
    let count = lines.len() as f64;
    let amplitude = (2.0 / count).sqrt();
    let mut u = vec![0.0; period];
    for (i, k) in lines.iter().enumerate() {
        let phase = -((i * (i + 1)) as f64) / (2.0 * count);
        for (t, u) in u.iter_mut().enumerate() {
            let turns = (k * t % period) as f64 / period as f64 + phase;
            *u += amplitude * cosine(turns - turns.floor());
        }
    }
    u
}

/// Returns one period of steps: each value held for `hold` samples.
pub fn steps(values: &[f64], hold: usize) -> Vec<f64> {
    let held = values.iter().flat_map(|value| std::iter::repeat_n(*value, hold));
    held.collect()
}

/// Returns one common period of `sum_i amplitudes_i sin(2 pi t / periods_i)`.
pub fn sines(amplitudes: &[f64], periods: &[usize]) -> Vec<f64> {
    let terms = || amplitudes.iter().zip(periods);
    let wave = |t: usize, (amplitude, period): (&f64, &usize)| {
        // sin(x) = cos(x - pi/2).
        let turns = (t % period) as f64 / *period as f64 + 0.75;
        amplitude * cosine(turns - turns.floor())
    };
    let length = periods
        .iter()
        .fold(1, |length, period| length / greatest_divisor(length, *period) * period);
    (0..length).map(|t| terms().map(|term| wave(t, term)).sum()).collect()
}

/// Returns the greatest common divisor.
pub fn greatest_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

/// Returns the cosine of an angle in turns, from 0 to 1, by the arithmetic of the normal numbers.
fn cosine(turns: f64) -> f64 {
    let quarters = 4.0 * turns;
    let nearest = (quarters + 0.5).floor();
    // The highest two bits are the quarter, the lowest 52 the place in it, from its middle.
    let place = ((quarters - nearest + 0.5) * (1_u64 << 52) as f64) as u64;
    let word = (nearest as u64 % 4) << 62 | place.min((1 << 52) - 1);
    turn(1.0, word)[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition of sequences of longest period: every nonzero state of the register appears once.
    #[test]
    fn binary_sequences_have_the_longest_period() {
        for register in REGISTERS {
            let u = prbs(register, 1).unwrap();
            let period = (1 << register) - 1;
            assert_eq!((u.len(), u.iter().sum::<f64>().abs()), (period, 1.0));
            let mut seen = vec![false; period + 1];
            for k in 0..period {
                let bits = (0..register).map(|i| u[(k + i) % period] > 0.0);
                let state = bits.fold(0, |state, bit| 2 * state + usize::from(bit));
                assert!(state > 0 && !std::mem::replace(&mut seen[state], true));
            }
        }
        let of = |lag: usize, u: &[f64]| -> f64 { (0..127).map(|k| u[k] * u[(k + lag) % 127]).sum() };
        let u = prbs(7, 1).unwrap();
        assert!((1..127).all(|lag| of(lag, &u) == -1.0));
        assert_eq!(prbs(3, 2).unwrap().chunks(2).filter(|u| u[0] == u[1]).count(), 7);
        assert!(prbs(1, 1).is_none() && prbs(19, 1).is_none() && prbs(7, 0).is_none());
    }

    /// By its discrete Fourier transform: a flat spectrum at the lines, nothing elsewhere, root mean square 1.
    #[test]
    fn multisines_have_their_lines_alone() {
        let (period, band) = (120, [0.1, 0.5]);
        let lines = lines(period, band, true);
        assert_eq!(lines, (7..=29).step_by(2).collect::<Vec<_>>());
        let u = multisine(period, &lines);
        let power = |k: usize| {
            let angle = |t: usize| std::f64::consts::TAU * (k * t) as f64 / period as f64;
            let of = |part: fn(f64) -> f64| -> f64 { u.iter().enumerate().map(|(t, u)| u * part(angle(t))).sum() };
            (of(f64::cos).powi(2) + of(f64::sin).powi(2)) / (period * period) as f64
        };
        for k in 0..=period / 2 {
            let expected = if lines.contains(&k) {
                0.5 / lines.len() as f64
            } else {
                0.0
            };
            assert!((power(k) - expected).abs() < 1e-15, "line {k}");
        }
        let peak = u.iter().fold(0.0_f64, |peak, u| peak.max(u.abs()));
        assert!(peak < 2.1, "{peak}");
        for turns in [0.0, 0.1, 0.125, 0.3, 0.5, 0.8, 0.999_999] {
            let error = cosine(turns) - (std::f64::consts::TAU * turns).cos();
            // Half a unit in the last place of the angle, which is up to 2 pi, and of the cosine.
            assert!(error.abs() < 6e-16, "{turns}: {error:e}");
        }
    }

    #[test]
    fn steps_hold() {
        assert_eq!(steps(&[0.0, 2.0], 3), [0.0, 0.0, 0.0, 2.0, 2.0, 2.0]);
    }
}
