//! The cost of verdicts: the trials that each kind of claim needs for even odds of being decided, in smooth laws.

use super::study::{Verdict, file, verdicts};
use std::path::Path;

struct Smooth {
    law: &'static str,
    words: &'static str,
    median: f64,
    q95: f64,
    mean: f64,
    rms: f64,
    /// The root mean square where numbers above three times it count as that.
    capped: f64,
}

/// The quantiles are from tables, the moments by arithmetic, the capped ones by quadrature.
const LAWS: [Smooth; 4] = [
    Smooth {
        law: "half-normal",
        words: "halfnormal 1",
        median: 0.674_489_750_196_081_7,
        q95: 1.959_963_984_540_054,
        mean: 0.797_884_560_802_865_4,
        rms: 1.0,
        capped: 0.997_500_515_3,
    },
    Smooth {
        law: "log-normal(1)",
        words: "lognormal 1",
        median: 1.0,
        q95: 5.180_251_602_233_01,
        mean: 1.648_721_270_700_128,
        rms: std::f64::consts::E,
        capped: 2.275_263_364_7,
    },
    Smooth {
        law: "exponential",
        words: "exponential 1",
        median: std::f64::consts::LN_2,
        q95: 2.995_732_273_553_991,
        mean: 1.0,
        rms: std::f64::consts::SQRT_2,
        capped: 1.359_901_004_4,
    },
    Smooth {
        law: "|t3|",
        words: "t3 1",
        median: 0.764_892_328_404_344_7,
        q95: 3.182_446_305_283_703_6,
        // 2 sqrt(3) / pi.
        mean: 1.102_657_790_843_585,
        rms: 1.732_050_807_568_877_2,
        capped: 1.478_650_872_1,
    },
];

const EFFECTS: [f64; 3] = [0.05, 0.1, 0.2];

/// Returns the kinds of claims, each with its test at every effect: the limit is that much beside the truth.
fn kinds(law: &Smooth, with_cap: bool) -> [(&'static str, [String; 3]); 8] {
    let value = |statistic: &str, limit: f64, side: &str| {
        format!("value = 'e_a', of = 'x', statistic = '{statistic}', {side} = {limit:?}")
    };
    let ratio = |statistic: &str, effect: f64| {
        let limit = 1.0 + effect;
        format!("ratio = 'e_a', of = 'x', to = 'y', statistic = '{statistic}', below = {limit:?}")
    };
    let (median, limit) = (law.median, |effect: f64| 0.5 * (1.0 - effect));
    let share = |e| format!("share = 'e_a', of = 'x', bound = {median:?}, above = {:?}", limit(e));
    let coverage = |effect: f64| {
        let limit = 0.95 * (1.0 - effect);
        format!("value = 'a_1', of = 'x', statistic = 'coverage', above = {limit:?}")
    };
    let rms = |effect: f64| {
        let capped = value("rms", law.capped * (1.0 + effect), "below");
        if with_cap {
            format!("{capped}, cap = {:?}", 3.0 * law.rms)
        } else {
            value("rms", law.rms * (1.0 + effect), "below")
        }
    };
    let below =
        |statistic: &'static str, truth: f64| EFFECTS.map(|effect| value(statistic, truth * (1.0 + effect), "below"));
    let mean = EFFECTS.map(|effect| value("mean", law.mean * (1.0 - effect), "above"));
    let two = EFFECTS.map(|effect| ratio("median", effect));
    [
        ("median below", below("median", median)),
        ("q95 below", below("q95", law.q95)),
        ("share (50 %) above", EFFECTS.map(share)),
        (
            "median ratio below, independent",
            EFFECTS.map(|effect| ratio("paired-median", effect)),
        ),
        ("ratio of two medians below", two),
        ("coverage (95 %) above", EFFECTS.map(coverage)),
        ("mean above", mean),
        ("rms below, cap 3 rms where there is one", EFFECTS.map(rms)),
    ]
}

/// Returns the numbers of trials, each 1.41 times the one before.
fn ladder(most: u64) -> Vec<u64> {
    let steps = (0..).map(|step| (16.0 * 2_f64.powf(0.5 * f64::from(step))).round() as u64);
    steps.take_while(|trials| *trials <= most).collect()
}

/// Returns the number of trials with even odds, from the share of decided studies at each number. In the root of the
/// number of trials they rise as a normal law does, so that its mean is its median: the integral of what is undecided.
/// `None` where too few are decided at the largest number.
fn even_odds(decided: &[(u64, f64)]) -> Option<f64> {
    let roots: Vec<(f64, f64)> = decided.iter().map(|(n, p)| ((*n as f64).sqrt(), 1.0 - p)).collect();
    let area = |pair: &[(f64, f64)]| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0);
    let (first, last) = (roots.first()?, roots.last()?);
    (last.1 < 0.05).then(|| (first.0 + roots.windows(2).map(area).sum::<f64>()).powi(2))
}

