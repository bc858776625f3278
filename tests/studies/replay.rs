//! A replay prints the numbers that were used: e_x of every observer, computed again from its JSON.

use super::{Place, stdout, succeeds};
use serde_json::Value;

const STUDY: &str = r#"
trials = 2
measures = ["e_x_max", "e_x_rms", "rms_x"]

[settings]
plant = "mine"
process_noise = [0, 0.3]
x0_deviation = 2
noise = ["white", "slow"]
eta = 10
eta_over = "nominal"
observer_start = ["x0-hat", "zero"]
gain = "scaled:0.3"
window = 40
horizon = 80

[plants.mine]
a = [-0.7, 1.5]
b = [1.0, 0.5]
x0 = [1.0, -2.0]

[noises.slow]
numerator = [1.0, 0.5]
denominator = [1.0, -0.9]

[[methods]]
estimator = "ls"

[[methods]]
estimator = "iv"
iterations = 1
observer = ["dead-beat", "scaled:1", "poles:0.1,0.2", "kalman"]
report = [1]

[[methods]]
estimator = "bj"
orders = "nb=2,nc=1,nd=1,nf=2,nk=1"
observer = "kalman-coloured"

[[methods]]
estimator = "known"
observer = ["scaled:0.5", "kalman", "kalman-varying", "gpebo-drem:2", "gpebo-squares:0.1"]
"#;

