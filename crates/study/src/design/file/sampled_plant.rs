//! A plant in continuous time with a sampling time.

use crate::design::file::{HoldName, PlantTable, Scalar};
use asobench_identification::plant::{Sampling, parse_pole, polynomial_from_poles, unmatched_pole};
use asobench_identification::signal::Hold;
use faer::c64;

impl PlantTable {
    /// Whether it has a key of a plant in s.
    pub(super) fn is_in_s(&self) -> bool {
        let [num, den] = [&self.num, &self.den].map(Option::is_some);
        let [zeros, poles] = [&self.zeros, &self.poles].map(Option::is_some);
        let numbers = [self.gain, self.sampling_time, self.delay];
        num || den || zeros || poles || numbers != [None; 3] || self.hold.is_some()
    }

    /// Returns the largest order that it can have as a plant in s.
    pub(super) fn order_in_s(&self) -> usize {
        let degree = self.den.as_ref().map_or(0, Vec::len);
        let degree = degree.max(self.poles.as_ref().map_or(0, Vec::len));
        let samples = self.delay.unwrap_or(0.0) / self.sampling_time.unwrap_or(1.0);
        degree.saturating_add(samples.ceil() as usize)
    }

    /// Returns `A(q)` and `B(q)` of the sampled plant.
    pub(super) fn sampled(&self) -> Result<[Vec<f64>; 2], String> {
        let interval = self.sampling_time.ok_or(
            "expected the sampling time Ts in seconds beside num and den, or zeros, poles and gain, which are in s; a \
             plant in q^-1 has the polynomials A and B",
        )?;
        let [num, den] = self.in_s()?;
        // Elsewhere a transfer function with a sampling time is one in z.
        let hold = self.hold.ok_or(
            "expected hold = \"zero\" or \"linear\" beside Ts: num and den, zeros and poles are in s; a plant in q^-1 \
             has the polynomials A and B",
        )?;
        let sampling = Sampling {
            interval,
            delay: self.delay.unwrap_or(0.0),
            hold: Hold::from(hold),
        };
        sampling.polynomials(&num, &den).map_err(|error| error.to_string())
    }

    /// Returns numerator and denominator in s, the highest power first.
    fn in_s(&self) -> Result<[Vec<f64>; 2], String> {
        match (&self.num, &self.den, &self.poles) {
            (Some(num), Some(den), None) if self.zeros.is_none() && self.gain.is_none() => {
                Ok([num.clone(), den.clone()])
            }
            (None, None, Some(poles)) => {
                let gain = self.gain.ok_or("gain: expected a number beside poles")?;
                let num = monic_of("zeros", self.zeros.as_deref().unwrap_or(&[]))?;
                Ok([num.iter().map(|x| gain * x).collect(), monic_of("poles", poles)?])
            }
            _ => Err("expected num and den, or poles and gain (and zeros), beside Ts".to_owned()),
        }
    }
}

impl From<HoldName> for Hold {
    fn from(name: HoldName) -> Self {
        match name {
            HoldName::Zero => Self::Zero,
            HoldName::Linear => Self::Linear,
        }
    }
}

/// Returns the polynomial with these roots, the highest power first, whose coefficient is 1.
fn monic_of(key: &str, roots: &[Scalar]) -> Result<Vec<f64>, String> {
    let root = |scalar: &Scalar| {
        let text = match scalar {
            Scalar::Number(x) => return Ok(c64::new(*x, 0.0)),
            Scalar::Text(text) => text,
        };
        let found = parse_pole(&text.replace(' ', ""));
        found.ok_or_else(|| format!("{key}: '{text}'; expected a number, or a text such as \"-1+2i\""))
    };
    let roots = roots.iter().map(root).collect::<Result<Vec<_>, String>>()?;
    if let Some(alone) = unmatched_pole(&roots) {
        return Err(format!("{key}: {alone} without its conjugate"));
    }
    let rest = polynomial_from_poles(&roots);
    Ok(std::iter::once(1.0).chain(rest.iter().map(|x| x.re)).collect())
}

#[cfg(test)]
mod tests {
    use crate::design::file::tables::PlantTable;

    fn table(text: &str) -> PlantTable {
        toml::from_str(text).unwrap()
    }

    /// `scipy.signal.cont2discrete` of 104 / (s^2 + 4 s + 104), and of its zeros, poles and gain.
    #[test]
    fn transfer_functions_and_poles() {
        for text in [
            "num = [104]\nden = [1, 4, 104]\nTs = 0.05\nhold = \"zero\"",
            "poles = [\"-2+10i\", \"-2 - 10i\"]\ngain = 104\nTs = 0.05\nhold = \"zero\"",
            "num = [0, 208]\nden = [2, 8, 208]\nTs = 0.05\nhold = \"zero\"\ndelay = 0",
        ] {
            let plant = table(text).plant().unwrap();
            let expected = [
                -0.8187307530779823,
                1.5881390788285354,
                0.1191700272875067,
                0.11142164696194001,
            ];
            let found = [plant.a(), &plant.h()].concat();
            for (x, y) in found.iter().zip(expected) {
                assert!((x - y).abs() < 1e-14, "{text}: {found:?}");
            }
        }
        // 3 samples of delay, of which one is the hold's own, and a part of one.
        let text = "poles = [-1]\nzeros = []\ngain = 1\nTs = 0.5\nhold = \"zero\"\ndelay = 1.2";
        let plant = table(text).plant().unwrap();
        assert_eq!((plant.order(), &plant.h()[..2]), (4, &[0.0; 2][..]));
        let gain = plant.h().iter().sum::<f64>() / (1.0 - (-0.5_f64).exp());
        assert!((gain - 1.0).abs() < 1e-14);
    }

    #[test]
    fn mistakes_are_told() {
        for (text, part) in [
            ("num = [1]\nden = [1, 1]", "the sampling time Ts in seconds"),
            ("num = [1]\nden = [1, 1]\nTs = 1", "expected hold ="),
            ("num = [1]\nTs = 1", "expected num and den, or poles and gain"),
            (
                "num = [1]\nden = [1, 1]\ngain = 2\nTs = 1",
                "expected num and den, or poles",
            ),
            ("poles = [-1]\nTs = 1", "gain: expected a number"),
            (
                "poles = [\"-1+i\"]\ngain = 1\nTs = 1",
                "poles: -1+1i without its conjugate",
            ),
            (
                "poles = [\"fast\"]\ngain = 1\nTs = 1",
                "poles: 'fast'; expected a number",
            ),
            ("num = [1]\nden = [1, 1]\nTs = 1\nA = [1]", "one of them"),
            (
                "num = [1, 0]\nden = [1, 1]\nTs = 1\nhold = \"zero\"",
                "y(k) would depend on u(k)",
            ),
        ] {
            let error = table(text).plant().unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(table("num = [1]\nden = [1, 1]\nTs = 1\ndelay = 1e9").order() > 1_000_000);
    }
}
