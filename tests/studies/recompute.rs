//! Checks of the results by a reader: bias and coverage from the trials, failed trials by number, one unit.

use super::{Place, contents, stdout, succeeds};
use crate::common::table::Table;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Plants of two orders. In six or eight samples random signs do not always excite a second-order plant, so that
/// some trials fail.
const STUDY: &str = r#"
trials = 400
store = "trials"
coverage = true
measures = ["e_a"]

[settings]
plant = ["first", "second"]
eta = [0, 10]
window = [6, 8, 40]
horizon = 60

[plants.first]
a = [0.5]
b = [1.0]

[plants.second]
a = [-0.7, 1.5]
b = [1.0, 0.5]

[[methods]]
estimator = "iv"
iterations = 2

[[claims]]
id = "W1"
where = { window = 40, eta = 10 }
test = { value = "a_1", statistic = "coverage", of = "iv(2)", above = 0.5 }
"#;

/// The upper 2.5 % point of the standard normal law (Abramowitz and Stegun, table 26.1).
const NORMAL: f64 = 1.959963984540054;

fn place() -> Place {
    let place = Place::new();
    place.write("study.toml", STUDY.as_bytes());
    succeeds(&place.run(&["run", "study.toml", "--out", "out"]));
    place
}

fn summary(folder: &Path) -> Value {
    let text = std::fs::read(folder.join("summary.json")).expect("a summary");
    serde_json::from_slice(&text).expect("JSON")
}

fn table(folder: &Path) -> Table {
    Table::read(&folder.join("trials.parquet"))
}

/// The rows of each output of each cell: by cell, estimator and pass.
fn rows_of(table: &Table) -> BTreeMap<(i32, String, i32), Vec<usize>> {
    let [cells, passes] = ["cell", "pass"].map(|name| table.numbers::<i32>(name));
    let estimators = table.texts("estimator");
    let mut rows: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for row in 0..table.height() {
        let estimator = estimators[row].expect("an estimator").to_owned();
        let key = (cells[row], estimator, passes[row]);
        let key = (key.0.expect("a cell"), key.1, key.2.expect("a pass"));
        rows.entry(key).or_default().push(row);
    }
    rows
}

/// Every output of every cell with its rows in the table.
fn outputs<'a>(summary: &'a Value, table: &Table) -> Vec<(i32, &'a Value, Vec<usize>)> {
    let rows = rows_of(table);
    let mut all = Vec::new();
    for (cell, of_cell) in (0..).zip(summary["cells"].as_array().expect("cells")) {
        for output in of_cell["outputs"].as_array().expect("outputs") {
            let estimator = output["estimator"].as_str().expect("a name").to_owned();
            let pass = output["pass"].as_u64().expect("a pass") as i32;
            all.push((cell, output, rows[&(cell, estimator, pass)].clone()));
        }
    }
    all
}

/// summary.json has nine significant digits.
fn is_as_printed(printed: &Value, computed: f64) -> bool {
    let printed = printed.as_f64().expect("a number");
    (printed - computed).abs() <= 1e-8 * computed.abs().max(1e-12)
}

/// Bias, its standard error, the standard deviation and the coverage by their definitions, from trials.parquet alone.
#[test]
fn bias_and_coverage_follow_from_the_trials() {
    let place = place();
    let (summary, table) = (summary(&place.path("out")), table(&place.path("out")));
    let statuses = table.texts("status");
    let ok = |row: &usize| statuses[*row] == Some("ok");
    let (mut biases, mut coverages) = (0, 0);
    for (cell, output, rows) in outputs(&summary, &table) {
        for of in output["parameters"].as_array().expect("parameters") {
            let name = of[0].as_str().expect("a name");
            let errors = table.numbers::<f64>(&format!("error_{name}"));
            let errors = rows.iter().filter_map(|row| {
                let error = errors[*row];
                assert!(ok(row) || error.is_none(), "{cell} {name}: a failed trial");
                error
            });
            let errors: Vec<f64> = errors.collect();
            let count = errors.len() as f64;
            assert_eq!(of[1]["count"], errors.len(), "{cell} {name}");
            let bias = errors.iter().sum::<f64>() / count;
            let squares: f64 = errors.iter().map(|error| (error - bias).powi(2)).sum();
            let sd = (squares / (count - 1.0)).sqrt();
            let (mean, mcse) = (&of[1]["mean"]["value"], &of[1]["mean"]["mcse"]);
            assert!(is_as_printed(mean, bias), "{cell} {name}: {mean} {bias}");
            assert!(is_as_printed(mcse, sd / count.sqrt()), "{cell} {name}");
            assert!(is_as_printed(&of[1]["sd"]["value"], sd), "{cell} {name}");
            biases += 1;
        }
        let coverage = output["coverage"].as_array();
        for of in coverage.map_or(&[][..], Vec::as_slice) {
            let name = of[0].as_str().expect("a name");
            let [errors, ses] = ["error", "se"].map(|kind| table.numbers::<f64>(&format!("{kind}_{name}")));
            let pairs = rows.iter().map(|row| Some((errors[*row]?, ses[*row]?)));
            let pairs: Vec<(f64, f64)> = pairs.flatten().collect();
            let holds = |(error, se): &&(f64, f64)| {
                let [low, high] = [-1.0, 1.0].map(|sign| error + sign * NORMAL * se);
                low < 0.0 && high >= 0.0
            };
            let covered = pairs.iter().filter(holds).count();
            assert_eq!(of[1]["covered"]["count"], covered, "{cell} {name}");
            assert_eq!(of[1]["covered"]["of"], pairs.len(), "{cell} {name}");
            coverages += 1;
        }
    }
    // Six cells of order 1 and six of order 2, 2n coefficients, three outputs.
    assert_eq!(biases, 3 * 6 * (2 + 4));
    assert!(coverages > 30, "{coverages}");
    // A first-order plant has no a_2.
    let cells = table.numbers::<i32>("cell");
    for (cell, error) in cells.into_iter().flatten().zip(table.numbers::<f64>("error_a_2")) {
        let order = &summary["cells"][cell as usize]["order"];
        assert!(*order == 2 || error.is_none(), "{cell} {order}");
    }
}