/// Prints a line for each law and kind: the trials for even odds at each effect.
pub fn table(folder: &Path, studies: u32, most: u64, with_cap: bool) {
    println!(
        "{:14} {:40} {:>8} {:>8} {:>8}",
        "law", "claim, limit beside the truth by", "5 %", "10 %", "20 %"
    );
    for law in &LAWS {
        let kinds = kinds(law, with_cap);
        let x = format!("se {:?} -- {}", law.q95 / 1.959_963_984_540_054, law.words);
        let mut decided = vec![Vec::new(); kinds.len() * EFFECTS.len()];
        for trials in ladder(most) {
            let out = format!("cost/{}-{trials}", law.law);
            // The trials of the first effect are judged again for the others.
            for effect in 0..EFFECTS.len() {
                let claims = kinds.iter().map(|(_, tests)| format!("test = {{ {} }}", tests[effect]));
                let claims: Vec<String> = claims.collect();
                let text = file([&x, law.words], "4", trials, studies, &claims);
                let text = format!("looks = 1\n{text}");
                std::fs::write(folder.join("study.toml"), text).expect("a file");
                let found = verdicts(folder, &["--out", &out]);
                assert_eq!(found.len(), claims.len() * studies as usize);
                for place in 0..claims.len() {
                    let of_claim = found.iter().skip(place).step_by(claims.len());
                    let count = of_claim.filter(|(said, _)| *said == Verdict::Holds).count();
                    let share = count as f64 / f64::from(studies);
                    decided[place * EFFECTS.len() + effect].push((trials, share));
                }
            }
            std::fs::remove_dir_all(folder.join(&out)).expect("removed");
        }
        for ((kind, _), decided) in kinds.iter().zip(decided.chunks(EFFECTS.len())) {
            let most = decided[0].last().map_or(0, |(trials, _)| *trials);
            let number = |decided: &Vec<(u64, f64)>| match even_odds(decided) {
                Some(trials) => format!("{trials:8.0}"),
                None => format!("{:>8}", format!("> {}", most / 4)),
            };
            let numbers: Vec<String> = decided.iter().map(number).collect();
            println!("{:14} {kind:40} {}", law.law, numbers.join(" "));
        }
    }
}

/// By a normal law of the root: even odds at 10^2 whatever the grid.
#[test]
fn even_odds_are_where_half_are_decided() {
    let share = |n: u64| {
        // A logistic curve, symmetric about 10.
        let x = (n as f64).sqrt() - 10.0;
        1.0 / (1.0 + (-1.7 * x).exp())
    };
    let grid = |most: u64| -> Vec<(u64, f64)> { ladder(most).into_iter().map(|n| (n, share(n))).collect() };
    let found = even_odds(&grid(2000)).expect("a number");
    assert!((found - 100.0).abs() < 2.0, "{found}");
    assert_eq!(even_odds(&grid(60)), None);
}
