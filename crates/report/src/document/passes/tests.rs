//! The picture of lost trials, of counts that are known by hand.

use super::*;
use crate::document::tests::study;
use asobench_study::study::Outcomes;

/// 10 trials, of which 3 failed and 4 are unstable. In 2 of them the model is unstable and the observer failed, so
/// 3 + 4 - 2 = 5 are lost.
fn outcomes(lost: &str) -> Outcomes {
    let text = format!(
        "{{\"trials\":10,\"failures\":{{\"singular\":1,\"non-finite\":2}},\"unstable\":4,\"unstable_so_far\":4{lost}}}"
    );
    serde_json::from_str(&text).unwrap()
}

fn drawn(outcomes: &Outcomes) -> Drawn {
    let mut study = study("measures = [\"e_a\"]\n[settings]\nwindow = [58, 98, 218]\n");
    let cells = study.summary.cells.iter_mut();
    for output in cells.flat_map(|cell| &mut cell.outputs) {
        output.outcomes = outcomes.clone();
    }
    lost(&study).unwrap()
}

#[test]
fn a_trial_that_failed_and_is_unstable_is_lost_once() {
    let outcomes = outcomes(",\"lost\":5");
    assert_eq!(outcomes.lost_trials(), (5, true));
    let Drawn { caption, .. } = drawn(&outcomes);
    assert!(!caption.contains("twice"), "{caption}");
    // The picture is that of 5 other trials of 10, and not that of 7.
    let of = |count: u64| {
        drawn(&Outcomes {
            trials: 10,
            lost: count,
            ..Outcomes::default()
        })
    };
    assert_eq!(drawn(&outcomes).picture.wide, of(5).picture.wide);
    assert_ne!(drawn(&outcomes).picture.wide, of(7).picture.wide);
}

/// An older summary does not say in how many trials both are true: 3 + 4 = 7 at most, and the caption says so.
#[test]
fn results_without_the_count_say_so() {
    let outcomes = outcomes("");
    assert_eq!(outcomes.lost_trials(), (7, false));
    let Drawn { caption, .. } = drawn(&outcomes);
    assert!(caption.contains("counts twice here"), "{caption}");
    let none = Outcomes {
        trials: 10,
        ..Outcomes::default()
    };
    assert_eq!(none.lost_trials(), (0, true));
}
