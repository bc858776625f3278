//! Hints of `estimate` on a hard record, statuses, the test for feedback. The records have these properties by
//! construction.

use crate::common::PROGRAM;
use std::fmt::Write;
use std::process::{Command, Stdio};

/// Noise with the same bits everywhere: a linear congruential generator (Knuth's constants), and the sum of twelve
/// uniform numbers less 6.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn next(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6364136223846793005);
            self.0 = self.0.wrapping_add(1442695040888963407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum - 6.0
    }
}

/// `A y = B u + C e` from rest, `u = r - gain y`.
struct Plant {
    a: &'static [f64],
    b: &'static [f64],
    c: &'static [f64],
    sd: f64,
    gain: f64,
    step: bool,
}

const PLANT: Plant = Plant {
    a: &[-1.5, 0.7],
    b: &[1.0, 0.5],
    c: &[1.0, -1.5, 0.7],
    sd: 0.3,
    gain: 0.0,
    step: false,
};

impl Plant {
    /// Samples `cut..n` as CSV.
    fn record(&self, seed: u64, n: usize, cut: usize) -> String {
        let mut noise = Noise(seed);
        let (mut u, mut y, mut e) = (vec![], vec![], vec![]);
        let before = |signal: &[f64], k: usize, lag: usize| if k < lag { 0.0 } else { signal[k - lag] };
        for k in 0..n {
            e.push(self.sd * noise.next());
            let reference = noise.next();
            let mut now = 0.0;
            for (lag, c) in self.c.iter().enumerate() {
                now += c * before(&e, k, lag);
            }
            for (lag, b) in self.b.iter().enumerate() {
                now += b * before(&u, k, lag + 1);
            }
            for (lag, a) in self.a.iter().enumerate() {
                now -= a * before(&y, k, lag + 1);
            }
            y.push(now);
            u.push(if self.step { 1.0 } else { reference - self.gain * now });
        }
        let mut text = "u,y\n".to_owned();
        for (u, y) in u.iter().zip(&y).skip(cut) {
            writeln!(text, "{u:?},{y:?}").expect("a string");
        }
        text
    }
}

/// The exit code, stderr, and of stdout the hints, the status and the tests of residuals.
fn said(record: &str, arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("z.csv"), record).expect("a file");
    let mut command = Command::new(PROGRAM);
    command.current_dir(&folder).stdin(Stdio::null());
    command.args(["estimate", "z.csv"]).args(arguments);
    let output = command.output().expect("the program runs");
    let mut text = format!("$ estimate z.csv {}\n", arguments.join(" "));
    text += &String::from_utf8_lossy(&output.stderr);
    let mut shown = false;
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        // Continued lines are indented by more than the headings.
        if !line.get(..10).unwrap_or(line).trim().is_empty() {
            let heading = line.trim();
            shown = ["hint", "status", "residuals", "FAILED"]
                .iter()
                .any(|h| heading.starts_with(h));
        }
        if shown {
            text += line;
            text.push('\n');
        }
    }
    writeln!(text, "exit {}\n", output.status.code().expect("a code")).expect("a string");
    text
}

