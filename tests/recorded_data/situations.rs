//! Advice and numbers of `estimate` on records whose properties hold by construction.

use super::hints::Noise;
use crate::common::{asobench_in, stderr, stdout};
use serde_json::Value;
use std::fmt::Write;
use tempfile::TempDir;

/// A folder with `record.csv`: u, and `y = B/F u' + level + sd e`, u' being u less its first value.
fn record(b: &[f64], f: &[f64], u: &[f64], (level, sd): (f64, f64)) -> TempDir {
    let mut noise = Noise(11);
    let mut x: Vec<f64> = Vec::new();
    let text = (0..u.len()).fold("u,y\n".to_owned(), |mut text, k| {
        let of_u: f64 = b.iter().zip((0..=k).rev()).map(|(b, k)| b * (u[k] - u[0])).sum();
        let of_x: f64 = f[1..].iter().zip(x.iter().rev()).map(|(f, x)| f * x).sum();
        x.push(of_u - of_x);
        let _ = writeln!(text, "{},{:.12}", u[k], x[k] + level + sd * noise.next());
        text
    });
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("record.csv"), text).expect("written");
    folder
}

fn said(folder: &TempDir, flags: &str) -> String {
    let arguments: Vec<&str> = ["estimate", "record.csv"]
        .into_iter()
        .chain(flags.split_whitespace())
        .collect();
    let output = asobench_in(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    // Lines are wrapped.
    let text = stdout(&output);
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn estimate(folder: &TempDir, flags: &str) -> Value {
    let text = said(folder, &format!("{flags} --format json"));
    serde_json::from_str::<Value>(&text).expect("JSON")["estimates"][0].clone()
}

/// Poles of 0.95 and 0.9, gain 3, of u from 40 to 45.
fn step_from_an_operating_point() -> TempDir {
    let u: Vec<f64> = (0..200).map(|k| if k < 20 { 40.0 } else { 45.0 }).collect();
    record(&[0.0, 0.01, 0.005], &[1.0, -1.85, 0.855], &u, (65.0, 0.05))
}

/// Whether the gain is 3 within three standard errors.
fn has_gain_3(of: &Value) -> bool {
    let [gain, error] = ["static_gain", "static_gain_se"].map(|key| of[key].as_f64().expect("a number"));
    error > 0.0 && (gain - 3.0).abs() < 3.0 * error
}

/// The offset alone does not make such a record begin at rest. The start is fitted where the method may choose, so the
/// best delay is not at the end of the range, and where it may not a hint says it.
#[test]
fn an_offset_does_not_hide_the_start() {
    let folder = step_from_an_operating_point();
    let of = estimate(&folder, "--estimator oe --order 2 --offset estimate");
    let loss = of["loss"].as_f64().expect("a number");
    assert!(has_gain_3(&of) && (loss / 0.0025 - 1.0).abs() < 0.4, "{of}");
    let text = said(&folder, "--estimator oe --order 2 --delay 1:6 --offset estimate");
    assert!(!text.contains("the largest of the range"), "{text}");
    let of = estimate(&folder, "--estimator oe --order 2 --offset estimate --initial zero");
    assert!(of["hints"].to_string().contains("--initial estimate"), "{of}");
}

/// A pole and a zero near 1 are an offset where it has the lower BIC; the flags that the hint names lead to the gain. A
/// slow part of a plant is none.
#[test]
fn a_pole_and_a_zero_are_an_offset_by_bic() {
    let folder = step_from_an_operating_point();
    let of = estimate(&folder, "--estimator oe --order 3 --initial zero");
    let hints = of["hints"].to_string();
    let flags = "--operating-point 40,0 --offset estimate";
    assert!(hints.contains(flags), "{of}");
    assert!(has_gain_3(&estimate(
        &folder,
        &format!("--estimator oe --order 2 {flags}")
    )));
    let mut noise = Noise(5);
    let mut level = 0.0;
    let slow: Vec<f64> = (0..3000)
        .map(|k| {
            if k > 0 && k % 20 == 0 {
                level = noise.next().signum();
            }
            level
        })
        .collect();
    let folder = record(
        &[0.0, 0.108917, -0.108557],
        &[1.0, -1.81773, 0.817914],
        &slow,
        (0.0, 0.02),
    );
    for estimator in ["oe", "armax"] {
        let of = estimate(&folder, &format!("--estimator {estimator} --order 2"));
        assert!(!of["hints"].to_string().contains("offset"), "{of}");
    }
}

/// A pole at 1 has no damping, no time constant and no static gain.
#[test]
fn an_integrator_has_no_static_gain() {
    let u: Vec<f64> = (0..400)
        .map(|k| f64::from(u8::from((20..120).contains(&k))) - f64::from(u8::from((200..280).contains(&k))))
        .collect();
    let folder = record(&[0.0, 0.005, 0.0045], &[1.0, -1.9, 0.9], &u, (0.0, 0.0));
    let text = said(&folder, "--estimator arx --order 2 --ts 0.5");
    assert!(text.contains("static gain none: an integrator"), "{text}");
    assert!(
        text.contains("frequencies an integrator") && !text.contains("NaN"),
        "{text}"
    );
    assert!(estimate(&folder, "--estimator arx --order 2")["static_gain"].is_null());
}

/// A gap needs methods that take several parts: without `--estimator` one of them is taken. An outlier of a part is
/// named with its line in the file.
#[test]
fn equations_beside_a_gap_need_no_estimator() {
    let mut noise = Noise(3);
    // At rest at first, so that nothing but the outlier is left to say.
    let u: Vec<f64> = (0..300).map(|k| if k == 0 { 0.0 } else { noise.next() }).collect();
    let folder = record(&[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7], &u, (0.0, 0.1));
    let path = folder.path().join("record.csv");
    let text = std::fs::read_to_string(&path).expect("a file");
    let lines = text.lines().enumerate();
    let lines = lines.map(|(i, line)| {
        let (u, y) = line.split_once(',').expect("two cells");
        match i {
            100 => format!("{u},"),
            200 => format!("{u},{}", y.parse::<f64>().expect("a number") + 3.0),
            _ => line.to_owned(),
        }
    });
    std::fs::write(&path, lines.collect::<Vec<_>>().join("\n")).expect("written");
    let text = said(&folder, "--order 2 --missing equations");
    assert!(text.contains("arx: Least squares"), "{text}");
    // Least squares of an output error are biased: robust standard errors do not help alone.
    assert!(text.contains("least squares are biased then"), "{text}");
    let text = said(&folder, "--estimator oe --order 2 --missing equations");
    // The header is line 1.
    assert!(text.contains(", line 201, has a residual of"), "{text}");
}
