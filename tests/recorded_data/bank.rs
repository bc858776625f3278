//! Simulated records as engineers have them (`bank/`: step tests, tanks, motors, heat exchangers, arms, drift, loops,
//! direct terms, outliers, gaps, fast and slow sampling, units), made by another program, with their truths and the
//! standard errors of a fit of the right structure. Whoever does what the hints of `asobench estimate` say ends at the
//! truth.

use crate::common::asobench_in;
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

/// A record: the first command on it, and its gain, per second of an integrator.
#[derive(Deserialize)]
struct Case {
    id: u32,
    file: String,
    first: Vec<String>,
    ts: f64,
    integrator: bool,
    gain: f64,
    gain_se: f64,
}

/// Flags that a follower takes over from a hint.
const TAKEN: [&str; 6] = [
    "--delay",
    "--detrend",
    "--initial",
    "--missing",
    "--offset",
    "--operating-point",
];

/// Hints are followed so often.
const STEPS: usize = 6;

/// The answer of `estimate`: its only estimate, if there is one, and its advice, warnings first.
fn ask(folder: &Path, flags: &[String]) -> (Option<Value>, Vec<String>) {
    let mut arguments = vec!["estimate", "record.csv", "--format", "json"];
    arguments.extend(flags.iter().map(String::as_str));
    let output = asobench_in(folder, &arguments);
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    let Ok(report) = serde_json::from_slice::<Value>(&output.stdout) else {
        return (None, vec![said]);
    };
    let estimate = report["estimates"][0].clone();
    let mut advice: Vec<String> = said.lines().map(str::to_owned).collect();
    let hints = estimate["hints"].as_array().into_iter().flatten();
    advice.extend(hints.filter_map(|hint| Some(hint.as_str()?.to_owned())));
    (Some(estimate), advice)
}

/// Sets the flags that a piece of advice names. Returns whether any changed.
fn take(flags: &mut Vec<String>, advice: &str) -> bool {
    let words: Vec<&str> = advice
        .split_whitespace()
        .map(|word| word.trim_matches([',', ';', '.', ':', '(', ')']))
        .collect();
    let mut changed = false;
    for pair in words.windows(2).filter(|pair| TAKEN.contains(&pair[0])) {
        // Of the ways to treat missing samples the one that leaves out least.
        let value = if pair[0] == "--missing" { "equations" } else { pair[1] };
        match flags.iter().position(|flag| flag == pair[0]) {
            Some(place) if flags[place + 1] == value => {}
            Some(place) => {
                flags[place + 1] = String::from(value);
                changed = true;
            }
            None => {
                flags.extend([pair[0], value].map(str::to_owned));
                changed = true;
            }
        }
    }
    changed
}

/// Empties the last cell, that of y, of the lines that a hint on outliers names. Returns whether there are any.
fn empty(path: &Path, advice: &str) -> bool {
    let Some((_, rest)) = advice.split_once(", line ").filter(|_| advice.contains(", y = ")) else {
        return false;
    };
    let others = rest.split_once("so have lines ").or(rest.split_once("so has line "));
    let others = others.map_or("", |(_, lines)| lines.split([':', 'a']).next().unwrap_or_default());
    let numbers = rest.split(',').take(1).chain(others.split(','));
    let text = std::fs::read_to_string(path).expect("a file");
    let mut lines: Vec<String> = text.split('\n').map(str::to_owned).collect();
    for number in numbers.filter_map(|number| number.trim().parse::<usize>().ok()) {
        let line = &mut lines[number - 1];
        line.truncate(line.rfind(',').expect("cells") + 1);
    }
    std::fs::write(path, lines.join("\n")).expect("written");
    true
}

/// How far the gain is from the truth.
fn error(case: &Case, estimate: &Value) -> f64 {
    if !case.integrator {
        return estimate["static_gain"]
            .as_f64()
            .map_or(f64::INFINITY, |gain| gain - case.gain);
    }
    let numbers = |key: &str| -> Vec<f64> {
        let list = estimate["model"][key].as_array().into_iter().flatten();
        list.filter_map(Value::as_f64).collect()
    };
    // B(1) over what F(q) / (1 - q^-1) is at q = 1: minus the derivative of F in q^-1, for a pole at 1.
    let slope: f64 = numbers("F").iter().zip(0..).map(|(f, i)| f64::from(i) * f).sum();
    numbers("B").iter().sum::<f64>() / -slope / case.ts - case.gain
}

#[test]
fn a_follower_of_hints_ends_at_the_truth() {
    let bank = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/bank");
    let cases = std::fs::read(bank.join("bank.json")).expect("a file");
    let cases: Vec<Case> = serde_json::from_slice(&cases).expect("cases");
    assert_eq!(cases.len(), 40);
    let (mut right, mut further) = (0, Vec::new());
    for case in &cases {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("record.csv");
        std::fs::copy(bank.join(&case.file), &path).expect("a copy");
        let mut flags = case.first.clone();
        let (first, mut advice) = ask(folder.path(), &flags);
        let mut last = first.clone();
        for _ in 0..STEPS {
            let follows = advice.iter().any(|advice| {
                if empty(&path, advice) {
                    take(&mut flags, "--missing equations");
                    return true;
                }
                take(&mut flags, advice)
            });
            if !follows {
                break;
            }
            (last, advice) = ask(folder.path(), &flags);
        }
        let off = |estimate: &Option<Value>| estimate.as_ref().map_or(f64::INFINITY, |of| error(case, of).abs());
        // Records without noise are right to the digits of their numbers.
        let within = 3.0 * case.gain_se + 1e-9 * case.gain.abs();
        let (begin, end) = (off(&first), off(&last));
        // No model of a loop with a constant setpoint is right, but its refusal.
        let refused = advice.iter().any(|advice| advice.contains("setpoint"));
        println!(
            "{}: {:.2} se, then {:.2} se {flags:?}",
            case.id,
            begin / case.gain_se,
            end / case.gain_se
        );
        right += u32::from(end <= within || refused);
        if end > begin + within {
            further.push(case.id);
        }
    }
    assert!(further.is_empty(), "ended further off than they began: {further:?}");
    assert!(right >= 36, "{right} of 40");
}
