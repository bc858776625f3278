//! Tables of made-up studies: they fit a screen, and nothing is cut.

use super::*;
use crate::document::tests::study;
use asobench_study::study::Look;
use std::collections::BTreeSet;

fn settings(cells: usize) -> String {
    match cells {
        1 => String::new(),
        cells => format!("eta = {{ linspace = [1, 20, {cells}] }}\n"),
    }
}

fn file(cells: usize, names: &[String]) -> String {
    let method = |name: &String| format!("[[methods]]\nname = '{name}'\nestimator = 'ls'\n");
    let methods: String = names.iter().map(method).collect();
    format!(
        "measures = ['e_a', 'e_b', 'e_x_max_as_printed']\n[settings]\n{}{methods}",
        settings(cells)
    )
}

/// `count` names that differ only at their ends.
fn long_names(count: usize, length: usize) -> Vec<String> {
    let begin: String = "long name ".chars().cycle().take(length - 4).collect();
    let name = |i: usize| format!("{begin}x{i:03}");
    (0..count).map(name).collect()
}

fn fits(text: &str) {
    let most = text.lines().map(|line| line.chars().count()).max();
    assert!(most.is_some_and(|most| most <= WIDTH), "{text}");
    assert!(text.lines().count() <= LINES, "{text}");
}

/// A text without line breaks.
fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn every_table_fits_a_screen_and_has_whole_names() {
    let small = [1, 2, 9, 40].into_iter().flat_map(|cells| {
        let sizes = [1, 2, 6, 30].into_iter();
        sizes.flat_map(move |outputs| [8, 30, 60, 200].map(|length| (cells, outputs, length)))
    });
    for (cells, outputs, length) in small.chain([(1000, 1, 8), (1000, 6, 200)]) {
        let names = long_names(outputs, length);
        let text = overview(&study(&file(cells, &names)));
        fits(&text);
        // All names shown are complete. A short name in the table is explained once in the key, and no other name
        // begins with it.
        let text = joined(&text);
        let there = names.iter().filter(|name| text.contains(name.as_str()));
        assert!(there.count() > 0, "{text}");
        let begin = &names[0][..names[0].len() - 3];
        let begun = text.matches(begin).count();
        let whole: usize = names.iter().map(|name| text.matches(name.as_str()).count()).sum();
        assert_eq!(begun, whole, "{text}");
    }
}

/// Names of cells, for settings with long values.
#[test]
fn cells_of_long_names_stand_in_a_key() {
    let names = long_names(6, 150);
    let list = names.iter().map(|name| format!("'{name}'"));
    let list = list.collect::<Vec<_>>().join(", ");
    let tables = names
        .iter()
        .map(|name| format!("[plants.'{name}']\na = [-0.7, 1.5]\nb = [1.0, 0.5]\n"));
    let text = overview(&study(&format!(
        "measures = ['e_a']\n[settings]\nplant = [{list}]\n{}",
        tables.collect::<String>()
    )));
    fits(&text);
    let shown: BTreeSet<&String> = names.iter().filter(|name| joined(&text).contains(*name)).collect();
    assert!(shown.len() > 1 && text.contains("\ncell 0: plant "), "{text}");
}

/// A study whose medians are 1, 2, 3 ... over the cells, with a given standard error.
fn known(toml: &str, mcse: f64) -> Study {
    let mut study = study(toml);
    for (value, cell) in (1..).zip(&mut study.summary.cells) {
        let measures = cell.outputs.iter_mut().flat_map(|output| output.measures.values_mut());
        measures.for_each(|statistics| {
            statistics.q50 = Quantile {
                lost: false,
                value: f64::from(value),
                mcse,
            }
        });
    }
    study
}

#[test]
fn rows_are_cells_and_columns_are_outputs() {
    let names = ["one".to_owned(), "two".to_owned()];
    let text = overview(&known(&file(3, &names), 0.03));
    let table = "
      median e_a        median e_b        median e_x_max_as_printed
eta   one      two      one      two      one      two
1     1.00(3)  1.00(3)  1.00(3)  1.00(3)  1.00(3)  1.00(3)
10.5  2.00(3)  2.00(3)  2.00(3)  2.00(3)  2.00(3)  2.00(3)
20    3.00(3)  3.00(3)  3.00(3)  3.00(3)  3.00(3)  3.00(3)
No trial was lost.
";
    assert!(text.contains(table), "{text}");
    assert!(text.ends_with("asobench report many\n"), "{text}");
}

