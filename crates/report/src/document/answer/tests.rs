//! Sentences about studies with a known winner: who wins, by how much, where; numbers by hand.

use super::*;
use crate::document::tests::study;
use asobench_study::study::Outcomes;

/// Three methods on two plants at `levels` of eta.
fn made(levels: &str) -> Study {
    let methods = ["mine", "oe", "bj"].map(|name| format!("[[methods]]\nname = \"{name}\"\nestimator = \"ls\"\n"));
    study(&format!(
        "measures = [\"e_a\"]\n[settings]\nplant = [\"nikolov2023\", \"other\"]\neta = {levels}\n\
         [plants.other]\nA = [1, -0.5, 0, 0, 0, 0, 0.01]\nB = [0, 1]\n{}",
        methods.concat()
    ))
}

/// Sets the medians of each cell by its plant, eta and method, with a standard error of one in a hundred.
fn set(study: &mut Study, value: impl Fn(&str, f64, &str) -> f64) {
    for cell in &mut study.summary.cells {
        let (plant, eta) = (cell.setting(Key::Plant).clone(), cell.eta);
        for output in &mut cell.outputs {
            let value = value(&plant, eta, &output.estimator);
            let statistics = output.measures.get_mut(&Measure::Ea).expect("e_a");
            statistics.q50 = Quantile {
                value,
                mcse: 0.01 * value,
                lost: false,
            };
        }
    }
}

/// Counts so many of a hundred trials of a method as lost in the cells of a plant and level.
fn lose(study: &mut Study, (plant, eta): (&str, f64), method: &str, count: u64) {
    for cell in &mut study.summary.cells {
        let here = cell.setting(Key::Plant) == plant && cell.eta == eta;
        for output in &mut cell.outputs {
            let lost = if here && output.estimator == method {
                count
            } else {
                output.outcomes.lost
            };
            output.outcomes = Outcomes {
                trials: 100,
                unstable: lost,
                lost,
                ..Outcomes::default()
            };
        }
    }
}

/// oe wins with 1, 2, 4 at eta = 2, 4, 8 % of the first plant (bj is twice as large), and bj on the other one, where it
/// is as good as oe at eta = 8 %. Ratio 2, its error 2 * 0.01 * sqrt(2) = 0.028.
fn known() -> Study {
    let mut study = made("[2, 4, 8]");
    set(&mut study, |plant, eta, method| match (plant, method) {
        (_, "mine") => 10.0 * eta,
        ("nikolov2023", "oe") => eta / 2.0,
        ("nikolov2023", _) => eta,
        (_, "oe") if eta < 8.0 => 3.0 * eta,
        (_, "oe") => 8.08,
        _ => eta,
    });
    study
}

#[test]
fn the_winner_is_named_with_its_lead() {
    let text = best(&known(), Measure::Ea);
    for part in [
        "Smallest median e_a: oe in 3 of 6 cells, bj in 3. In 1 of the 6 cells the next method ties",
        // The widest: 3 times, error 3 * 0.01 * sqrt(2) = 0.042; the closest: 8.08 / 8 = 1.01.
        "At eta = 2 %, plant other bj has the smallest median e_a, 2.00(2); that of oe, the next, is 3.00(4) times as \
         large.",
        "At eta = 8 %, plant other bj has the smallest median e_a, 8.00(8); that of oe, the next, is 1.01(1) times as \
         large, a tie within 1.96 standard errors.",
    ] {
        assert!(text.contains(part), "no '{part}' in: {text}");
    }
    assert!(!text.contains("mine"), "{text}");
}

#[test]
fn few_cells_have_a_sentence_each() {
    let mut study = made("2");
    set(&mut study, |plant, eta, method| match (plant, method) {
        ("other", "mine") => 1.0,
        (_, "oe") => eta,
        _ => 5.0 * eta,
    });
    let text = best(&study, Measure::Ea);
    for part in [
        "At plant nikolov2023 oe has the smallest median e_a, 2.00(2); that of mine, the next, is 5.00(7) times as \
         large.",
        "At plant other mine has the smallest median e_a, 1.00(1); that of oe, the next, is 2.00(3) times as large.",
    ] {
        assert!(text.contains(part), "no '{part}' in: {text}");
    }
}

#[test]
fn the_lost_trials_of_every_method_are_told() {
    let mut study = known();
    lose(&mut study, ("other", 8.0), "mine", 66);
    lose(&mut study, ("nikolov2023", 8.0), "bj", 1);
    // 66 of 600: 11 %, sqrt(0.11 * 0.89 / 600) = 1.28 %; of 100: sqrt(0.66 * 0.34 / 100) = 4.7 %.
    let text = lost_trials(&study);
    for part in [
        " mine loses 11(1) % of its 600 trials, most at eta = 8 %, plant other: 66(5) %.",
        " bj loses 0.2(2) % of its 600 trials, most at eta = 8 %, plant nikolov2023: 1(1) %.",
        " None: oe.",
    ] {
        assert!(text.contains(part), "no '{part}' in: {text}");
    }
}

#[test]
fn the_effect_of_every_setting_is_told() {
    // bj and oe win three cells each; the last by name is told: oe. From 2 to 8 % it has 4 times the error on the first
    // plant, error 4 * 0.01 * sqrt(2) = 0.057; on the other 8.08 / 6 = 1.347, 0.019.
    let text = depends(&known(), Measure::Ea);
    for part in [
        "From eta = 2 % to eta = 8 % the median e_a of oe is multiplied by 1.35(2) (plant other) to 4.00(6) (plant \
         nikolov2023).",
        // 8.08 / 4 = 2.02 at eta = 8 %, 6 / 1 and 12 / 2 below.
        "From plant nikolov2023 to plant other the median e_a of oe is multiplied by 2.02(3) (eta = 8 %) to 6.00(8) \
         (eta = 4 %).",
    ] {
        assert!(text.contains(part), "no '{part}' in: {text}");
    }
}

#[test]
fn papers_have_the_best_in_bold() {
    let study = known();
    let table = medians(&study, Measure::Ea).expect("a table").shown("").0;
    let headings: Vec<&str> = table.columns.iter().map(|column| &*column.title).collect();
    assert_eq!(headings, ["eta", "plant", "mine", "oe", "bj", "next / best"]);
    let latex = table.latex("a", "A");
    for row in [
        "$2$ & nikolov2023 & $20.0(2)$ & $\\mathbf{1.00(1)}$ & $2.00(2)$ & $2.00(3)$ \\\\",
        "$8$ & other & $80.0(8)$ & $8.08(8)$ & $\\mathbf{8.00(8)}$ & $1.01(1)$ \\\\",
    ] {
        assert!(latex.contains(row), "no '{row}' in: {latex}");
    }
    assert!(lost_table(&study).is_none());
}
