//! The audit's questions: laws whose truth is arithmetic, and claims whose limit is that truth or just beside it.

use std::f64::consts::{E, FRAC_2_PI, LN_2, PI};

/// The truth of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    Holds,
    Fails,
    /// The limit is the truth, or in the band of all quantiles: neither verdict may be frequent.
    Limit,
}

use Truth::{Fails, Holds, Limit};

/// Where a further look is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Here,
    NewFolder,
    /// A new folder, by trials of another seed.
    Confirmed,
}

/// A claim on numbers of known laws.
#[derive(Clone)]
pub struct Row {
    /// The law in words.
    pub law: &'static str,
    /// The options and laws of the methods x and y; no such method if empty.
    pub methods: [&'static str; 2],
    /// The claim's test without its braces.
    pub test: String,
    pub holds: &'static str,
    pub truth: Truth,
    /// The looks: what the file plans, and the trials.
    pub looks: Vec<(Option<u32>, u64)>,
    pub place: Place,
    pub windows: &'static str,
    /// Words that the sentence must not have.
    pub never: &'static str,
}

impl Row {
    fn to(mut self, y: &'static str) -> Self {
        self.methods[1] = y;
        self
    }

    fn trials(mut self, trials: u64) -> Self {
        self.looks = vec![(Some(1), trials)];
        self
    }

    /// Doubled from so many trials on, as often as there are plans.
    fn doubled(mut self, first: u64, plans: &[Option<u32>]) -> Self {
        let looks = plans.iter().zip(0..);
        self.looks = looks.map(|(plan, i)| (*plan, first << i)).collect();
        self
    }

