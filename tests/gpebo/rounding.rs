//! Rounding of badly conditioned exponentials is part of the step error.

use asobench::observer::gpebo::{Cascade, GpeboOptions, ObserverSpec, Operator, Scenario, halve};
use asobench::plant::ContinuousPlant;
use asobench::signal::Signal;
use serde_json::Value;

/// `rounding.py`: plants of which no exponential is right to more than a few digits, some to none, in any units. The
/// root mean squares of an observer that does nothing are those of the plant's states. An error above 1e-3 is never
/// certified to be below 1e-4, the limit of the studies. The step error is a difference of random rounding: it may be
/// small by chance, but not below a tenth of the true errors in more than two of the 24 runs, nor below a hundredth.
#[test]
fn nothing_wrong_is_certified() {
    let cases: Value = serde_json::from_str(include_str!("rounding.json")).unwrap();
    let cases = cases.as_array().unwrap();
    let (mut lost, mut small) = (0, 0);
    for case in cases {
        let row = |row: &Value| -> Vec<f64> {
            let row = row.as_array().unwrap().iter();
            row.map(|x| x.as_f64().unwrap()).collect()
        };
        let a: Vec<Vec<f64>> = case["a"].as_array().unwrap().iter().map(row).collect();
        let n = a.len();
        let c = (0..n).map(|i| if i == 0 { 1.0 } else { 0.0 });
        let plant = ContinuousPlant::new(&a, vec![0.0; n], c.collect()).unwrap();
        let options = GpeboOptions {
            xi0: vec![0.0; n],
            filters: (1..n).map(|k| Operator::Lag(k as f64)).collect(),
        };
        let nothing = ObserverSpec::Luenberger {
            gain: vec![0.0; n],
            x0: vec![0.0; n],
        };
        for step in [0.01, 0.005] {
            let scenario = Scenario {
                u: Signal::default(),
                delta: Signal::default(),
                x0: vec![1.0; n],
                horizon: 1.0,
                scored_from: 0.0,
                step,
            };
            let cascade = Cascade::new(&plant, &scenario, &options, std::slice::from_ref(&nothing)).unwrap();
            let found = halve(&cascade, |_| {});
            let relative = found.observers[0].relative();
            if !(relative <= 0.01) {
                lost += 1;
                continue;
            }
            let accuracy = &found.summary.observers[0].accuracy;
            for (found, key) in [(accuracy.rms_states[0], "rms_x1"), (accuracy.rms_state, "rms_x")] {
                let exact = case[key].as_f64().unwrap();
                let error = (found / exact - 1.0).abs();
                let what = format!("{case} {step}: {error:e} {relative:e}");
                assert!(relative > 1e-4 || error <= 1e-3, "{what}");
                assert!(error <= 100.0 * relative, "{what}");
                small += usize::from(error > 10.0 * relative);
            }
        }
    }
    assert!(0 < lost && lost < cases.len(), "{lost}");
    assert!(small <= 4, "{small} of two measures");
}