fn numbers(of: &Value) -> Vec<f64> {
    let all = of.as_array().unwrap_or_else(|| panic!("no numbers: {of}"));
    all.iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `[0 | I; a']`, by rows.
fn companion(a: &[f64]) -> Vec<Vec<f64>> {
    let n = a.len();
    let shift = |i: usize| (0..n).map(|j| f64::from(u8::from(j == i + 1))).collect();
    let mut rows: Vec<Vec<f64>> = (0..n).map(shift).collect();
    rows[n - 1] = a.to_vec();
    rows
}

/// x(k) of a plant without noise.
fn simulated(stage: &Value) -> Vec<Vec<f64>> {
    let [a, b, mut x, u] = ["true a", "true b", "true x(0)", "u"].map(|key| numbers(&stage[key]));
    let rows = companion(&a);
    let mut next = |u: f64| {
        let new = rows.iter().zip(&b).map(|(row, b)| dot(row, &x) + b * u);
        let new = new.collect();
        std::mem::replace(&mut x, new)
    };
    u.iter().map(|u| next(*u)).collect()
}

/// F by rows, b and h of an observer.
type System = (Vec<Vec<f64>>, Vec<f64>, Vec<f64>);

fn system(stage: &Value, model: &Value) -> System {
    if stage["F"].is_null() {
        let a = numbers(&model["a"]);
        let h = (0..a.len()).map(|i| f64::from(u8::from(i == 0)));
        (companion(&a), numbers(&model["b"]), h.collect())
    } else {
        let h = numbers(&stage["h"]);
        (rows(&stage["F"]), numbers(&stage["b"]), h)
    }
}

/// The rows of a square matrix that is printed by columns.
fn rows(of: &Value) -> Vec<Vec<f64>> {
    let columns = numbers(of);
    let m = columns.len().isqrt();
    let row = |i: usize| (0..m).map(|j| columns[j * m + i]).collect();
    (0..m).map(row).collect()
}

/// The steady state's gain and P satisfy `K v = F P h + s` and `P = F P F' + Q - K v K'` with `v = h'P h + r`.
fn is_steady_state(stage: &Value, (f, _, h): &System) {
    let (p, q) = (rows(&stage["P"]), rows(&stage["Q"]));
    let (k, r) = (numbers(&stage["g"]), numbers(&stage["r"])[0]);
    let m = h.len();
    let s = if stage["E[w v]"].is_null() {
        vec![0.0; m]
    } else {
        numbers(&stage["E[w v]"])
    };
    let ph: Vec<f64> = p.iter().map(|row| dot(row, h)).collect();
    let v = dot(h, &ph) + r;
    let fp = |i: usize, j: usize| (0..m).map(|l| f[i][l] * p[l][j]).sum::<f64>();
    let size = v + q.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    for i in 0..m {
        assert!((k[i] * v - dot(&f[i], &ph) - s[i]).abs() < 1e-9 * size);
        for j in 0..m {
            let fpf: f64 = (0..m).map(|l| fp(i, l) * f[j][l]).sum();
            let next = fpf + q[i][j] - k[i] * v * k[j];
            assert!((p[i][j] - next).abs() < 1e-9 * size, "{} {next}", p[i][j]);
        }
    }
}

/// The estimates of the observer of stage 12.
fn estimated(stage: &Value, (f, b, h): &System, u: &[f64], y: &[f64]) -> Vec<Vec<f64>> {
    let mut xhat = numbers(&stage["xhat(0)"]);
    if !stage["theta_hat(K)"].is_null() {
        return gpebo(stage, f, b, &xhat, u, y);
    }
    let n = xhat.len();
    xhat.resize(h.len(), 0.0);
    let gains = if stage["g"].is_null() {
        numbers(&stage["g(k), k = 0, 1, ..."])
    } else {
        numbers(&stage["g"])
    };
    let gains: Vec<&[f64]> = gains.chunks_exact(h.len()).collect();
    let step = |(k, (u, y)): (usize, (&f64, &f64))| {
        let now = xhat[..n].to_vec();
        let g = gains[k.min(gains.len() - 1)];
        let innovation = y - dot(h, &xhat);
        let rows = f.iter().zip(b.iter().zip(g));
        xhat = rows
            .map(|(row, (b, g))| dot(row, &xhat) + b * u + g * innovation)
            .collect();
        now
    };
    u.iter().zip(y).enumerate().map(step).collect()
}

/// The estimates of GPEBO for two states: least squares by its normal equations, DREM by Cramer's rule.
fn gpebo(stage: &Value, f: &[Vec<f64>], b: &[f64], x0: &[f64], u: &[f64], y: &[f64]) -> Vec<Vec<f64>> {
    let det = |m: [[f64; 2]; 2]| m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let cramer = |m: [[f64; 2]; 2], z: [f64; 2]| {
        [
            det([[z[0], m[0][1]], [z[1], m[1][1]]]),
            det([[m[0][0], z[0]], [m[1][0], z[1]]]),
        ]
    };
    let times = |x: [f64; 2]| [0, 1].map(|i| dot(&f[i], &x));
    let (mut xi, mut columns) = ([x0[0], x0[1]], [[1.0, 0.0], [0.0, 1.0]]);
    let (mut theta, mut last, mut sums, mut sum) = ([0.0; 2], None, [[0.0; 2]; 2], [0.0; 2]);
    let mut all = vec![];
    for (u, y) in u.iter().zip(y) {
        let state = |i: usize| xi[i] + columns[0][i] * theta[0] + columns[1][i] * theta[1];
        all.push(vec![state(0), state(1)]);
        let (phi, z) = (columns.map(|column| column[0]), y - xi[0]);
        if stage["rho"].is_null() {
            let gamma = numbers(&stage["gamma"])[0];
            if let Some((before, z_before)) = last {
                let (m, zbar) = ([phi, before], [z, z_before]);
                let (delta, mixed) = (det(m), cramer(m, zbar));
                let error = |i: usize| mixed[i] - delta * theta[i];
                let rate = gamma * delta / (1.0 + gamma * delta * delta);
                theta = [theta[0] + rate * error(0), theta[1] + rate * error(1)];
            }
            last = Some((phi, z));
        } else {
            let rho = numbers(&stage["rho"])[0];
            for i in 0..2 {
                sum[i] += phi[i] * z;
                for j in 0..2 {
                    sums[i][j] += phi[i] * phi[j];
                }
            }
            let m = [[sums[0][0] + rho, sums[0][1]], [sums[1][0], sums[1][1] + rho]];
            theta = cramer(m, sum).map(|x| x / det(m));
        }
        let next = times(xi);
        xi = [next[0] + b[0] * u, next[1] + b[1] * u];
        columns = columns.map(times);
    }
    all
}

/// `||x - xhat|| / ||x||` at most and its root mean square, and the root mean square of `||x - xhat||`, from k = N on.
fn errors(x: &[Vec<f64>], xhat: &[Vec<f64>]) -> [f64; 3] {
    let norm = |v: &[f64]| dot(v, v).sqrt();
    let pairs: Vec<(f64, f64)> = x
        .iter()
        .zip(xhat)
        .skip(40)
        .map(|(x, xhat)| {
            let difference: Vec<f64> = x.iter().zip(xhat).map(|(a, b)| a - b).collect();
            (norm(&difference), norm(x))
        })
        .collect();
    let count = pairs.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    [
        pairs.iter().map(|(e, x)| e / x).fold(0.0, f64::max),
        mean(&|(e, x)| (e / x).powi(2)).sqrt(),
        mean(&|(e, _)| e * e).sqrt(),
    ]
}

#[test]
fn the_errors_of_every_observer_follow_from_a_replay() {
    let place = Place::new();
    place.write("study.toml", STUDY.as_bytes());
    succeeds(&place.run(&["run", "study.toml", "--out", "out"]));
    let mut gains = vec![];
    for cell in 0..8 {
        let output = place.run(&["replay", "out", &format!("{cell}:1"), "--format", "json"]);
        succeeds(&output);
        let replay: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        let stages = replay["stages"].as_array().expect("stages");
        let data = &stages[0];
        let noisy = replay["cell"]["settings"]["process_noise"] != 0;
        let key = "x(k), k = 0, 1, ...";
        assert_eq!(noisy, !data[key].is_null());
        let x = if noisy {
            let flat = numbers(&data[key]);
            flat.chunks_exact(2).map(<[f64]>::to_vec).collect()
        } else {
            simulated(data)
        };
        let [u, y] = ["u", "y"].map(|key| numbers(&data[key]));
        // The only passes that are reported are the last of each method.
        let mut seen = 0;
        for row in replay["rows"].as_array().expect("rows") {
            let name = row["estimator"].as_str().expect("a name");
            let of = format!("{name} pass {}", row["pass"]);
            let find = |part: &str| {
                let is = |stage: &&Value| {
                    let title = stage["stage"].as_str().expect("a title");
                    title.contains(part) && title.contains(&format!(" {of}:"))
                };
                let found = stages.iter().find(is);
                found.unwrap_or_else(|| panic!("no {part} of {of} in cell {cell}"))
            };
            let (model, stage) = (find(": parameters"), find("Stage 12"));
            let system = system(stage, model);
            let found = errors(&x, &estimated(stage, &system, &u, &y));
            for (measure, found) in ["e_x_max", "e_x_rms", "rms_x"].iter().zip(found) {
                let stored = row[measure].as_f64().expect("a measure");
                let off = (found / stored - 1.0).abs();
                assert!(off < 1e-9, "cell {cell} {of} {measure}: {found} {stored}");
            }
            gains.push((cell, format!("{}{}", stage["g"], stage["theta_hat(K)"])));
            if name.contains("kalman") {
                let ratio = &stage["rho"];
                assert_eq!(ratio.is_null(), name.starts_with("known"));
                if !name.contains("varying") {
                    is_steady_state(stage, &system);
                }
            }
            seen += 1;
        }
        assert_eq!(seen, 11);
    }
    // The observers of a cell are different ones, except that a steady Kalman filter without process noise is the model
    // alone.
    let mut own = gains.clone();
    own.sort();
    own.dedup();
    assert!(own.len() >= 8 * 6, "{own:?}");
}

/// FIT of predictions: of least squares by iterating its equation from the samples that are known.
#[test]
fn predictions_ahead_follow_from_a_replay() {
    let place = Place::new();
    let study = STUDY
        .split("\n[[methods]]")
        .next()
        .expect("settings")
        .replace("\"e_x_max\", \"e_x_rms\", \"rms_x\"", "\"fit_ahead\"")
        .replace("horizon = 80", "horizon = 80\nahead = [1, 4]");
    place.write(
        "study.toml",
        format!("{study}\n[[methods]]\nestimator = \"ls\"\n").as_bytes(),
    );
    succeeds(&place.run(&["run", "study.toml", "--out", "out"]));
    let mut seen = [0; 2];
    for cell in 0..16 {
        let output = place.run(&["replay", "out", &format!("{cell}:1"), "--format", "json"]);
        succeeds(&output);
        let replay: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        let ahead = replay["cell"]["settings"]["ahead"].as_u64().unwrap_or(1) as usize;
        let stages = replay["stages"].as_array().expect("stages");
        let [u, y] = ["u", "y"].map(|key| numbers(&stages[0][key]));
        let is_model = |stage: &&Value| stage["stage"].as_str().is_some_and(|of| of.contains(": parameters"));
        let model = stages.iter().find(is_model).expect("parameters");
        let (a, h) = (numbers(&model["a"]), numbers(&model["h"]));
        let (mut errors, mut spread) = (0.0, 0.0);
        let mean = y[40..].iter().sum::<f64>() / 40.0;
        for k in 40..80 {
            let mut known = y[..=k - ahead].to_vec();
            for now in k + 1 - ahead..=k {
                known.push(a[1] * known[now - 1] + a[0] * known[now - 2] + h[0] * u[now - 1] + h[1] * u[now - 2]);
            }
            errors += (y[k] - known[k]).powi(2);
            spread += (y[k] - mean).powi(2);
        }
        let fit = 100.0 * (1.0 - f64::sqrt(errors / spread));
        let stored = replay["rows"][0]["fit_ahead"].as_f64().expect("a measure");
        assert!((fit - stored).abs() < 1e-8, "cell {cell}: {fit} {stored}");
        seen[usize::from(ahead > 1)] += 1;
    }
    assert_eq!(seen, [8, 8]);
    place.refuses_file(
        "measures = [\"fit_ahead\"]\n[settings]\nahead = 0",
        &["ahead", "expected a number of samples"],
    );
    place.refuses_file(
        "measures = [\"fit_ahead\"]\n[settings]\nwindow = 98\nhorizon = 98",
        &["horizon", "fit_ahead"],
    );
}
