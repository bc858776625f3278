//! Defaults of estimators compared over two banks of six plants and three lengths:
//!
//!     cargo run --release -p asobench-identification --features json --example defaults -- \
//!         BANK ESTIMATOR TRIALS [OPTION=VALUE,...]...
//!
//! BANK is `a`, on which defaults were chosen, or `b`, on which they are shown; `a3` is one plant of it. Each variant
//! of the options is a line: for each length the share of models that are off by more than six bounds or missing, and
//! the rms of the others over the bound. The distance of a model is that of its output without noise from the true one,
//! `sqrt(sum (y - y0)^2 / (d s^2))` with d parameters and noise of variance s^2, which tends to 1 for an efficient
//! method; with a noise model, that of its prediction errors from the true ones.

use asobench_identification::estimator::{EstimatorName, Method, Pass, Progress, Shape, Window};
use asobench_identification::model::polynomial::{divide, filter, multiply};
use asobench_identification::model::{LinearModel, Orders};
use asobench_identification::signal::{Purpose, fill_white, stream};
use serde_json::{Map, Value, json};

/// Factors of F, and B from q^-1 on.
type Plant = (&'static [&'static [f64]], &'static [f64]);

const A: [Plant; 6] = [
    (&[&[1.0, -1.5, 0.7]], &[1.0, 0.5]),
    (&[&[1.0, -0.8]], &[1.0]),
    (&[&[1.0, -1.8, 0.9]], &[0.1, 0.08]),
    (&[&[1.0, -0.9], &[1.0, -0.5]], &[0.5, -0.3]),
    (&[&[1.0, -1.6, 0.8], &[1.0, -0.6, 0.5]], &[1.0, 0.4, 0.2, -0.3]),
    (&[&[1.0, -1.3, 0.6], &[1.0, 0.5]], &[1.0, -0.8, 0.4]),
];
const B: [Plant; 6] = [
    (&[&[1.0, -1.7, 0.8]], &[1.0, -0.6]),
    (&[&[1.0, -0.95]], &[0.2]),
    (&[&[1.0, -1.2, 0.85]], &[0.5, 1.0]),
    (&[&[1.0, -0.8], &[1.0, -0.7]], &[1.0, 0.9]),
    (&[&[1.0, -1.9, 0.95], &[1.0, -1.0, 0.7]], &[0.2, 0.3, 0.1, 0.1]),
    (&[&[1.0, 0.6], &[1.0, -1.1, 0.5]], &[1.0, 0.2, -0.5]),
];

/// The standard deviation of the noise beside that of the output.
const NOISE: f64 = 0.3;

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

struct Record {
    /// B/F of the truth, and as the estimator has it.
    truth: LinearModel,
    u: Vec<f64>,
    y: Vec<f64>,
    r: Vec<f64>,
    /// The input without the noise of its measurement.
    input: Vec<f64>,
    deviation: f64,
}

/// Records in open loop, with a slow input, in a loop, with a noise in u, or with the noise `C/A e`, `C = 1 + c q^-1`.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Open,
    Slow,
    Loop,
    Errors,
    Equation(f64),
}

fn record((factors, b): Plant, kind: Kind, n: usize, trial: u64) -> Record {
    let f = factors.iter().fold(vec![1.0], |f, factor| multiply(&f, factor));
    let orders = Orders {
        nb: b.len(),
        nf: f.len() - 1,
        nk: 1,
        ..Orders::default()
    };
    let mut truth = LinearModel::zero(orders);
    truth.set_parameters(&[b, &f[1..]].concat());
    let white = |purpose, deviation| {
        let mut signal = vec![0.0; n];
        fill_white(&mut stream(7, trial, purpose), deviation, &mut signal);
        signal
    };
    let (mut r, e) = (white(Purpose::Input, 1.0), white(Purpose::NoiseDrive, 1.0));
    if kind == Kind::Slow {
        divide(&[1.0, -0.9], &mut r);
    }
    let mut y = vec![0.0; n];
    truth.simulate(&r, &mut y);
    let deviation = NOISE * rms(&y);
    let noise: Vec<f64> = e.iter().map(|e| deviation * e).collect();
    let (mut u, mut measured) = (r.clone(), vec![0.0; n]);
    match kind {
        Kind::Loop => {
            let gain = 0.3 / truth.static_gain();
            // The output follows from earlier inputs.
            for k in 0..n {
                let sum = |c: &[f64], x: &[f64]| -> f64 {
                    let lags = c.iter().enumerate().skip(1).filter(|(i, _)| *i <= k);
                    lags.map(|(i, c)| c * x[k - i]).sum()
                };
                y[k] = sum(&truth.b, &u) - sum(&truth.f, &y);
                u[k] = r[k] - gain * (y[k] + noise[k]);
            }
        }
        Kind::Equation(c) => {
            let mut coloured = vec![0.0; n];
            filter(&[1.0, c], &noise, &mut coloured);
            let mut of_noise = LinearModel::zero(orders);
            of_noise.f.clone_from(&f);
            of_noise.b = vec![1.0];
            of_noise.delay = 0;
            of_noise.simulate(&coloured, &mut measured);
            measured.iter_mut().zip(&y).for_each(|(v, y)| *v += y);
            y.clone_from(&measured);
        }
        _ => {}
    }
    let input = u.clone();
    if kind == Kind::Errors {
        u.iter_mut().zip(white(Purpose::Plant, 0.3)).for_each(|(u, v)| *u += v);
    }
    if !matches!(kind, Kind::Equation(_)) {
        y.iter_mut().zip(&noise).for_each(|(y, e)| *y += e);
    }
    Record {
        truth,
        u,
        y,
        r,
        input,
        deviation,
    }
}