#[test]
fn hints_and_statuses() {
    let integrator = Plant {
        a: &[-1.5, 0.5],
        c: &[1.0],
        sd: 0.1,
        ..PLANT
    };
    let step = Plant {
        sd: 0.05,
        step: true,
        ..PLANT
    };
    let closed_loop = Plant {
        a: &[-0.8],
        b: &[0.5],
        c: &[1.0, 0.6],
        sd: 0.5,
        gain: 0.4,
        ..PLANT
    };
    let zero_at_one = Plant {
        c: &[1.0, -1.0],
        ..PLANT
    };
    let loud = |sd| Plant { sd, ..PLANT };
    let (cut, step) = (PLANT.record(2, 500, 100), step.record(3, 200, 0));
    let closed_loop = closed_loop.record(4, 800, 0);
    let arx = ["--estimator", "arx", "--order", "2"];
    let iv4 = ["--estimator", "iv4", "--order", "2", "--stabilise", "none"];
    let armax = ["--estimator", "armax", "--orders", "na=2,nb=2,nc=1,nk=1"];
    let text = [
        said(&integrator.record(1, 500, 0), &arx),
        said(&cut, &["--estimator", "oe", "--order", "2"]),
        said(&cut, &["--estimator", "oe", "--order", "2", "--initial", "estimate"]),
        said(&step, &arx),
        said(&step, &["--estimator", "oe", "--order", "2"]),
        said(&closed_loop, &["--estimator", "iv4", "--order", "1"]),
        said(&closed_loop, &["--estimator", "oe", "--order", "1"]),
        said(&zero_at_one.record(5, 300, 0), &armax),
        said(&loud(6.0).record(27, 60, 0), &["--estimator", "sriv", "--order", "2"]),
        said(&loud(20.0).record(3, 40, 0), &iv4),
    ];
    insta::assert_snapshot!(text.concat());
}

/// A record of `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)`, u with ten decimals, y with six.
fn exact(input: impl Fn(usize) -> f64, change: impl Fn(usize, f64) -> f64) -> String {
    let u: Vec<f64> = (0..200).map(|k| (input(k) * 1e10).round() / 1e10).collect();
    let mut y = vec![0.0; u.len()];
    let mut text = "u,y\n".to_owned();
    for k in 0..u.len() {
        let before = |signal: &[f64], lag: usize| k.checked_sub(lag).map_or(0.0, |k| signal[k]);
        y[k] = 1.5 * before(&y, 1) - 0.7 * before(&y, 2) + before(&u, 1) + 0.5 * before(&u, 2);
        writeln!(text, "{},{:.6}", u[k], change(k, y[k])).expect("a string");
    }
    text
}

/// One sine is refused in the same words by every subspace method, a record without noise is not tested, an outlier is
/// named with its line, and a plant that acts at once is shown the way to nk = 0.
#[test]
fn excitation_exactness_and_outliers_are_said() {
    let same = |_, y| y;
    let mut noise = Noise(58);
    let white: Vec<f64> = (0..200).map(|_| noise.next()).collect();
    let sine = exact(|k| 2.0 * (0.4 * k as f64).sin(), same);
    for method in ["n4sid", "moesp", "cva", "ssarx", "parsim-k"] {
        let text = said(&sine, &["--estimator", method, "--order", "2"]);
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains("rank-deficient"), "{text}");
        assert!(text.contains("u excites order 2,"), "{text}");
    }
    let binary = |k: usize| white[k].signum();
    let oe = ["--estimator", "oe", "--order", "2"];
    let text = said(&exact(binary, same), &oe);
    assert!(text.contains("fit to the rounding of the record's numbers"), "{text}");
    assert!(!text.contains("white") && !text.contains("hint"), "{text}");
    let mut more = Noise(59);
    let errors: Vec<f64> = (0..200).map(|_| 0.1 * more.next()).collect();
    let outlier = exact(binary, |k, y| if k == 59 { -9999.0 } else { y + errors[k] });
    let text = said(&outlier, &["--estimator", "arx", "--order", "2"]);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        text.contains("sample k = 59, line 61, y = -9999, has a residual of"),
        "{text}"
    );
    let direct = exact(binary, |k, y| y + errors[k] + 0.8 * binary(k));
    let text = said(&direct, &oe);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        text.contains("u acts at once (nk = 0: --delay 0), or a controller"),
        "{text}"
    );
    let with_direct = said(&direct, &["--estimator", "oe", "--order", "2", "--delay", "0"]);
    assert!(with_direct.contains("no sign of feedback"), "{with_direct}");
    let table = said(&direct, &["--estimator", "oe", "--order", "2", "--delay", "0:2"]);
    assert!(table.contains("exit 0"), "{table}");
}
