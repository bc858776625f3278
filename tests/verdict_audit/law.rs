//! Laws of numbers, written as words: `mix 0.98 halfnormal 1 cauchy 5`. Each name is followed by its numbers, then by
//! the laws that it is made of.

use std::f64::consts::PI;

/// A stream of random numbers: splitmix64 of what it is made of.
pub struct Stream(u64);

impl Stream {
    pub fn new(of: &[u64]) -> Self {
        let mut stream = Self(0);
        for word in of {
            stream.0 = (stream.0 ^ word).wrapping_mul(0xD134_2543_DE82_EF95);
            stream.0 = stream.next();
        }
        stream
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a number inside 0 and 1.
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * PI * self.uniform()).cos()
    }

    /// Returns how often something of this chance is missed before it comes.
    fn misses(&mut self, chance: f64) -> f64 {
        (self.uniform().ln() / (1.0 - chance).ln()).floor()
    }
}

/// Where the numbers of a trial come from.
pub struct Draws {
    /// Common to all methods of a study.
    pub common: Stream,
    pub own: Stream,
    /// The length of the record.
    pub samples: f64,
}

type Rule = fn(&[f64], &[Law], &mut Draws) -> f64;

pub struct Law {
    numbers: Vec<f64>,
    of: Vec<Law>,
    rule: Rule,
}

/// Each law with how many numbers and laws follow its name.
const LAWS: &[(&str, usize, usize, Rule)] = &[
    ("const", 1, 0, |x, _, _| x[0]),
    ("uniform", 2, 0, |x, _, d| x[0] + (x[1] - x[0]) * d.own.uniform()),
    ("normal", 2, 0, |x, _, d| x[0] + x[1] * d.own.normal()),
    ("halfnormal", 1, 0, |x, _, d| x[0] * d.own.normal().abs()),
    ("lognormal", 1, 0, |x, _, d| (x[0] * d.own.normal()).exp()),
    ("exponential", 1, 0, |x, _, d| -x[0] * d.own.uniform().ln()),
    // Index and the least value.
    ("pareto", 2, 0, |x, _, d| x[1] * d.own.uniform().powf(-1.0 / x[0])),
    ("cauchy", 1, 0, |x, _, d| x[0] * (PI * (d.own.uniform() - 0.5)).tan()),
    // Student's law with three degrees of freedom.
    ("t3", 1, 0, |x, _, d| {
        let squares: f64 = (0..3).map(|_| d.own.normal().powi(2)).sum();
        x[0] * d.own.normal() / (squares / 3.0).sqrt()
    }),
    // How often something of this chance is missed.
    ("geometric", 1, 0, |x, _, d| d.own.misses(x[0])),
    // How many of so many have this chance.
    ("binomial", 2, 0, |x, _, d| {
        (0..x[0] as u32).filter(|_| d.own.uniform() < x[1]).count() as f64
    }),
    // 1 to this number, all alike.
    ("die", 1, 0, |x, _, d| 1.0 + (x[0] * d.own.uniform()).floor()),
    // Digits 0 and 2 in base 3.
    ("cantor", 0, 0, |_, _, d| {
        let digit = |place: i32| (2.0 * d.own.uniform()).floor() * 2.0 / 3_f64.powi(place);
        (1..34).map(digit).sum()
    }),
    ("arcsine", 0, 0, |_, _, d| (0.5 * PI * d.own.uniform()).sin().powi(2)),
    ("mix", 1, 2, |x, of, d| {
        let at = usize::from(d.own.uniform() >= x[0]);
        of[at].draw(d)
    }),
    // The first law in records of at most so many samples.
    ("short", 1, 2, |x, of, d| of[usize::from(d.samples > x[0])].draw(d)),
    // The same number for all methods of a study.
    ("common", 0, 1, |_, of, d| {
        std::mem::swap(&mut d.common, &mut d.own);
        let drawn = of[0].draw(d);
        std::mem::swap(&mut d.common, &mut d.own);
        drawn
    }),
    ("sum", 0, 2, |_, of, d| of[0].draw(d) + of[1].draw(d)),
    ("product", 0, 2, |_, of, d| of[0].draw(d) * of[1].draw(d)),
    ("power", 1, 1, |x, of, d| x[0].powf(of[0].draw(d))),
    ("rounded", 1, 1, |x, of, d| (of[0].draw(d) / x[0]).round() * x[0]),
];

impl Law {
    /// Reads a law.
    ///
    /// # Errors
    /// The word that is missing or not understood.
    pub fn read<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Self, String> {
        let mut word = |wanted: &str| words.next().ok_or(format!("ends where {wanted} is expected"));
        let name = word("a law")?;
        let known = LAWS.iter().find(|(known, ..)| *known == name);
        let (_, numbers, of, rule) = known.ok_or(format!("unknown law {name}"))?;
        let number = |word: Result<&str, String>| -> Result<f64, String> {
            word?.parse().map_err(|error| format!("{name}: {error}"))
        };
        Ok(Self {
            numbers: (0..*numbers)
                .map(|_| number(word("a number")))
                .collect::<Result<_, _>>()?,
            of: (0..*of).map(|_| Self::read(words)).collect::<Result<_, _>>()?,
            rule: *rule,
        })
    }

    pub fn draw(&self, draws: &mut Draws) -> f64 {
        (self.rule)(&self.numbers, &self.of, draws)
    }
}