/// The failed trials of a kind by number: the first ten of the trials table, whatever the blocks were.
#[test]
fn failed_trials_are_listed_and_replayed() {
    let place = place();
    let blocks = ["--block", "7", "--threads", "2"];
    let run = [&["run", "study.toml", "--out", "blocks"], &blocks[..]].concat();
    let printed = place.run(&run);
    succeeds(&printed);
    let whole = contents(&place.path("out"));
    assert!(contents(&place.path("blocks"))["summary.json"] == whole["summary.json"]);
    let (summary, table) = (summary(&place.path("out")), table(&place.path("out")));
    let (statuses, trials) = (table.texts("status"), table.numbers::<i64>("trial"));
    let (mut long, mut short) = (0, 0);
    for (cell, output, rows) in outputs(&summary, &table) {
        let mut failed: BTreeMap<&str, Vec<i64>> = BTreeMap::new();
        for row in rows {
            let (status, trial) = (statuses[row].expect("a status"), trials[row].expect("a trial"));
            if status != "ok" {
                failed.entry(status).or_default().push(trial);
            }
        }
        for listed in failed.values_mut() {
            listed.sort_unstable();
            long += usize::from(listed.len() > 10);
            short += usize::from(listed.len() <= 10);
            listed.truncate(10);
        }
        let listed = &output["outcomes"]["failed_trials"];
        assert_eq!(*listed, serde_json::json!(failed), "cell {cell}");
    }
    assert!(long > 0 && short > 0, "{long} {short}");

    // Copied from the terminal and from the report.
    let text = stdout(&printed);
    let line = "To see a failed trial: asobench ";
    let shown = text.lines().find_map(|other| other.strip_prefix(line));
    let shown = shown.expect("a command").to_owned();
    succeeds(&place.run(&["report", "out", "--out", "report"]));
    let path = place.path("report/tables/out-failed-trials.csv");
    let csv = std::fs::read_to_string(path).expect("a table");
    let rows: Vec<Vec<String>> = csv.lines().skip(1).map(fields).collect();
    let commands = rows.iter().filter_map(|row| row.last());
    let commands = commands.map(|command| command.strip_prefix("asobench ").expect("a command"));
    let mut commands: Vec<String> = commands.map(str::to_owned).collect();
    assert_eq!(commands.len(), long + short, "{csv}");
    commands.push(shown);
    for command in commands {
        let output = place.run(&command.split(' ').collect::<Vec<_>>());
        succeeds(&output);
        let text = stdout(&output);
        assert!(text.contains("rank-deficient"), "{command}: {text}");
        assert!(text.contains("These rows equal, bit for bit"), "{command}");
    }
}

/// Writes trials.parquet anew after a change.
fn rewrite(folder: &Path, change: impl FnOnce(&mut Table)) {
    let mut changed = table(folder);
    change(&mut changed);
    changed.write(&folder.join("trials.parquet"));
}