#[test]
fn one_cell_has_a_row_for_each_output() {
    let names = ["one".to_owned(), "two".to_owned()];
    // A number that is not random has no error, and four digits.
    let text = overview(&known(&file(1, &names), 0.0));
    for line in [
        "output  median e_a  median e_b  median e_x_max_as_printed",
        "one     1.000       1.000       1.000",
    ] {
        assert!(text.lines().any(|other| other == line), "{line}: {text}");
    }
}

#[test]
fn what_is_left_out_is_counted() {
    let text = overview(&study(&file(500, &["one".to_owned()])));
    let begins = |line: &&str| {
        let word = line.split_whitespace().next();
        word.is_some_and(|word| word.parse::<f64>().is_ok()) && !line.contains("more")
    };
    let rows = text.lines().filter(begins).count();
    assert!(rows > 10, "{text}");
    assert!(
        text.contains(&format!("{} more cells: asobench report many", 500 - rows)),
        "{rows} {text}"
    );
}

#[test]
fn lost_trials_are_told() {
    let names = ["one".to_owned(), "two".to_owned()];
    let mut study = known(&file(3, &names), 0.0);
    for output in &mut study.summary.cells[1].outputs[1..] {
        let outcomes = &mut output.outcomes;
        outcomes.failures.insert("singular".to_owned(), 3);
        outcomes.failed_trials.insert("singular".to_owned(), vec![0, 1, 2]);
        outcomes.lost = 3;
        output.failed = asobench_identification::metric::Share::new(3, 3);
        let none = asobench_identification::metric::Sample::from_values([f64::NAN; 3])
            .statistics(asobench_identification::metric::Worse::Larger);
        output.measures.values_mut().for_each(|statistics| *statistics = none);
    }
    let text = overview(&study);
    fits(&text);
    assert!(text.contains("lost, %"), "{text}");
    assert!(joined(&text).contains("none: half of the trials"), "{text}");
    assert!(joined(&text).contains("100 %, of two at eta = 10.5 %."), "{text}");
    let command = "To see a failed trial: asobench replay many cell=1:0";
    assert!(text.lines().any(|line| line == command), "{text}");
    let row = text.lines().find(|line| line.starts_with("10.5"));
    let cells: Vec<&str> = row.unwrap().split_whitespace().collect();
    assert_eq!(cells[..5], ["10.5", "2.000", "none", "0", "100"], "{text}");
}

#[test]
fn continuous_studies_have_the_same_table() {
    let text = std::fs::read_to_string("../../experiments/gpebo-figures.toml").unwrap();
    let text = overview(&study(&text));
    fits(&text);
    assert!(text.contains("proposed"), "{text}");
}

#[test]
fn what_claims_speak_of_comes_first() {
    let names = long_names(30, 12);
    let claim = format!(
        "[[claims]]\nid = 'W1'\ntest = {{ value = 'e_b', of = '{}', below = 1 }}\n",
        names[20]
    );
    let text = overview(&study(&(file(40, &names) + &claim)));
    let heading = text.find("median e_b").unwrap();
    assert!(text.find("median e_a").is_none_or(|other| heading < other), "{text}");
    assert!(text.contains(&names[20]), "{text}");
}

#[test]
fn verdicts_hang_from_their_ids() {
    let mut study = study(&file(1, &["one".to_owned()]));
    let file = asobench_study::study::file::ExperimentFile::parse(
        "[[claims]]\nid = 'W1'\ntest = { value = 'e_a', of = 'nobody', below = 1 }\n",
    )
    .unwrap();
    study.judged = asobench_study::claim::judge(&file, &study.summary, &[], Look::ONLY);
    study.file.claims = file.claims;
    let text = verdicts(&study);
    assert!(text.starts_with("W1  undecided: "), "{text}");
    let mut lines = text.lines();
    lines.next();
    lines.next_back();
    assert!(
        lines.clone().count() > 0 && lines.all(|line| line.starts_with("    ")),
        "{text}"
    );
    let tested = "1 claim was tested, at 2.5 % a side.\n";
    let verdict = text.strip_suffix(tested).expect(tested);
    assert_eq!(joined(verdict), joined(&study.judged[0].line));
}
