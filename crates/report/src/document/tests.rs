//! The page of a study with many cells: as large as that of a few, and with the extremes of what it leaves out.

use super::*;
use crate::index::Index;
use asobench_identification::estimator::Output;
use asobench_identification::metric::{Sample, Share};
use asobench_study::study::file::ExperimentFile;
use asobench_study::study::file::StudyKind;
use asobench_study::study::{CellPart, CellTally, ComparisonSummary, Experiment, Outcomes, OutputSummary, Summary};
use std::collections::HashMap;
use std::path::PathBuf;

/// A study whose medians are 1, 2, 3 ... over the cells.
pub(crate) fn study(toml: &str) -> Study {
    let experiment = Experiment::new(ExperimentFile::parse(toml).unwrap()).unwrap();
    let measures = &experiment.file.measures;
    let summary_of = |index: usize| {
        let statistics = Sample::from_values([0.5, 1.0, 1.5].map(|x| x * (index + 1) as f64))
            .statistics(asobench_identification::metric::Worse::Larger);
        let mut part = CellPart::new(&experiment, index, &CellTally::default());
        let cell = &mut part.cell;
        cell.trials = 3;
        let output = |output: &Output| OutputSummary {
            estimator: output.estimator.clone(),
            pass: output.pass,
            outcomes: Outcomes {
                trials: 3,
                ..Outcomes::default()
            },
            failed: Share::new(0, 3),
            unstable: Share::new(0, 3),
            measures: measures.iter().map(|measure| (*measure, statistics)).collect(),
            parameters: Vec::new(),
            above_truth: Vec::new(),
            sketches: Default::default(),
            coverage: Vec::new(),
            course: None,
            theory: Default::default(),
        };
        cell.outputs = experiment.outputs().iter().map(output).collect();
        let pairs = experiment.file.compare.iter().cloned();
        cell.comparisons = pairs
            .map(|[first, second]| ComparisonSummary {
                first,
                second,
                measures: Default::default(),
                ratios: Default::default(),
            })
            .collect();
        part
    };
    let cells = (0..experiment.cells.len()).map(summary_of).collect();
    let summary = Summary::new(&experiment, cells);
    Study {
        look: asobench_study::study::Look::ONLY,
        machine: None,
        unfinished: false,
        judged: Vec::new(),
        name: "many".to_owned(),
        folder: PathBuf::from("many"),
        version: String::new(),
        revision: None,
        index: Index::new(&summary, StudyKind::Discrete),
        summary,
        file: experiment.file,
        times: Vec::new(),
    }
}

fn files_of(toml: &str) -> HashMap<String, String> {
    report(&[study(toml)], &mut |_| ()).into_iter().collect()
}

fn one_axis(cells: usize) -> String {
    format!("measures = [\"e_a\"]\n[settings]\neta = {{ linspace = [1, 20, {cells}] }}\n")
}

#[test]
fn a_page_does_not_grow_with_the_cells() {
    const CELLS: usize = 5000;
    // Once a figure has a point or two per pixel, it grows no further.
    let [fewer, many] = [CELLS / 2, CELLS].map(|cells| files_of(&one_axis(cells)));
    let size = |files: &HashMap<String, String>| files["report.html"].len();
    let sizes = [size(&fewer), size(&many)];
    assert!(sizes[1] < sizes[0] + sizes[0] / 10, "{sizes:?}");
    let rows = |name: &str| many[&format!("tables/many-{name}.csv")].lines().count();
    let outputs = 5;
    assert_eq!(rows("results"), 1 + CELLS * outputs);
    // One row per cell for least squares and for the fourth pass.
    assert_eq!(rows("overview"), 1 + CELLS * 2);
    let page = &many["report.html"];
    for part in [
        "Shown are the rows with the smallest and the largest",
        "overview.csv below has every",
        "(5000 values)",
    ] {
        assert!(page.contains(part), "no '{part}'");
    }
    // The table of the page has the last cell's median, but not one from the middle.
    assert!(page.contains(">5000") && !page.contains(">2500"));
}