/// A replay compares coefficients too. Folders of older builds have neither these nor lists of failed trials.
#[test]
fn folders_of_older_builds_are_read() {
    let place = place();
    let folder = place.path("out");
    let replayed = |expected: &str| {
        let output = place.run(&["replay", "out", "cell=11:3"]);
        succeeds(&output);
        assert!(stdout(&output).contains(expected), "{}", stdout(&output));
    };
    replayed("These rows equal, bit for bit");
    succeeds(&place.run(&["report", "out", "--out", "new"]));
    place.take_checksums("out");
    let whole = table(&folder);
    rewrite(&folder, |table| {
        let ses = table.numbers::<f64>("se_h_2");
        let next = |se: Option<f64>| se.map(|se| f64::from_bits(se.to_bits() + 1));
        let ses: Vec<Option<f64>> = ses.into_iter().map(next).collect();
        table.set("se_h_2", ses);
    });
    replayed("These rows DIFFER");
    let added = |name: &str| name.starts_with("error_") || name.starts_with("se_");
    assert_eq!(whole.0.iter().filter(|(name, _)| added(name)).count(), 8);
    rewrite(&folder, |table| {
        *table = whole;
        table.0.retain(|(name, _)| !added(name));
    });
    replayed("These rows equal, bit for bit");

    let mut older = summary(&folder);
    for cell in older["cells"].as_array_mut().expect("cells") {
        for output in cell["outputs"].as_array_mut().expect("outputs") {
            let output = output.as_object_mut().expect("an output");
            let outcomes = output["outcomes"].as_object_mut().expect("outcomes");
            let listed = outcomes.shift_remove("failed_trials");
            assert!(listed.is_some_and(|listed| listed.is_object()));
            // The key is read by either name.
            let measures = output.shift_remove("figures").expect("measures");
            output.insert("measures".to_owned(), measures);
        }
    }
    let path = folder.join("summary.json");
    std::fs::write(path, older.to_string()).expect("written");
    succeeds(&place.run(&["report", "out", "--out", "older"]));
    let mut tables = contents(&place.path("new/tables"));
    assert!(tables.remove("out-failed-trials.csv").is_some());
    let names: Vec<&String> = tables.keys().collect();
    let found = contents(&place.path("older/tables"));
    assert_eq!(found.keys().collect::<Vec<_>>(), names);
    for (name, bytes) in &tables {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

/// The fields of a line of CSV.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut quoted) = (vec![String::new()], false);
    for letter in line.trim_end().chars() {
        match (letter, fields.last_mut()) {
            ('"', _) => quoted = !quoted,
            (',', _) if !quoted => fields.push(String::new()),
            (letter, Some(field)) => field.push(letter),
            (_, None) => {}
        }
    }
    fields
}

/// The numbers of a column by the rows for which `wanted` holds.
fn column(csv: &str, name: &str, wanted: impl Fn(&[String]) -> bool) -> Vec<f64> {
    let mut lines = csv.lines().map(fields);
    let header = lines.next().expect("a header");
    let at = header.iter().position(|other| other == name);
    let at = at.unwrap_or_else(|| panic!("no column {name} in {header:?}"));
    let rows = lines.filter(|row| wanted(row));
    rows.map(|row| row[at].parse().expect("a number")).collect()
}

/// Every table writes the coverage of a_1 of iv(2) in the claim's two cells in per cent, as 100 times summary.json's
/// counts.
#[test]
fn a_coverage_has_one_unit_in_all_tables() {
    let place = place();
    succeeds(&place.run(&["report", "out", "--out", "report"]));
    let read = |name: &str| {
        let path = place.path("report/tables").join(name);
        std::fs::read_to_string(path).expect("a table")
    };
    let (summary, table) = (summary(&place.path("out")), table(&place.path("out")));
    let mut expected = Vec::new();
    for (cell, output, _) in outputs(&summary, &table) {
        let of_cell = &summary["cells"][cell as usize];
        if of_cell["window"] == 40 && of_cell["eta"] == 10.0 && output["pass"] == 2 {
            let covered = &output["coverage"][0][1]["covered"];
            let [count, of] = ["count", "of"].map(|key| covered[key].as_f64().expect("a count"));
            expected.push(100.0 * count / of);
        }
    }
    let judged = column(&read("out-claim-W1.csv"), "value (%)", |_| true);
    let all = column(&read("claims.csv"), "value", |_| true);
    let wanted = |row: &[String]| {
        let has = |text: &str| row.iter().any(|field| field == text);
        has("iv(2)") && has("a_1") && has("40") && has("10")
    };
    let coverages = column(&read("out-coverage.csv"), "covered (%)", wanted);
    assert_eq!(expected.len(), 2);
    for found in [judged, all, coverages] {
        let near = |(found, expected): (&f64, &f64)| (found - expected).abs() < 1e-9;
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.iter().zip(&expected).all(near), "{found:?} {expected:?}");
    }
}
