//! Performance measures: what is computed of each trial, the statistics over trials, and the tests of the claims.

use super::words::{Part, Row, at_most, row, table};
use crate::results::Study;
use asobench_study::claim::Judged;
use asobench_study::study::file::{ClaimTable, ExperimentFile, Store, TestTable};
use asobench_study::study::{Better, Measure};
use asobench_study::text::rounded;

pub(super) fn part(study: &Study) -> Part {
    let file = &study.file;
    let mut rows: Vec<Row> = file.measures.iter().map(|of| measure(*of)).collect();
    rows.push(row(
        "statistics",
        "over the trials of a cell: median, quantiles at 5, 25, 75 and 95 %, mean, SD, RMSE, mean without 5 % of the \
         trials at either end, shares of failed and of unstable trials; each with its Monte-Carlo standard error, if \
         the trials are enough for one",
    ));
    rows.push(row(
        "lost trials",
        "a trial without a measure ranks as the worst in quantiles, shares and paired ratios; means, SD and RMSE are \
         of the trials with one",
    ));
    let (given, defaults) = switches(file);
    rows.extend(given);
    rows.extend(at_most(further(file)));
    let claims = file.claims.iter().filter(|claim| !claim.test.is_empty());
    let claims = claims.map(|of| {
        let judged = study.judged.iter().find(|judged| judged.id == of.id);
        row(format!("claim {}", of.id), claim(of, judged))
    });
    rows.extend(at_most(claims.collect()));
    Part::new("Performance measures", rows, defaults)
}

fn measure(measure: Measure) -> Row {
    let better = match measure.entry().better {
        Better::Smaller => " Smaller is better.",
        Better::Larger => " Larger is better.",
        Better::Neither => "",
    };
    row(measure.name(), format!("{}{better}", measure.about()))
}

/// The results besides the measures, if the file asks for them: those it asks for, and the others.
fn switches(file: &ExperimentFile) -> (Vec<Row>, Vec<Row>) {
    let switches = [
        (
            "parameters",
            file.parameters,
            "bias, SD and RMSE of every coefficient of a and h",
        ),
        (
            "coverage",
            file.coverage,
            "how often 95 % intervals of every coefficient hold the truth",
        ),
        (
            "curves",
            file.curves,
            "quantiles of e_x(k) for every k, of the first and the last output",
        ),
        ("timing", file.timing, "times of the methods, measured after the run"),
    ];
    let switches = switches.map(|(key, on, about)| (on, row(key, format!("{on} ({about})"))));
    let store = row("store", format!("{} (what the run keeps)", file.store));
    let all = switches.into_iter().chain([(file.store != Store::default(), store)]);
    let (given, defaults): (Vec<_>, Vec<_>) = all.partition(|(on, _)| *on);
    let rows = |of: Vec<(bool, Row)>| of.into_iter().map(|(_, row)| row).collect();
    (rows(given), rows(defaults))
}

/// Comparisons, slopes and bounds, those of the claims included.
fn further(file: &ExperimentFile) -> Vec<Row> {
    let compare = file.compare.iter().map(|[first, second]| {
        let value = format!("{first} over {second}: ratios and differences on the same trials");
        row("compare", value)
    });
    let slopes = file.slopes.iter();
    let slopes = slopes.map(|of| row("slope", format!("log-log: {}", table(of, &[]))));
    let bounds = file.bounds.iter();
    let bounds = bounds.map(|of| row("bound", format!("share of the trials: {}", table(of, &[]))));
    compare.chain(slopes).chain(bounds).collect()
}

/// The test of a claim in words and as the file has it, where it holds, and its level.
fn claim(claim: &ClaimTable, judged: Option<&Judged>) -> String {
    let tests = judged.map(|judged| judged.tests.as_slice()).unwrap_or_default();
    let tests = tests.iter().map(|test| format!("{} must be {}", test.what, test.must));
    let mut text = tests.collect::<Vec<_>>().join("; and ");
    let written = |test: &TestTable| format!("({})", table(test, &[]));
    let tests: Vec<String> = claim.test.iter().map(written).collect();
    text.push_str(&format!(" {}", tests.join(" and ")));
    text.push_str(&format!("; holds {}", claim.holds));
    if !claim.cells.is_empty() {
        text.push_str(&format!(", where {}", table(&claim.cells, &[])));
    }
    if let Some(given) = &claim.given {
        text.push_str(&format!(", given {}", written(given)));
    }
    text.push_str(&format!("; level {} %", rounded(100.0 * claim.level, 6)));
    let each = judged.filter(|judged| judged.level < claim.level);
    if let Some(judged) = each {
        text.push_str(&format!(", at each look {} %", rounded(100.0 * judged.level, 6)));
    }
    text.trim_start().to_owned()
}