/// An axis of texts shows names, and a figure has room for only a few.
#[test]
fn of_many_names_a_figure_has_the_extremes() {
    let gains: Vec<String> = (0..400).map(|i| format!("\"scaled:0.{i:03}\"")).collect();
    let files = files_of(&format!(
        "measures = [\"e_x_max\"]\n[settings]\ngain = [{}]\n",
        gains.join(", ")
    ));
    let page = &files["report.html"];
    assert!(page.contains("Of 400 places along the axis, only the 60"));
    assert!(page.len() < 400_000, "{}", page.len());
}

/// Three outputs have bands, four have none, and a key of the file decides otherwise.
#[test]
fn bands_follow_a_rule_and_a_key() {
    let caption = |passes: &str, key: &str| {
        let text = format!(
            "measures = [\"e_a\"]\n{key}\n[settings]\nwindow = [98, 218, 998]\n[[methods]]\n\
             estimator = \"iv\"\nreport = {passes}\n[[methods]]\nestimator = \"arx\"\n\
             [[methods]]\nestimator = \"oe\"\n"
        );
        let mut study = study(&text);
        for cell in &mut study.summary.cells {
            cell.trials = 1000;
        }
        let drawn = figures::medians(&study, asobench_study::study::Measure::Ea);
        drawn.expect("a figure").caption
    };
    let bands = "bands hold the middle 90 %";
    let three = caption("[4]", "");
    assert!(three.contains(bands), "{three}");
    let four = caption("[0, 4]", "");
    assert!(
        four.contains("With more than three outputs there are no bands"),
        "{four}"
    );
    assert!(caption("[0, 4]", "spread = true").contains(bands));
    assert!(!caption("[4]", "spread = false").contains(bands));
}

/// A quantile among failed trials lies beyond the axis, and the caption says why.
#[test]
fn a_band_that_is_open_at_the_top_says_why() {
    let mut study = study("measures = [\"e_a\"]\n[settings]\nwindow = [98, 218, 998]\n");
    let measure = asobench_study::study::Measure::Ea;
    let closed = figures::medians(&study, measure).expect("a figure");
    assert!(!closed.caption.contains("runs off the top"), "{}", closed.caption);
    for output in &mut study.summary.cells[1].outputs {
        let statistics = output.measures.get_mut(&measure).expect("the measure");
        (statistics.q95.value, statistics.q95.lost) = (f64::NAN, true);
    }
    let open = figures::medians(&study, measure).expect("a figure");
    assert!(
        open.caption.contains("more than 5 % of the trials failed"),
        "{}",
        open.caption
    );
    let svg = open.picture.wide.svg();
    assert!(
        !svg.contains("NaN") && !svg.contains("inf") && !svg.contains("e305"),
        "{svg}"
    );
}

/// A gap names the output and the cell whose trials fail.
#[test]
fn a_gap_says_where_it_is() {
    let mut study = study("measures = [\"e_a\"]\n[settings]\nwindow = [98, 218, 998]\n");
    for output in &mut study.summary.cells[1].outputs {
        output.failed = Share::new(90, 100);
    }
    let drawn = figures::medians(&study, asobench_study::study::Measure::Ea).expect("a figure");
    let said = "Gaps are where more than half of the trials fail: ls at N = 218; iv(4) at N = 218.";
    assert!(drawn.caption.contains(said), "{}", drawn.caption);
}

#[test]
fn a_grid_of_many_settings_has_a_page() {
    let files = files_of(
        "measures = [\"e_a\"]\ncompare = [[\"iv(4)\", \"ls\"]]\n[settings]\n\
         eta = [1, 2, 3, 4, 5, 6]\namplitude = [1, 2, 3, 4, 5]\nx0 = [0, 1, 2, 3, 4]\n\
         noise = [\"ar\", \"white\"]\nwindow = [98, 218, 418, 818]\n",
    );
    assert!(files["report.html"].len() < 400_000);
    let results = &files["tables/many-results.csv"];
    assert_eq!(results.lines().count(), 1 + 6 * 5 * 5 * 2 * 4 * 5);
}
