//! B1 to B3 and K1.

use super::*;

const NOISE: &str = include_str!("../../../../experiments/gpebo-noise.toml");

/// The GPEBO study whose proposed estimator has these ratios of errors over the gradient's and over the full-order
/// observer's in the first cells, and 1 / 2 in the others, and comes near theta in so many more trials than the gradient, of
/// 1000.
fn gpebo(ratios: &[f64], more: i64) -> Study {
    let mut study = study("gpebo-noise", NOISE);
    for (i, cell) in study.summary.cells.iter_mut().enumerate() {
        let ratio = ratios.get(i).copied().unwrap_or(0.5);
        for other in ["gradient", "luenberger"] {
            let mut pair = paired("proposed", other, ratio);
            let of = pair.measures[&Measure::Ea];
            for measure in [
                Measure::ThetaRms,
                Measure::RmsState,
                Measure::RmsState1,
                Measure::RmsState2,
                Measure::Reaching,
            ] {
                pair.measures.insert(measure, of);
            }
            let reaching = pair.measures.get_mut(&Measure::Reaching).unwrap();
            reaching.only_first = more.max(0) as u64;
            reaching.only_second = (-more).max(0) as u64;
            cell.comparisons.push(pair);
        }
    }
    study
}

#[test]
fn gpebo_against_gradient_and_luenberger() {
    for (ratios, more, parameters, state) in [
        (&[][..], 3, Verdict::Holds, Verdict::Holds),
        // A few trials are no difference, a tenth of them is; in between it is open.
        (&[], -3, Verdict::Holds, Verdict::Holds),
        (&[], -100, Verdict::DoesNotHold, Verdict::Holds),
        (&[], -50, Verdict::Undecided, Verdict::Holds),
        (&[2.0], 3, Verdict::HoldsOnlyIf, Verdict::HoldsOnlyIf),
        (&[1.0; 9], 0, Verdict::DoesNotHold, Verdict::DoesNotHold),
    ] {
        let study = gpebo(ratios, more);
        let (found, because) = verdict_of(std::slice::from_ref(&study), "B1");
        assert_eq!(found, parameters, "{because}");
        let (found, because) = verdict_of(&[study], "B2");
        assert_eq!(found, state, "{because}");
    }
    let (_, because) = verdict_of(&[gpebo(&[2.0], 3)], "B1");
    assert!(because.contains("in 8 of 9 cells"), "{because}");
}

#[test]
fn the_map_of_amplitudes() {
    let file = include_str!("../../../../experiments/gpebo-amplitude.toml");
    for (first, others, verdict) in [
        (900, 900, Verdict::Holds),
        (0, 900, Verdict::HoldsOnlyIf),
        (500, 900, Verdict::Holds),
        (0, 100, Verdict::DoesNotHold),
    ] {
        let mut study = study("gpebo-amplitude", file);
        // A disturbance that is not small decides nothing.
        set(&mut study, &[], "proposed", Measure::MixedDisturbance, 0.9);
        set(
            &mut study,
            &[(Key::Level, "1")],
            "proposed",
            Measure::MixedDisturbance,
            1.1,
        );
        for (i, cell) in study.summary.cells.iter_mut().enumerate() {
            let others = if cell.setting(Key::Level) == "1" {
                0
            } else {
                others
            };
            for bound in &mut cell.bounds {
                for output in &mut bound.outputs {
                    output.met = Share::new(if i == 0 { first } else { others }, 1000);
                }
            }
        }
        let (found, because) = verdict_of(&[study], "B3");
        // One cell that is open among many that hold leaves it open.
        let verdict = if first == 500 {
            Verdict::Undecided
        } else {
            verdict
        };
        assert_eq!(found, verdict, "{because}");
    }
}

/// The law of the Kalman filter: a ratio below 1 refutes it where it is so by more than four standard errors.
#[test]
fn nothing_beats_the_kalman_filter() {
    let file = include_str!("../../../../experiments/observer-comparison.toml");
    for (value, mcse, verdict) in [
        (1.2, 0.01, Verdict::Holds),
        (0.99, 0.01, Verdict::Holds),
        (0.95, 0.01, Verdict::DoesNotHold),
        // Equal to the digits that are stored.
        (1.0 - 1e-9, 1e-18, Verdict::Holds),
        // Too few trials for a standard error.
        (1.2, f64::NAN, Verdict::Undecided),
        (0.9, f64::NAN, Verdict::Undecided),
    ] {
        let mut study = study("observer-comparison", file);
        for (i, cell) in study.summary.cells.iter_mut().enumerate() {
            for first in ["known observer=dead-beat", "iv observer=dead-beat(4)"] {
                let mut pair = paired(first, "known observer=kalman-varying", 1.5);
                let mut of = pair.measures[&Measure::Ea];
                // What does not know the plant decides nothing, however good it is.
                let known = first.starts_with("known");
                of.rmse_ratio.value = if known && i == 3 { value } else { 1.5 };
                of.rmse_ratio.value = if known { of.rmse_ratio.value } else { 0.1 };
                of.rmse_ratio.mcse = mcse;
                pair.measures.insert(Measure::RmsState, of);
                cell.comparisons.push(pair);
            }
        }
        let (found, because) = verdict_of(&[study], "K1");
        assert_eq!(found, verdict, "{because}");
    }
}
