use super::*;
use crate::design::file::needs::JointTable;
use crate::design::file::needs::Needs;
use crate::design::file::tables::SlopeTable;
use crate::design::measure::Measure;

const GRID: &str = "[settings]\nnoise = ['ar', 'white']\nwindow = [98, 218]\n";

fn checked(claims: &str, grid: &str) -> Result<Experiment, FileError> {
    let file = ExperimentFile::parse(&format!("{grid}{claims}"))?;
    file.check_filters()?;
    Experiment::new(file)
}

fn claim(test: &str) -> String {
    format!("[[claims]]\nid = 'W1'\ntest = {test}")
}

#[test]
fn a_plan_of_looks_needs_a_number_of_trials() {
    let refused = |text: &str| {
        let error = checked(&claim("{ share = 'lost', of = 'ls', below = 0.01 }"), text);
        error.err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert!(refused("looks = 0\n").contains("expected at least 1"));
    let until = "looks = 2\ntrials = { until = 'W1', minimum = 10, maximum = 40 }\n";
    assert!(refused(until).contains("which plans its looks itself"));
    assert_eq!(refused("looks = 2\n"), "");
}

/// e_a of an output beside a measure of ls.
fn joint(output: &str, measure_of_to: Measure) -> Vec<JointTable> {
    vec![JointTable {
        output: output.to_owned(),
        measure: Measure::Ea,
        to: "ls".to_owned(),
        measure_of_to,
    }]
}

#[test]
fn every_kind_of_test_is_accepted_and_tells_what_it_needs() {
    let ls = "of = 'ls'";
    let iv = "of = 'iv(4)', to = 'ls'";
    let both = |a: &str, b: &str| [a.to_owned(), b.to_owned()];
    let pair = || vec![both("iv(4)", "ls")];
    let slope = |statistic| SlopeTable {
        measure: Measure::Ea,
        over: Key::Window,
        statistic,
        from: 0.0,
    };
    use asobench_identification::metric::SlopeOf;
    for (test, needs) in [
        (format!("{{ share = 'lost', {ls}, below = 0.01 }}"), Needs::default()),
        (
            format!("{{ ratio = 'e_a', {ls}, to = 'bound:separate', below = 2 }}"),
            Needs::default(),
        ),
        (
            format!("{{ share = 'e_g', {iv}, above = 0.5 }}"),
            Needs {
                measures: vec![Measure::ImpulseResponse],
                compare: pair(),
                ..Needs::default()
            },
        ),
        (
            format!("{{ value = 'e_a', {ls}, statistic = 'q95', below = 1 }}"),
            Needs::default(),
        ),
        (
            format!("{{ value = 'parameters', {ls}, between = [-0.1, 0.1] }}"),
            Needs {
                parameters: true,
                ..Needs::default()
            },
        ),
        (
            format!(
                "[{{ ratio = 'e_a', {iv}, below = 1 }}, \
                {{ ratio = 'e_b', {iv}, within = 1.05 }}]"
            ),
            Needs {
                compare: pair(),
                ..Needs::default()
            },
        ),
        (
            format!("{{ ratio = 'e_a', {iv}, statistic = 'median', below = 1 }}"),
            Needs {
                medians: joint("iv(4)", Measure::Ea),
                ..Needs::default()
            },
        ),
        (
            "{ ratio = 'e_a', of = 'ls', to = 'ls', measure_of_to = 'e_b', below = 1 }".to_owned(),
            Needs {
                ratios: joint("ls", Measure::Eb),
                ..Needs::default()
            },
        ),
        (
            format!("{{ slope = 'e_a', {ls}, over = 'window', between = [-0.6, -0.4] }}"),
            Needs {
                slopes: vec![slope(SlopeOf::Median)],
                ..Needs::default()
            },
        ),
        (
            "{ time = 'estimate', of = 'iv', to = 'iv2', below = 1 }".to_owned(),
            Needs {
                timing: true,
                ..Needs::default()
            },
        ),
    ] {
        let methods = "\n[[methods]]\n[[methods]]\nname = 'iv2'\nsolver = 'lu'";
        let experiment = checked(&format!("{}{methods}", claim(&test)), GRID);
        let experiment = experiment.unwrap_or_else(|error| panic!("{test}: {error}"));
        assert_eq!(experiment.file.needed.unwrap_or_default(), needs, "{test}");
    }
    let test = "{ cells = 'e_a', of = 'ls', axis = 'noise', from = 'ar', within = 1.05 }";
    let [series] = &checked(&claim(test), GRID).unwrap().file.needs().series[..] else {
        panic!("one pair of cells");
    };
    assert_eq!(
        (series.from.to_string(), series.to.to_string()),
        ("ar".into(), "white".into())
    );
    let bound = "{ share = 'e_a', of = 'ls', rounding = 100, above = 0.5 }";
    let needs = checked(&claim(bound), GRID).unwrap().file.needed.unwrap_or_default();
    assert_eq!(needs.bounds.len(), 1);
    // Comparisons that the file asks for itself are not needed twice.
    let file = format!("compare = [['iv(4)', 'ls']]\n{GRID}");
    let test = "{ ratio = 'e_a', of = 'iv(4)', to = 'ls', below = 1 }";
    assert!(checked(&claim(test), &file).unwrap().file.needed.is_none());
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn mistakes_are_named_with_their_place() {
    let ratio = |rest: &str| claim(&format!("{{ ratio = 'e_a', of = 'iv(4)', to = 'ls', {rest} }}"));
    let value = |rest: &str| claim(&format!("{{ value = 'e_a', of = 'iv(4)', {rest} }}"));
    let with = |more: &str| format!("{}\n{more}", ratio("below = 1"));
    for (claims, parts) in [
        (
            claim("{ ratio = 'e_c', of = 'ls', below = 1 }"),
            ["line 6, column", "did you mean 'e_"],
        ),
        (ratio("belov = 1"), ["line 6, column", "did you mean 'below'"]),
        (
            "[[claims]]\nid = 'W1'".to_owned(),
            ["line 4, column", "missing field `test`"],
        ),
        (claim("[]"), ["line 6", "at least one test"]),
        (claim("3"), ["line 6", "expected a test such as"]),
        (
            with("hold = 'everywhere'"),
            ["line 7, column 1", "did you mean 'holds'"],
        ),
        (with("holds = 'everywere'"), ["line 7", "did you mean 'everywhere'"]),
        (with("where = { noize = 'ar' }"), ["line 7", "did you mean 'noise'"]),
        (claim("{ of = 'ls', below = 1 }"), ["claims[0].test: ", "share, value"]),
        (
            ratio("below = 1, above = 2"),
            ["claims[0].test.above: ", "exactly one of below"],
        ),
        (
            ratio("value = 'e_a', below = 1"),
            ["claims[0].test.ratio: ", "exactly one of share"],
        ),
        (
            ratio("axis = 'noise', below = 1"),
            ["test.axis: ", "it belongs to cells"],
        ),
        (
            ratio("statistic = 'mean', below = 1"),
            ["test.statistic: ", "paired-median, median, rms"],
        ),
        (
            ratio("measure_of_to = 'e_b', statistic = 'rms', below = 1"),
            ["test.measure_of_to", "paired-median"],
        ),
        (
            ratio("cap = 2, below = 1"),
            ["test.cap: ", "statistic = \"mean\" or \"rms\""],
        ),
        (
            ratio("statistic = 'rms', cap = 0, below = 1"),
            ["test.cap: 0", "above 0"],
        ),
        (
            ratio("statistic = 'rms', kurtosis = 3, below = 1"),
            ["test.kurtosis: ", "one output"],
        ),
        (
            value("statistic = 'rms', cap = 2, below = 2"),
            ["test.cap: 2", "above the limit, 2"],
        ),
        (
            value("statistic = 'rms', cap = 2, kurtosis = 3, below = 1"),
            ["test.kurtosis: ", "one of the two"],
        ),
        (
            value("statistic = 'rms', kurtosis = 0.5, below = 1"),
            ["test.kurtosis: 0.5", "at least 1"],
        ),
        (
            ratio("between = [2, 1]"),
            ["test.between: [2, 1]", "the lower limit first"],
        ),
        (ratio("within = 0.9"), ["test.within: 0.9", "above 1"]),
        (
            claim("{ ratio = 'e_a', of = 'iv(4)', to = 'iv(9)', below = 1 }"),
            ["test.to: ", "'iv(9)', did you mean"],
        ),
        (
            claim("{ ratio = 'e_a', of = 'ls', to = 'ls', below = 1 }"),
            ["test.to: ", "with itself"],
        ),
        (
            claim("{ value = 'e_theta', of = 'ls', below = 1 }"),
            ["claims[0].test: ", "'e_theta' means nothing"],
        ),
        (
            claim("{ value = 'e_aa', of = 'ls', below = 1 }"),
            ["test.value: ", "did you mean 'e_a'"],
        ),
        (
            claim("{ value = 'a_7', of = 'ls', below = 1 }"),
            ["test.value: 'a_7'", "up to 6"],
        ),
        (
            claim("{ share = 'failled', of = 'ls', below = 1 }"),
            ["test.share: ", "did you mean 'failed'"],
        ),
        (
            claim("{ share = 'failed', of = 'ls', bound = 1, below = 1 }"),
            ["test.bound: ", "means nothing"],
        ),
        (
            claim("{ share = 'e_a', of = 'ls', below = 1 }"),
            ["test: ", "one of bound, rounding, to"],
        ),
        (
            claim("{ share = 'failed', of = 'ls', below = 5 }"),
            ["test.share: ", "from 0 to 1"],
        ),
        (claim("{ value = 'e_a', below = 1 }"), ["test.of: ", "missing"]),
        (
            claim("{ time = 'estimate', of = 'iv', to = 'ivv', below = 1 }"),
            ["test.to: ", "did you mean 'iv'"],
        ),
        (
            claim("{ slope = 'e_a', of = 'ls', over = 'eta', below = 0 }"),
            ["test.over: ", "'eta' has no list"],
        ),
        (
            claim(
                "{ cells = 'e_a', of = 'ls', axis = 'noise', from = 'ar', to = 'wite', \
                 below = 1 }",
            ),
            ["test.to: ", "did you mean 'white'"],
        ),
        (
            format!(
                "{}\ngiven = {{ slope = 'e_a', of = 'ls', over = 'window', below = 0 }}",
                ratio("below = 1")
            ),
            ["claims[0].given: ", "other cells"],
        ),
        (
            with("where = { noise = 'withe' }"),
            ["claims[0].where.noise: ", "did you mean 'white'"],
        ),
        (with("level = 0.7"), ["claims[0].level: 0.7", "below 0.5"]),
        (
            with(&ratio("below = 1")),
            ["claims[1].id: ", "two claims are called 'W1'"],
        ),
        (
            with("").replace("W1", "W 1"),
            ["claims[0].id: 'W 1'", "letters, digits"],
        ),
        (with("").replace("W1", "12"), ["claims[0].id: '12'", "not a number"]),
    ] {
        let error = match checked(&claims, GRID) {
            Ok(_) => panic!("{claims}"),
            Err(error) => error.to_string(),
        };
        for part in parts {
            assert!(error.contains(part), "{claims}:\n{error}");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// Names of claims, as in stored manifests, are read and written unchanged, and so are tables. Neither is part of
/// the design.
#[test]
fn claims_are_no_part_of_the_design() {
    let experiment = |claims: &str| checked(claims, &format!("seed = 1\n{GRID}")).unwrap();
    let none = experiment("");
    let table = experiment(&claim("{ share = 'failed', of = 'iv(4)', below = 0.5 }"));
    let names = Experiment::new(ExperimentFile::parse("claims = ['C4', 'W1']").unwrap()).unwrap();
    assert_eq!(none.fingerprint(), table.fingerprint());
    for experiment in [&table, &names] {
        let json = serde_json::to_value(&experiment.file).unwrap();
        assert_eq!(ExperimentFile::from_json(&json).unwrap(), experiment.file);
    }
    let json = serde_json::to_value(&names.file).unwrap();
    assert_eq!(json["claims"], serde_json::json!(["C4", "W1"]));
    // --set and --quick may remove the cells to which a claim applies.
    let claims = claim("{ slope = 'e_a', of = 'ls', over = 'window', below = 0 }");
    let file = ExperimentFile::parse(&format!("{GRID}{claims}")).unwrap();
    let one_window = Experiment::new(file.set("window=98").unwrap()).unwrap();
    assert!(one_window.file.needed.is_none());
}
