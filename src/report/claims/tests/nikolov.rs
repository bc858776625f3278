//! C1 to C9 and the errata.

use super::*;

const BUILT_IN: &str = include_str!("../../../../experiments/nikolov2023.toml");

fn nikolov(count: u64) -> Study {
    let mut study = study("nikolov2023", BUILT_IN);
    for cell in &mut study.summary.cells {
        for output in cell.bounds.iter_mut().flat_map(|bound| &mut bound.outputs) {
            output.met = Share::new(count, 1000);
        }
    }
    study
}

#[test]
fn bounds_hold_where_they_are_typical() {
    for (count, verdict) in [
        (900, Verdict::Holds),
        (30, Verdict::DoesNotHold),
        (500, Verdict::Undecided),
    ] {
        let (found, because) = verdict_of(&[nikolov(count)], "C2");
        assert_eq!(found, verdict, "{because}");
    }
    let (_, because) = verdict_of(&[nikolov(30)], "C2");
    let sentence = "Of 1000 realisations IV(4) meets e_a < 0.033 in 3.0 \u{b1} 0.5 %, e_b < 0.01 in 3.0 \u{b1} 0.5 % and max e_x < 0.065 in 3.0 \u{b1} 0.5 %.";
    assert_eq!(because, sentence);
    let mut mixed = nikolov(30);
    for output in &mut mixed.summary.cells[1].bounds[1].outputs {
        output.met = Share::new(900, 1000);
    }
    assert_eq!(verdict_of(&[mixed], "C2").0, Verdict::HoldsOnlyIf);
}

#[test]
fn a_combination_of_readings_that_meets_all_bounds_makes_a_claim_conditional() {
    let readings = "zip = [[\"claim\", \"eta\", \"window\"]]\n[settings]\nclaim = [\"C2\", \"C3\"]\neta = [10.018, 10.014]\n\
        window = [98, 218]\ngain = [\"dead-beat\", \"scaled:1\"]\n[[bounds]]\nclaim = \"C2\"\nfigure = \"e_a\"\nbelow = 0.033\n";
    let mut grid = study("c2-c3", readings);
    let (found, because) = verdict_of(&[nikolov(30), grid.clone()], "C2");
    assert_eq!(found, Verdict::DoesNotHold);
    assert!(
        because.contains("none makes any of the bounds typical"),
        "{because}"
    );
    let cell = &mut grid.summary.cells[1];
    let gain = cell.setting(Key::Gain);
    assert_eq!((cell.claim.as_str(), gain.as_str()), ("C2", "scaled:1"));
    for output in &mut cell.bounds[0].outputs {
        output.met = Share::new(800, 1000);
    }
    let (found, because) = verdict_of(&[nikolov(30), grid], "C2");
    assert_eq!(found, Verdict::HoldsOnlyIf);
    assert!(because.contains("no feedback (scaled:1)"), "{because}");
}

#[test]
fn the_level_at_which_a_bound_is_the_median() {
    let mut levels = study(
        "noise-level",
        "[settings]\neta = [1, 2, 4, 8]\nwindow = [98, 218]\n",
    );
    for eta in ["1", "2", "4", "8"] {
        let median = 0.011 * eta.parse::<f64>().unwrap();
        set(
            &mut levels,
            &[(Key::Eta, eta)],
            "iv(4)",
            Measure::Ea,
            median,
        );
    }
    let cells = levels.cells(&[(Key::Window, "98")]);
    let level = accuracy::crossing(&cells, "iv(4)", Measure::Ea, 0.033).unwrap();
    assert!((level.value - 3.0).abs() < 1e-12 && (level.mcse - 0.003).abs() < 1e-12);
    assert_eq!(accuracy::crossing(&cells, "iv(4)", Measure::Ea, 33.0), None);
    let (_, because) = verdict_of(&[nikolov(30), levels], "C2");
    assert!(
        because.contains("medians at eta = 3.000(3) % (e_a)"),
        "{because}"
    );
}