/// The distance of a model from the truth in bounds.
fn distance(record: &Record, model: &LinearModel, kind: Kind) -> f64 {
    let n = record.u.len();
    let [mut own, mut exact, mut scratch] = [(); 3].map(|()| vec![0.0; n]);
    if let Kind::Equation(c) = kind {
        let mut truth = LinearModel::zero(model.orders());
        truth.a.clone_from(&record.truth.f);
        truth.b.clone_from(&record.truth.b);
        truth.c = vec![1.0, c];
        model.residuals(&record.u, &record.y, &mut own, &mut scratch);
        truth.residuals(&record.u, &record.y, &mut exact, &mut scratch);
    } else {
        let mut plant = record.truth.clone();
        plant.b.clone_from(&model.b);
        plant.f = model.denominator();
        plant.simulate(&record.input, &mut own);
        record.truth.simulate(&record.input, &mut exact);
    }
    let d = model.orders().parameters() as f64;
    let difference: Vec<f64> = own.iter().zip(&exact).map(|(x, y)| x - y).collect();
    rms(&difference) / record.deviation * (n as f64 / d).sqrt()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bank, estimator, trials, variants @ ..] = &arguments[..] else {
        return Err("expected BANK ESTIMATOR TRIALS [OPTION=VALUE,...]...".into());
    };
    let name: EstimatorName = estimator.parse()?;
    let (all, one) = bank.split_at(1);
    let bank = if all == "a" { A } else { B };
    let (one, trials) = (one.parse::<usize>().ok(), trials.parse::<u64>()?);
    let (kind, lengths) = match estimator.as_str() {
        "two-stage" | "joint" | "clriv" => (Kind::Loop, [60, 200, 1000]),
        "bels" | "iv-compensated" => (Kind::Errors, [300, 1000, 3000]),
        "n4sid" | "moesp" => (Kind::Slow, [200, 1000, 5000]),
        "rels" | "armax" => (Kind::Equation(-0.5), [200, 1000, 5000]),
        "recursive-iv" | "arx" => (Kind::Equation(0.0), [200, 1000, 5000]),
        _ => (Kind::Open, [200, 1000, 5000]),
    };
    println!(
        "| {estimator} | {} |",
        lengths.map(|n| format!("N = {n}: off | rms")).join(" | ")
    );
    let own = [String::new()];
    for variant in if variants.is_empty() { &own } else { variants } {
        let mut options = Map::new();
        for pair in variant.split(',').filter(|pair| pair.contains('=')) {
            let (key, value) = pair.split_once('=').unwrap_or_default();
            options.insert(
                key.to_owned(),
                serde_json::from_str(value).unwrap_or(Value::from(value)),
            );
        }
        let mut line = format!("| {} |", if variant.is_empty() { "default" } else { variant });
        for n in lengths {
            let (mut off, mut sum, mut all) = (0, 0.0, 0);
            let plants = bank.into_iter().enumerate();
            for (i, plant) in plants.filter(|(i, _)| one.is_none_or(|one| one == i + 1)) {
                for trial in 0..trials {
                    let record = record(plant, kind, n, 1000 * i as u64 + trial);
                    let orders = record.truth.orders();
                    let mut options = options.clone();
                    let (nb, nf) = (orders.nb, orders.nf);
                    let text = if kind == Kind::Equation(-0.5) {
                        format!("na={nf},nb={nb},nc=1,nk=1")
                    } else if matches!(estimator.as_str(), "n4sid" | "moesp" | "cva") {
                        format!("n={nf},nk=1")
                    } else if matches!(estimator.as_str(), "arx" | "recursive-iv" | "bels" | "iv-compensated") {
                        format!("na={nf},nb={nb},nk=1")
                    } else {
                        format!("nb={nb},nf={nf},nk=1")
                    };
                    options.insert("orders".to_owned(), json!(text));
                    let method = Method::named("own", name.parse(options)?);
                    let mut estimator = method.prepare(Shape { order: nf, window: n })?;
                    let mut passes = vec![Pass::new(nf); method.passes()];
                    let window = Window::with_reference(&record.u, &record.y, &record.r, n);
                    estimator.estimate(window, &mut passes);
                    let pass = passes.pop().ok_or("no pass")?;
                    let known = pass.progress >= Progress::Parameters;
                    let far = if known {
                        distance(&record, &pass.model, kind)
                    } else {
                        f64::INFINITY
                    };
                    all += 1;
                    if far < 6.0 {
                        sum += far * far;
                    } else {
                        off += 1;
                    }
                }
            }
            let rest = (sum / f64::from((all - off).max(1))).sqrt();
            let share = 100.0 * f64::from(off) / f64::from(all);
            line.extend([format!(" {share:.1} % | {rest:.2} |")]);
        }
        println!("{line}");
    }
    Ok(())
}