    fn at(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    fn never(mut self, words: &'static str) -> Self {
        self.never = words;
        self
    }

    /// In three cells, from short records to long ones.
    fn in_three(mut self, holds: &'static str) -> Self {
        (self.windows, self.holds) = ("[4, 8, 16]", holds);
        self
    }
}

/// Rows of the form `law: x, test => truth`, followed by methods of [`Row`].
macro_rules! rows {
    ($($law:literal: $x:expr, $test:expr => $truth:ident $(.$with:ident($($given:expr),*))*;)*) => {
        vec![$(row($law, $x, $test, $truth)$(.$with($($given),*))*),*]
    };
}

fn row(law: &'static str, x: &'static str, test: String, truth: Truth) -> Row {
    Row {
        law,
        methods: [x, ""],
        test,
        holds: "everywhere",
        truth,
        looks: vec![(Some(1), 1000)],
        place: Place::Here,
        windows: "4",
        never: "",
    }
}

fn value(statistic: &str, side: &str, limit: f64) -> String {
    format!("value = 'e_a', of = 'x', statistic = '{statistic}', {side} = {limit:?}")
}

fn ratio(statistic: &str, side: &str, limit: f64) -> String {
    format!("ratio = 'e_a', of = 'x', to = 'y', statistic = '{statistic}', {side} = {limit:?}")
}

fn paired(side: &str, limit: f64) -> String {
    ratio("paired-median", side, limit)
}

fn slope(statistic: &str, side: &str, limit: f64) -> String {
    format!("slope = 'e_a', of = 'x', over = 'window', statistic = '{statistic}', {side} = {limit:?}")
}

fn share(bound: f64, side: &str, limit: f64) -> String {
    format!("share = 'e_a', of = 'x', bound = {bound:?}, {side} = {limit:?}")
}

fn outcome(side: &str, limit: f64) -> String {
    format!("share = 'failed', of = 'x', {side} = {limit:?}")
}

fn of_a(statistic: &str, limit: &str) -> String {
    format!("value = 'a_1', of = 'x', statistic = '{statistic}', {limit}")
}

/// The median and the 95 % quantile of |X| with a normal X.
const HALF_NORMAL: [f64; 2] = [0.674_489_750_196_081_7, 1.959_963_984_540_054];

/// Moments whose tail begins late, or is not seen at all.
pub fn moments() -> Vec<Row> {
    let pareto = "mix 0.98 halfnormal 1 pareto 2.2 2";
    let cauchy = "mix 0.98 halfnormal 1 cauchy 5";
    // E X = 2.2 / 1.2 and E X^2 = 2.2 / 0.2 of a Pareto law from 1 on.
    let mean = 0.98 * FRAC_2_PI.sqrt() + 0.02 * 2.0 * 2.2 / 1.2;
    let rms = (0.98 + 0.02 * 4.0 * 2.2 / 0.2_f64).sqrt();
    let near_zero = "mix 0.01 uniform 0 0.01 uniform 0.99 1.01";
    let fit = |side: &str, limit: f64| format!("value = 'fit_fresh', of = 'x', statistic = 'mean', {side} = {limit:?}");
    rows! {
        "2 % Pareto(2.2)": pareto, value("mean", "below", mean) => Limit;
        "2 % Pareto(2.2)": pareto, value("mean", "above", mean) => Limit;
        "2 % Pareto(2.2)": pareto, value("rms", "below", rms) => Limit;
        "2 % Pareto(2.2)": pareto, value("rms", "above", rms) => Limit;
        "2 % Pareto(2.2)": pareto, value("rms", "below", rms) => Limit .trials(4000);
        "2 % Cauchy": cauchy, value("mean", "below", 3.0) => Fails;
        "2 % Cauchy": cauchy, value("rms", "below", 30.0) => Fails;
        "2 % Pareto(2.2), both": pareto, ratio("rms", "below", 1.0) => Limit .to(pareto);
        "2 % Pareto(2.2) over normal": pareto, ratio("rms", "below", rms) => Limit .to("halfnormal 1");
        "2 % Cauchy over normal": cauchy, ratio("rms", "below", 30.0) => Fails .to("halfnormal 1");
        // The slope over 4, 8, 16 is (ln m(16) - ln m(4)) / ln 4.
        "2 % Pareto(2.2) at N = 16": "short 8 halfnormal 1 mix 0.98 halfnormal 1 pareto 2.2 2",
            slope("rms", "below", rms.ln() / 4_f64.ln()) => Limit .in_three("everywhere");
        "2 % Cauchy at N = 16": "short 8 halfnormal 1 mix 0.98 halfnormal 1 cauchy 5",
            slope("rms", "below", 2.5) => Fails .in_three("everywhere");
        "0.1 % at 1e6, else 1": "mix 0.001 const 1e6 const 1", value("mean", "below", 500.0) => Fails .trials(400);
        "0.3 % at 30, normal": "mix 0.003 const 30 halfnormal 1", value("rms", "below", 1.9) => Fails .trials(400);
        "1 % near 0, else 1": near_zero, value("mean", "above", 0.01 * 0.005 + 0.99) => Limit .trials(40);
        "1 % near 0, else 1": near_zero, value("mean", "above", 0.01 * 0.005 + 0.99) => Limit .trials(400);
        // FIT is 100 (1 - |X|) at most: equal but for the mean of the fresh output.
        "FIT: 1 % at 27, else 99": "gain -- mix 0.01 const 0.73 const 0.01", fit("above", 98.28) => Fails .trials(40);
        "FIT: 1 % at 27, else 99": "gain -- mix 0.01 const 0.73 const 0.01",
            fit("above", 98.28) => Fails .trials(400);
        "FIT: 1 % at 27, else 99": "gain -- mix 0.01 const 0.73 const 0.01", fit("above", 98.28) => Fails;
        "FIT without mean": "gain -- mix 0.98 const 0.01 pareto 0.9 0.01", fit("above", 90.0) => Fails;
        "FIT without mean": "gain -- pareto 0.9 0.01", fit("below", 99.0) => Holds .trials(100);
        "eight tied values": "mix 0.9 const 1 const 100", value("mean", "below", 2.0) => Fails .trials(8);
        "eight tied values": "mix 0.9 const 1 const 100", value("rms", "below", 2.0) => Fails .trials(8);
        "one zero in ten": "mix 0.1 const 0 const 1", value("mean", "above", 0.95) => Fails .trials(8);
        "log-normal(2)": "lognormal 2", value("mean", "below", 2_f64.exp()) => Limit;
        "log-normal(2)": "lognormal 2", value("mean", "above", 2_f64.exp()) => Limit;
        "half-normal": "halfnormal 1", value("rms", "above", 1.0) => Limit .trials(100);
        "half-normal": "halfnormal 1", value("mean", "above", FRAC_2_PI.sqrt()) => Limit;
        // Own: without a mean, discrete, bounded.
        "2^geometric (St Petersburg)": "power 2 geometric 0.5", value("mean", "below", 12.0) => Fails;
        "2^geometric (St Petersburg)": "power 2 geometric 0.5", value("mean", "above", 2.0) => Holds;
        "rounded Pareto(0.8)": "rounded 1 pareto 0.8 1", value("mean", "below", 300.0) => Fails;
        "Bernoulli 0.1 %": "mix 0.001 const 1 const 0", value("mean", "below", 0.001) => Limit;
        "Bernoulli 0.1 %": "mix 0.001 const 1 const 0", value("mean", "above", 0.001) => Limit;
        "Bernoulli 99 %": "mix 0.99 const 1 const 0", value("rms", "above", 0.99_f64.sqrt()) => Limit .trials(100);
        "arcsine": "arcsine", value("rms", "below", 0.375_f64.sqrt()) => Limit .trials(100);
        "Cantor": "cantor", value("mean", "below", 0.5) => Limit .trials(100);
        "binomial(3, 1/2)": "binomial 3 0.5", value("mean", "above", 1.5) => Limit .trials(40);
    }
}

/// Quantiles of laws with ties, gaps, atoms and kinks, of one output and of two.
pub fn quantiles() -> Vec<Row> {
    let (three, far) = (
        "mix 0.34 const 0.5 mix 0.25 const 1 const 2",
        "mix 0.951 exponential 1 uniform 100 150",
    );
    let gap = |share: u32| match share {
        49 => "mix 0.049 uniform 0 1 uniform 10 11",
        51 => "mix 0.051 uniform 0 1 uniform 10 11",
        499 => "mix 0.499 uniform 0 1 uniform 10 11",
        500 => "mix 0.5 uniform 0 1 uniform 10 11",
        501 => "mix 0.501 uniform 0 1 uniform 10 11",
        749 => "mix 0.749 uniform 0 1 uniform 10 11",
        750 => "mix 0.75 uniform 0 1 uniform 10 11",
        _ => "mix 0.751 uniform 0 1 uniform 10 11",
    };
    let kink = "mix 0.945 uniform 0 1 uniform 1 101";
    rows! {
        // P(X < 1.25) = 0.505, P(X < 1) = 0.34.
        "ties .34/.165/.495": three, value("median", "below", 1.25) => Holds;
        "ties .34/.165/.495": three, value("median", "below", 1.25) => Holds .trials(100);
        "ties .34/.165/.495": three, value("median", "below", 1.0) => Fails;
        "ties .34/.165/.495": three, value("median", "above", 0.75) => Holds;
        "ties .48/.04/.48": "mix 0.48 const 0.5 mix 0.07692307692307693 const 1 const 2",
            value("median", "below", 1.25) => Holds;
        // The 95 % quantile is that of 0.95 / 0.951 of the exponential law: ln 951.
        "4.9 % outliers": far, value("q95", "below", 951_f64.ln()) => Limit;
        "4.9 % outliers": far, value("q95", "below", 50.0) => Holds;
        "4.9 % at 1e9": "mix 0.951 exponential 1 const 1e9", value("q95", "below", 50.0) => Holds;
        "5.1 % outliers": "mix 0.949 exponential 1 uniform 100 150", value("q95", "below", 50.0) => Fails;
        "a gap at q75": gap(751), value("q75", "below", 5.0) => Holds;
        "a gap at q75": gap(749), value("q75", "below", 5.0) => Fails;
        "a gap at q75": gap(750), value("q75", "below", 5.0) => Limit;
        "a gap at q05": gap(49), value("q05", "below", 5.0) => Fails;
        "a gap at q05": gap(51), value("q05", "above", 5.0) => Fails;
        "a gap, paired": gap(501), paired("below", 5.0) => Holds .to("const 1");
        "a gap, paired": gap(499), paired("below", 5.0) => Fails .to("const 1");
        "a gap, cells": "short 4 const 1 mix 0.501 uniform 0 1 uniform 10 11",
            cells(5.0) => Holds .in_three("everywhere");
        "a gap, two medians": gap(501), ratio("median", "below", 5.0) => Holds .to(gap(501));
        "a gap, two medians": gap(499), ratio("median", "below", 5.0) => Fails .to(gap(501));
        "a gap, two medians": gap(500), ratio("median", "below", 1.0) => Limit .to(gap(500));
        "atoms, two medians": three, ratio("median", "below", 1.5) => Holds .to(three).trials(400);
        "half exactly 0": "mix 0.5 const 0 halfnormal 1",
            value("median", "below", 0.01) => Holds .doubled(100, &[None; 7]);
        "half exactly 0, a gap": "mix 0.5 const 0 uniform 1 2",
            value("median", "below", 0.5) => Limit .doubled(100, &[None; 7]);
        "a kink at q95": "mix 0.95 uniform 0 1 uniform 1 21", value("q95", "below", 1.0) => Limit;
        "a kink before q95": kink, value("q95", "below", 1.0 + 100.0 * 5.0 / 55.0) => Limit .trials(400);
        "a kink before q95": kink, value("q95", "below", 1.0 + 100.0 * 5.0 / 55.0) => Limit;
        "a kink before q95": kink, value("q95", "below", 1.0 + 100.0 * 5.0 / 55.0) => Limit .doubled(250, &[None; 4]);
        "medians of unequal spread, slope": "short 4 lognormal 0.1 short 8 lognormal 1 lognormal 3",
            slope("median", "below", 0.0) => Limit .in_three("everywhere").trials(400);
        "medians of unequal spread, slope": "short 4 lognormal 0.1 short 8 lognormal 1 lognormal 3",
            slope("median", "below", 0.0) => Limit .in_three("everywhere").trials(100);
        // Infinite in 60 % of the trials.
        "y exactly 0 in 60 %, x lost in 1 %": "lost 0.01 -- halfnormal 1", paired("below", 10.0) => Fails
            .to("mix 0.6 const 0 halfnormal 1") .never("y, is 0");
        "y exactly 0 in 60 %, lost in 1 %": "halfnormal 1", paired("above", 1.0) => Holds
            .to("lost 0.01 -- mix 0.6 const 0 halfnormal 1") .never("y, is 0");
        "half-normal": "halfnormal 1", value("median", "below", HALF_NORMAL[0]) => Limit;
        "half-normal": "halfnormal 1", value("median", "below", HALF_NORMAL[0]) => Limit .trials(40);
        "half-normal": "halfnormal 1", value("q95", "above", HALF_NORMAL[1]) => Limit .trials(400);
    }
}

fn cells(below: f64) -> String {
    format!("cells = 'e_a', of = 'x', axis = 'window', from = 4, to = 16, below = {below:?}")
}

/// Laws of our own: discrete, mixed, bounded, without a mean, with atoms or a band of quantiles at the limit.
pub fn own_laws() -> Vec<Row> {
    let clusters = "product die 4 uniform 0.9 1.1";
    let (log_cauchy, zeta) = ("power 2.718281828459045 cauchy 1", "rounded 1 pareto 0.8 1");
    // P(not lost, X < m) = 1 - 1/e + (1/e - exp(-m)) / 2 above 1.
    let q75 = -(0.5 - 1.0 / E).ln();
    let one = "mix 0.5 const 1 uniform 0.5 0.75";
    rows! {
        // P(X <= 1) = 0.51, and exactly 1/2.
        "geometric(0.3)": "geometric 0.3", value("median", "below", 1.5) => Holds;
        "geometric(0.3)": "geometric 0.3", value("median", "below", 1.0) => Fails;
        "geometric, a band": "geometric 0.2928932188134524", value("median", "below", 1.5) => Limit;
        "lattice times scale, median": clusters, value("median", "below", 2.5) => Limit;
        "lattice times scale, q25": clusters, value("q25", "above", 1.5) => Limit;
        "lattice times scale, q75": clusters, value("q75", "below", 3.4) => Limit;
        "lattice times scale, paired": clusters, paired("below", 1.0) => Limit .to(clusters);
        "Bernoulli 5 %": "mix 0.05 const 1 const 0", value("q95", "below", 0.5) => Limit;
        "Bernoulli 6 %": "mix 0.06 const 1 const 0", value("q95", "below", 0.5) => Fails;
        "a band of medians": "mix 0.5 uniform 0 1 uniform 2 3", value("median", "below", 1.5) => Limit .trials(100);
        "a band of medians": "mix 0.5 uniform 0 1 uniform 2 3", value("median", "above", 1.5) => Limit .trials(40);
        "Cantor": "cantor", value("median", "below", 0.5) => Limit;
        "Cantor": "cantor", value("q25", "above", 1.0 / 6.0) => Limit;
        "arcsine": "arcsine", value("q05", "below", (0.025 * PI).sin().powi(2)) => Limit .trials(400);
        "log-Cauchy": log_cauchy, value("median", "above", 1.0) => Limit .trials(100);
        "log-Cauchy": log_cauchy, value("q75", "below", E) => Limit;
        "log-Cauchy, paired": log_cauchy, paired("below", 1.0) => Limit .to(log_cauchy);
        // P(X <= 2) = 1 - 2.5^-0.8 = 0.52.
        "rounded Pareto(0.8)": zeta, value("median", "below", 2.25) => Holds;
        "rounded Pareto(0.8)": zeta, value("median", "below", 2.0) => Fails;
        "rounded half-normal": "rounded 0.125 halfnormal 1", value("median", "below", 0.65) => Holds;
        "die(20)": "die 20", value("q05", "below", 1.5) => Limit;
        "die(20)": "die 20", value("q95", "below", 19.5) => Limit .trials(400);
        "die(20)": "die 20", value("q25", "above", 5.5) => Limit;
        "binomial(3, 1/2)": "binomial 3 0.5", value("median", "below", 1.5) => Limit .trials(100);
        "2^geometric (St Petersburg)": "power 2 geometric 0.5", value("median", "below", 1.5) => Limit;
        "ratio exactly 1 in half": one, paired("below", 1.0) => Limit .to("const 1");
        "ratio exactly 1 in half": one, paired("above", 1.0) => Fails .to("const 1");
        "ratio exactly at the limit": "const 1.25", paired("within", 1.25) => Holds .to("const 1").trials(100);
        "log-normal ratio at 1.25": "product const 1.25 lognormal 0.5",
            paired("within", 1.25) => Limit .to("lognormal 0.5");
        "lost above 1 by half": "lost-above 1 0.5 -- exponential 1", value("median", "below", LN_2) => Limit;
        "lost above 1 by half": "lost-above 1 0.5 -- exponential 1", value("q75", "above", q75) => Limit;
        "lost above 1 by half": "lost-above 1 0.5 -- exponential 1", value("q95", "below", 1e3) => Fails;
        "lost above 1 by half": "lost-above 1 0.5 -- exponential 1", outcome("below", 0.5 / E) => Limit;
        "lost 5 %": "lost 0.05 -- exponential 1", value("q95", "below", 1e6) => Limit;
        "lost 60 %": "lost 0.6 -- halfnormal 1", value("median", "below", 10.0) => Fails .trials(100);
        "lost 50 %": "lost 0.5 -- halfnormal 1", value("median", "below", 10.0) => Limit .trials(100);
    }
}

/// Shares, coverage, bias, several cells, several tests and several looks.
pub fn others() -> Vec<Row> {
    let median = value("median", "below", HALF_NORMAL[0]);
    let edited = [Some(1), Some(2), Some(3)];
    rows! {
        "uniform": "uniform 0 1", share(0.05, "below", 0.05) => Limit;
        "uniform": "uniform 0 1", share(0.5, "above", 0.5) => Limit .trials(100);
        "wins, ties in 80 %": "mix 0.8 const 0 halfnormal 1", wins() => Limit .to("mix 0.8 const 0 halfnormal 1");
        "covered in 95 %": "se 1 -- mix 0.95 const 0 const 10", of_a("coverage", "above = 0.95") => Limit;
        "covered in 93 %": "se 1 -- mix 0.93 const 0 const 10", of_a("coverage", "between = [0.93, 0.97]") => Limit;
        "covered as normal": "se 1 -- normal 0 1", of_a("coverage", "between = [0.9, 0.95]") => Limit;
        "covered, Cauchy": "lost 0.2 se 1 -- cauchy 1", of_a("coverage", "below = 0.95") => Holds;
        "normal, biased by 0.1": "normal 0.1 1", of_a("bias", "between = [-0.1, 0.1]") => Limit;
        // 0.2 over the root of 0.998 + 20 - 0.04, which is 0.0437.
        "0.2 % at 100": "mix 0.002 const 100 normal 0 1", of_a("bias", "between = [-0.04, 0.04]") => Fails;
        "1 % at 1, else 0": "mix 0.01 const 1 const 0", of_a("bias", "between = [-0.1, 0.1]") => Fails .trials(100);
        "three cells at the limit": "halfnormal 1", median.clone() => Limit .in_three("everywhere");
        "one of three at the limit": "short 8 const 0 halfnormal 1", median.clone() => Limit .in_three("everywhere");
        "one of three at the limit": "short 8 const 9 halfnormal 1", median.clone() => Limit .in_three("somewhere");
        "three cells at the limit": "halfnormal 1", median.clone() => Limit .in_three("somewhere");
        "two tests at the limit": "halfnormal 1",
            format!("{median} }}, {{ {}", value("q95", "below", HALF_NORMAL[1])) => Limit;
        "looks 1, 2, 3, doubled": "halfnormal 1", median.clone() => Limit .doubled(100, &edited);
        "looks 1, 2, 3, doubled": "uniform 0 1", share(0.5, "above", 0.5) => Limit .doubled(100, &edited);
        "looks 9, 2, -, 4, doubled": "uniform 0 1",
            share(0.5, "above", 0.5) => Limit .doubled(100, &[Some(9), Some(2), None, Some(4)]);
        "doubled in new folders": "uniform 0 1", share(0.5, "above", 0.5) => Limit
            .doubled(100, &[None; 8]) .at(Place::NewFolder);
        "confirmed eight times": "uniform 0 1", share(0.5, "above", 0.5) => Limit
            .doubled(100, &[None; 8]) .at(Place::Confirmed);
        "doubled seven times": "halfnormal 1", median => Limit .doubled(100, &[None; 8]);
        "doubled seven times": "uniform 0 1", share(0.05, "below", 0.05) => Limit .doubled(100, &[None; 8]);
    }
}

fn wins() -> String {
    "share = 'e_a', of = 'x', to = 'y', above = 0.5".to_owned()
}

/// Claims with the keys `cap` and `kurtosis`, and shares of coefficients above the truth.
pub fn with_assumptions() -> Vec<Row> {
    let capped =
        |statistic: &str, cap: f64, side: &str, limit: f64| format!("{}, cap = {cap:?}", value(statistic, side, limit));
    // Of an exponential law: E min(X, C) and E min(X, C)^2.
    let mean = 1.0 - (-3_f64).exp();
    let square = 2.0 * (1.0 - 4.0 * (-3_f64).exp());
    let rms = square.sqrt();
    // Of a Pareto law of index 0.8 from 1 on, at 10.
    let pareto = 1.0 + (10_f64.powf(0.2) - 1.0) / 0.2;
    let kurtosis = |of: f64, limit: f64| format!("{}, kurtosis = {of:?}", value("rms", "below", limit));
    let above = "between = [0.46, 0.54]";
    rows! {
        "exponential, cap 3": "exponential 1", capped("rms", 3.0, "below", rms) => Limit .trials(100);
        "exponential, cap 3": "exponential 1", capped("rms", 3.0, "below", rms) => Limit;
        "exponential, cap 3": "exponential 1", capped("mean", 3.0, "below", mean) => Limit .trials(400);
        "exponential, cap 3": "exponential 1", capped("mean", 3.0, "above", mean) => Limit .trials(400);
        "Pareto(0.8), cap 10": "pareto 0.8 1", capped("mean", 10.0, "below", pareto) => Limit .trials(400);
        "10 % lost, cap 3": "lost 0.1 -- exponential 1", capped("mean", 3.0, "below", 0.9 * mean + 0.3) => Limit;
        // Below 1 as it is; above 1 half as it is and half at the cap.
        "lost above 1 by half, cap 3": "lost-above 1 0.5 -- exponential 1",
            capped("mean", 3.0, "below", 1.0 - 2.0 / E + 0.5 * (2.0 / E - (-3_f64).exp()) + 1.5 / E) => Limit;
        "2^geometric, cap 8": "power 2 geometric 0.5", capped("mean", 8.0, "below", 2.5) => Limit .trials(100);
        "1 % at 1e9, cap 4": "mix 0.01 const 1e9 const 1", capped("mean", 4.0, "below", 1.03) => Limit .trials(40);
        "eight tied, cap 100": "mix 0.9 const 1 const 100", capped("mean", 100.0, "below", 10.9) => Limit .trials(8);
        "exponential over uniform, cap 3": "exponential 1",
            format!("{}, cap = 3.0", ratio("rms", "below", (3.0 * square).sqrt())) => Limit .to("uniform 0 1");
        "half-normal, kurtosis 3": "halfnormal 1", kurtosis(3.0, 1.0) => Limit .trials(100);
        "half-normal, kurtosis 3": "halfnormal 1", kurtosis(3.0, 1.0) => Limit;
        "Bernoulli 1 %, kurtosis 100": "mix 0.01 const 1 const 0", kurtosis(100.0, 0.1) => Limit .trials(100);
        "54 % above": "mix 0.54 const 1 const -1", of_a("share-above", above) => Limit;
        "half above": "cauchy 1", of_a("share-above", above) => Holds .trials(4000);
        "60 % above": "mix 0.6 const 1 pareto -1 -1", of_a("share-above", above) => Fails;
    }
}