fn window(slopes: [(f64, f64); 2]) -> Study {
    let mut study = study(
        "window",
        "[settings]\nnoise = [\"ar\", \"white\"]\nwindow = [98, 218, 998]\n",
    );
    let of: SlopeTable =
        serde_json::from_str(r#"{"figure": "e_a", "over": "window", "statistic": "median"}"#)
            .unwrap();
    for (noise, (value, mcse)) in ["ar", "white"].into_iter().zip(slopes) {
        study.summary.slopes.push(SlopeSummary {
            of: of.clone(),
            output: "iv(4)".to_owned(),
            settings: Settings::from([(Key::Noise, Scalar::Text(noise.to_owned()))]),
            cells: vec![0, 1, 2],
            slope: Some(Slope {
                value,
                mcse,
                points: 3,
            }),
            undefined: None,
        });
    }
    study
}

#[test]
fn a_rate_is_that_of_the_error_or_of_its_square() {
    for (slopes, verdict, words) in [
        (
            [(-0.5, 0.01), (-0.52, 0.02)],
            Verdict::HoldsOnlyIf,
            "the square of the error",
        ),
        (
            [(-1.0, 0.01), (-0.99, 0.02)],
            Verdict::Holds,
            "The error itself",
        ),
        (
            [(-0.01, 0.01), (0.02, 0.02)],
            Verdict::DoesNotHold,
            "Neither",
        ),
        (
            [(-0.5, f64::NAN), (-1.0, f64::NAN)],
            Verdict::Undecided,
            "more than one rate",
        ),
        (
            [(-0.75, 0.3), (-0.8, 0.3)],
            Verdict::Undecided,
            "more than one rate",
        ),
        (
            [(-0.5, 0.01), (-0.01, 0.01)],
            Verdict::HoldsOnlyIf,
            "in 1 of 2 cases",
        ),
    ] {
        let (found, because) = verdict_of(&[window(slopes)], "C4");
        assert_eq!(found, verdict, "{because}");
        assert!(because.contains(words), "{because}");
    }
    let (_, because) = verdict_of(&[window([(-0.5, 0.01), (-0.52, 0.02)])], "C4");
    assert!(
        because.contains("-0.50(1) under 1/A noise and -0.52(2) under white noise"),
        "{because}"
    );
}

#[test]
fn the_iteration_converges_or_not() {
    let toml = "[settings]\nnoise = [\"ar\", \"white\"]\n[[methods]]\niterations = 20\nreport = [0, 4, 5, 20]\n";
    let mut good = study("convergence", toml);
    assert_eq!(verdict_of(&[good.clone()], "C5").0, Verdict::Holds);
    assert_eq!(verdict_of(&[good.clone()], "E11").0, Verdict::Holds);
    set(
        &mut good,
        &[(Key::Noise, "white")],
        "iv(4)",
        Measure::Ea,
        1.2,
    );
    let (found, because) = verdict_of(&[good.clone()], "C5");
    assert_eq!(found, Verdict::HoldsOnlyIf, "{because}");
    assert!(because.contains("It holds with 1/A noise."), "{because}");
    set(&mut good, &[(Key::Noise, "ar")], "iv(20)", Measure::Ea, 1.2);
    assert_eq!(verdict_of(&[good.clone()], "C5").0, Verdict::DoesNotHold);
    let last = good.summary.cells[0]
        .outputs
        .iter_mut()
        .find(|of| of.label() == "iv(20)")
        .unwrap();
    last.outcomes.failures.insert("singular".to_owned(), 500);
    let (_, because) = verdict_of(&[good], "C5");
    assert!(
        because.contains("most are lost at 1/A noise: 50.0 \u{b1} 1.6 %"),
        "{because}"
    );
}

#[test]
fn times_decide_on_cost() {
    let toml = "[settings]\neta = 0\n[[methods]]\niterations = 1\nsolver = [\"partitioned\", \"lu\", \"dual\"]\n";
    let timed = |lu: f64, dual: f64| {
        let mut study = study("solvers", toml);
        let time = |(solver, seconds): (&str, f64)| Time {
            cell: 0,
            method: format!("iv solver={solver}"),
            median_seconds: seconds,
            q25_seconds: 0.9 * seconds,
            q75_seconds: 1.1 * seconds,
        };
        study.times = [("partitioned", 1.0), ("lu", lu), ("dual", dual)]
            .map(time)
            .to_vec();
        study
    };
    for (lu, dual, verdict) in [
        (2.0, 50.0, Verdict::Holds),
        (0.5, 50.0, Verdict::HoldsOnlyIf),
        (0.5, 0.5, Verdict::DoesNotHold),
        (1.0, 50.0, Verdict::Undecided),
    ] {
        let (found, because) = verdict_of(&[timed(lu, dual)], "C6");
        assert_eq!(found, verdict, "{because}");
    }
    let (_, because) = verdict_of(&[timed(0.5, 50.0)], "C6");
    assert!(
        because.contains("dual 50 to 50 times as long (longer in all 1)"),
        "{because}"
    );
}

const LOOPS: &str = "[settings]\nfeedback = [\"none\", \"static\", \"r0\"]\nnoise = [\"ar\", \"white\"]\nwindow = 218\n\
    [feedbacks.static]\nnumerator = [0.4]\n[feedbacks.r0]\nnumerator = [0.4]\nreference = 0\n";

#[test]
fn a_bias_in_closed_loop_refutes_or_conditions() {
    let loops = |ar: f64, white: f64| {
        let mut study = study("closed-loop", LOOPS);
        for cell in &mut study.summary.cells {
            let mean = if cell.setting(Key::Noise) == "ar" {
                ar
            } else {
                white
            };
            let mut of = statistics(1.0);
            (of.mean.value, of.mean.mcse, of.sd.value) = (mean, 0.02, 1.0);
            for output in &mut cell.outputs {
                output.parameters = vec![("a_1".to_owned(), of)];
            }
        }
        study
    };
    for (ar, white, verdict) in [
        (0.01, 0.01, Verdict::Holds),
        (0.01, 0.9, Verdict::HoldsOnlyIf),
        (0.9, 0.9, Verdict::DoesNotHold),
        (0.19, 0.01, Verdict::HoldsOnlyIf),
    ] {
        let (found, because) = verdict_of(&[loops(ar, white)], "C7");
        assert_eq!(found, verdict, "{because}");
    }
    let (_, because) = verdict_of(&[loops(0.01, -0.9)], "C7");
    assert!(
        because.contains("The largest bias is that of a_1, -0.90(2) standard deviations"),
        "{because}"
    );
    let empty = study("closed-loop", LOOPS);
    assert_eq!(verdict_of(&[empty], "C7").0, Verdict::Undecided);
}

#[test]
fn the_initial_state_and_the_poles() {
    let toml = "[settings]\nx0 = [0, 1, 100]\n[[methods]]\nname = \"iv\"\n[[methods]]\nname = \"iv-zero\"\ninitial_state = \"zero\"\n";
    for (one, hundred, verdict) in [
        (1.2, 2.0, Verdict::Holds),
        (1.0, 2.0, Verdict::HoldsOnlyIf),
        (1.0, 1.0, Verdict::DoesNotHold),
    ] {
        let mut study = study("initial-state", toml);
        for (cell, ratio) in study.summary.cells.iter_mut().zip([1.0, one, hundred]) {
            cell.comparisons.push(paired("iv-zero(4)", "iv(4)", ratio));
        }
        let (found, because) = verdict_of(&[study], "C8");
        assert_eq!(found, verdict, "{because}");
        assert_eq!(
            because.contains("It holds with x0 = 100."),
            verdict == Verdict::HoldsOnlyIf,
            "{because}"
        );
    }
    let toml = "[settings]\ngain = [\"dead-beat\", \"scaled:0.5\", \"scaled:1\"]\n";
    for (dead_beat, half, verdict) in [
        (0.8, 0.9, Verdict::Holds),
        (2.0, 0.9, Verdict::HoldsOnlyIf),
        (2.0, 1.5, Verdict::DoesNotHold),
    ] {
        let mut study = study("observer-poles", toml);
        set(
            &mut study,
            &[(Key::Gain, "dead-beat")],
            "iv(4)",
            Measure::ExMax,
            dead_beat,
        );
        set(
            &mut study,
            &[(Key::Gain, "scaled:0.5")],
            "iv(4)",
            Measure::ExMax,
            half,
        );
        let (found, because) = verdict_of(&[study], "C9");
        assert_eq!(found, verdict, "{because}");
        assert!(
            because.contains(&format!("{dead_beat:.2} to {dead_beat:.2} times")),
            "{because}"
        );
    }
}

#[test]
fn readings_cost_something_or_nothing() {
    let toml = "[settings]\nnumerator = [\"state-space\", \"transfer-function\"]\n[[methods]]\n[[methods]]\nname = \"iv-printed\"\n\
        stage10 = \"as-printed\"\nreport = [4]\n[[methods]]\nname = \"iv-frozen\"\nauxiliary = \"frozen\"\nreport = [4]\n";
    let mut errata = study("errata", toml);
    for id in ["E1", "E2", "E4"] {
        assert_eq!(verdict_of(&[errata.clone()], id).0, Verdict::Holds, "{id}");
    }
    for measure in [Measure::Ea, Measure::Eb, Measure::ExMax] {
        set(&mut errata, &[], "iv-frozen(4)", measure, 1.5);
        set(
            &mut errata,
            &[(Key::Numerator, "transfer-function")],
            "iv(4)",
            measure,
            0.5,
        );
    }
    let (found, because) = verdict_of(&[errata.clone()], "E4");
    assert_eq!(found, Verdict::DoesNotHold, "{because}");
    assert!(because.contains("frozen 1.500(2)"), "{because}");
    // Half the error is another measure, too.
    assert_eq!(verdict_of(&[errata.clone()], "E1").0, Verdict::DoesNotHold);
    // What fails is no ratio.
    for cell in &mut errata.summary.cells {
        let printed = cell
            .outputs
            .iter_mut()
            .find(|of| of.label() == "iv-printed(4)")
            .unwrap();
        printed.outcomes.failures.insert("singular".to_owned(), 990);
        printed.failed = Share::new(990, 1000);
    }
    let (found, because) = verdict_of(&[errata], "E2");
    assert_eq!(found, Verdict::DoesNotHold, "{because}");
    assert!(
        because.contains("fail with as-printed in all 2 cells (at least 99 %)"),
        "{because}"
    );
}
