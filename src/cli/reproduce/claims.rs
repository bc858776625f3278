//! The verdicts on the claims of studies.

use crate::claim::{Judged, JudgedNumber};
use crate::cli::output::wrapped;
use crate::report::Study;
use crate::text::visible;
use serde_json::{Value, json};

/// Returns the verdicts on all claims of some studies, one paragraph each, and how many claims each study tested.
pub(super) fn lines(studies: &[Study]) -> String {
    let claims = studies.iter().flat_map(|study| &study.judged);
    let claims = claims.map(|claim| wrapped(&visible(&claim.line), "    "));
    let tested = studies.iter().filter_map(|study| {
        let name = match studies {
            [_] => String::new(),
            _ => format!("{}: ", study.name),
        };
        Some(wrapped(&format!("{name}{}", study.tested()?), ""))
    });
    claims.chain(tested).collect()
}

/// Returns the claims of a study with their numbers.
pub(super) fn claims_json(study: &Study) -> Vec<Value> {
    let claim = |claim: &Judged| {
        let numbers = claim.cells.iter().flat_map(|cell| {
            let named = |number: &JudgedNumber| {
                let name = format!("{}: {}", number.what, cell.place);
                json!({ "name": name, "value": number.value, "mcse": number.error })
            };
            cell.numbers.iter().map(named)
        });
        json!({
            "claim": claim.id,
            "text": claim.text,
            "verdict": claim.verdict.name(),
            "because": claim.line,
            "numbers": numbers.collect::<Vec<Value>>(),
        })
    };
    study.judged.iter().map(claim).collect()
}
