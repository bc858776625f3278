//! Verdicts and their sentences, for a few cells.

use crate::claim::decision_rule::Verdict;
use crate::claim::evidence::{Evidence, Part};
use crate::claim::judge::judge;
use crate::claim::judged::Judged;
use crate::claim::known::{Known, Range};
use crate::claim::needed::Needed;
use crate::claim::ranked::{Group, Ranked};
use crate::claim::statistics::Members;
use crate::claim::tests::*;
use crate::design::file::experiment_file::ExperimentFile;
use crate::outcome::summary::{BoundSummary, OutputShare};
use asobench_identification::metric::tails::{binomial_at_least, binomial_at_most, normal_point};
use std::sync::LazyLock;

/// Makes three cells with the noise levels 10, 20 and 30 and 1,000 trials each. The median ratio of "new" to "old" is
/// as given, with an error of a hundredth of it: the standard deviation of the logarithms is 0.01 sqrt(1000 * 2 / pi).
/// So many trials of "new" fail.
fn three(ratios: [f64; 3], failures: [u64; 3]) -> Summary {
    static POINTS: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let points = (0..1000).map(|i| normal_point((f64::from(i) + 0.5) / 1000.0));
        points.collect()
    });
    let sd = 0.01 * (2000.0 / std::f64::consts::PI).sqrt();
    let cells = ratios.into_iter().zip(failures).enumerate();
    summary(
        cells
            .map(|(index, (ratio, failures))| {
                let mut cell = cell(index, 10.0 * (index + 1) as f64, 1000);
                cell.pair(POINTS.iter().map(|z| (ratio * (sd * z).exp(), 1.0)));
                let count = &mut cell.outputs[0].outcomes.failures;
                count.insert("singular".to_owned(), failures);
                cell
            })
            .collect(),
    )
}

fn claim(holds: &str, test: &str) -> ExperimentFile {
    let text = format!("[settings]\neta = [10, 20, 30]\n[[claims]]\nid = 'W1'\nholds = '{holds}'\n{test}");
    ExperimentFile::parse(&text).unwrap()
}

const RATIO: &str = "test = { ratio = 'e_a', of = 'new', to = 'old', below = 1 }";

/// Returns the only verdict. Checks that its line begins with id and verdict and has at most two numbers with errors.
fn judged(file: &ExperimentFile, summary: &Summary) -> Judged {
    let mut all = judge(file, summary, &[], LOOK);
    assert_eq!(all.len(), 1);
    let judged = all.remove(0);
    let begin = format!("W1  {}", judged.verdict);
    let line = &judged.line;
    assert!(line.starts_with(&begin) && line.ends_with('.'), "{line}");
    assert!(numbers(line) <= 2, "{line}");
    assert_eq!(line.lines().count(), 1);
    judged
}

/// Counts the numbers with errors in a text: "0.83(2)".
fn numbers(text: &str) -> usize {
    let is_error = |rest: &&str| {
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        digits > 0 && rest[digits..].starts_with(')')
    };
    let opened = text.match_indices('(');
    let behind_digit = opened.filter(|(at, _)| text[..*at].ends_with(|c: char| c.is_ascii_digit()));
    behind_digit.filter(|(at, _)| is_error(&&text[at + 1..])).count()
}

fn line(file: &ExperimentFile, summary: &Summary) -> String {
    judged(file, summary).line
}

#[test]
fn each_verdict_is_a_sentence_with_the_decisive_number() {
    let everywhere = claim("everywhere", RATIO);
    assert_eq!(
        line(&everywhere, &three([0.5, 0.9, 0.7], [0; 3])),
        "W1  holds: in all 3 cells the median ratio of e_a, new over old, is below 1; \
         nearest to the limit: 0.900(9) at eta = 20 %."
    );
    assert_eq!(
        line(&everywhere, &three([0.5, 1.6, 0.7], [0; 3])),
        "W1  does not hold: the median ratio of e_a, new over old, is 1.60(2) at eta = 20 %, not below 1; one certain \
         counterexample in 3 cells. It certainly holds with eta = 10 % and eta = 30 %."
    );
    let open = judged(&everywhere, &three([0.5, 0.99, 0.7], [0; 3]));
    // The effect is 1.005 errors. At the far end of its interval it is 1.28 more: (1.96 + 0.84)^2 / 2.287^2 times 1,000
    // trials, but for a few since counts are discrete. The near end is on the other side of the limit.
    let needed = open.needed.unwrap();
    assert!(needed.from.is_some_and(|from| (1480..1500).contains(&from)) && needed.to.is_none());
    assert_eq!(
        open.line,
        "W1  undecided: 1 of 3 cells is undecided; at least 1,500 trials, perhaps far more, would be needed."
    );
    // 1.7 errors: (2.8 / 2.98)^2 is below 1, (2.8 / 0.42)^2 times 1,000.
    let near = judged(&everywhere, &three([0.5, 0.983, 0.7], [0; 3]));
    let needed = near.needed.unwrap();
    assert!(needed.from.is_some_and(|from| from <= 1001), "{needed:?}");
    assert!(needed.to.is_some_and(|to| (38_000..50_000).contains(&to)), "{needed:?}");
    let says: Vec<&str> = open.cells.iter().map(|cell| cell.says).collect();
    assert_eq!(says, ["pass", "open", "pass"]);
    assert_eq!(open.cells[1].place, "eta = 20 %");
    let typically = claim("typically", RATIO);
    for (ratios, begin) in [
        ([0.5, 1.5, 0.7], "W1  holds: in at least 2 of 3 cells"),
        ([1.5, 1.5, 0.7], "W1  does not hold: in at least 2 of 3 cells"),
        ([1.0, 1.5, 0.7], "W1  holds in part: "),
        ([1.0, 1.0, 0.7], "W1  undecided: 2 of 3 cells"),
    ] {
        let found = line(&typically, &three(ratios, [0; 3]));
        assert!(found.starts_with(begin), "{found}");
    }
    let somewhere = claim("somewhere", RATIO);
    for (ratios, begin) in [
        ([1.5, 1.5, 0.7], "W1  holds: the median ratio"),
        ([1.5, 1.5, 1.7], "W1  does not hold: in none of 3 cells"),
        ([1.5, 1.5, 1.0], "W1  undecided: 1 of 3 cells"),
    ] {
        let found = line(&somewhere, &three(ratios, [0; 3]));
        assert!(found.starts_with(begin), "{found}");
    }
}

#[test]
fn lists_conditions_and_what_is_missing() {
    let both = "test = [{ ratio = 'e_a', of = 'new', to = 'old', below = 1 }, \
                { share = 'failed', of = 'new', below = 0.5 }]";
    let found = line(&claim("everywhere", both), &three([0.5; 3], [0, 400, 0]));
    assert_eq!(
        found,
        "W1  holds: in all 3 cells all 2 tests pass; nearest to the limit: at eta = 20 %, where \
         the share of failed trials of new is 40(2) % and must be below 50 %."
    );
    let found = judged(&claim("everywhere", both), &three([0.5; 3], [0, 600, 0]));
    assert_eq!(found.verdict, Verdict::DoesNotHold);
    // Twice the tail of at least 600 failures among 1,000 at one half: there are two tests.
    let expected = 2.0 * binomial_at_least(600, 1000, 0.5);
    assert!((found.cells[1].p_fail / expected - 1.0).abs() < 1e-9);
    // Only cells where hardly any trial fails. This excludes 20 %, where half of them do.
    let given = format!("{RATIO}\ngiven = {{ share = 'failed', of = 'new', below = 0.1 }}");
    let found = judged(&claim("everywhere", &given), &three([0.5, 2.0, 0.5], [0, 500, 0]));
    assert_eq!(found.verdict, Verdict::Holds);
    assert!(found.line.contains("in all 2 cells") && found.line.contains(" Left out: one cell, where "));
    let says: Vec<&str> = found.cells.iter().map(|cell| cell.says).collect();
    assert_eq!(says, ["pass", "left out", "pass"]);
    let found = line(&claim("everywhere", &given), &three([0.5; 3], [500; 3]));
    assert_eq!(found, "W1  undecided: its condition is certainly not met in any cell.");
    // A statistic that the run did not keep, and cells that the summary does not have.
    let other = RATIO
        .replace("to = 'old'", "to = 'new'")
        .replace("of = 'new'", "of = 'old'");
    let found = judged(&claim("everywhere", &other), &three([0.5; 3], [0; 3]));
    assert!(
        found
            .line
            .contains("did not keep the comparison of 'old' with 'new' in e_a"),
        "{found:?}"
    );
    assert_eq!(found.verdict, Verdict::Undecided);
    let elsewhere = format!("where = {{ eta = 40 }}\n{RATIO}");
    let found = line(&claim("everywhere", &elsewhere), &three([0.5; 3], [0; 3]));
    assert_eq!(found, "W1  undecided: the results have no cell to which it applies.");
    let slope = "test = { slope = 'e_a', of = 'new', over = 'eta', below = 0 }";
    let found = line(&claim("everywhere", slope), &three([0.5; 3], [0; 3]));
    assert!(
        found.contains("did not keep the slope of e_a over eta of 'new'"),
        "{found}"
    );
}

/// Shares for a bound, for wins and for lost trials; means of the remaining trials.
#[test]
fn populations_are_named() {
    let mut results = three([0.5; 3], [0; 3]);
    for cell in &mut results.cells {
        let bound = toml::from_str("figure = 'e_a'\nbelow = 0.1").unwrap();
        cell.bounds.push(BoundSummary {
            bound,
            outputs: vec![OutputShare {
                output: "new".to_owned(),
                met: Share::new(700, 1000),
            }],
            verdict: asobench_identification::metric::BoundVerdict::Typical,
        });
        let pair = cell.comparisons[0].measures.get_mut(&Measure::Ea).unwrap();
        pair.share_smaller = Share::new(300, 900);
        let values = (0..1000).map(|i| if i < 800 { f64::from(i % 2) * 4.0 } else { f64::NAN });
        cell.draw(values);
    }
    for (test, part) in [
        (
            "share = 'e_a', bound = 0.1, above = 0.5",
            "trials of new with e_a < 0.1 is above 50 %; nearest to the limit: 70(1) %",
        ),
        (
            "share = 'e_a', to = 'old', below = 0.5",
            "in which new is better than old in e_a is below 50 %; nearest to the limit: 33(2) %",
        ),
        (
            "share = 'lost', below = 0.01",
            "lost trials (failed or unstable) of new is below 1 %; nearest to the limit: 0 %",
        ),
        (
            "value = 'e_a', statistic = 'mean', above = 1",
            "2.00(7) (of the 80.0 % of trials with a value)",
        ),
    ] {
        let found = line(
            &claim("everywhere", &format!("test = {{ {test}, of = 'new' }}")),
            &results,
        );
        assert!(found.contains(part), "{found}");
    }
}

/// A median among lost trials: 600 of 1,000 are lost, so at most 400 values are below any limit. The binomial tail of
/// at most 400 of 1,000 at one half gives the certainty.
#[test]
fn a_median_among_lost_trials_is_judged_by_their_count() {
    let mut results = three([0.5; 3], [600; 3]);
    for cell in &mut results.cells {
        let values = (0..1000).map(|i| if i < 400 { f64::from(i) } else { f64::NAN });
        cell.draw(values);
    }
    let found = judged(
        &claim("everywhere", "test = { value = 'e_a', of = 'new', below = 1e9 }"),
        &results,
    );
    assert_eq!(found.verdict, Verdict::DoesNotHold);
    let expected = binomial_at_most(400, 1000, 0.5);
    assert!((found.cells[0].p_fail / expected - 1.0).abs() < 1e-9);
    let certainly = binomial_at_least(400, 1000, 0.5);
    assert!((found.cells[0].p_pass / certainly - 1.0).abs() < 1e-9);
    assert!(found.line.contains("that of a trial without a value"), "{}", found.line);
}

/// Of 100 values 30 are 0, 50 are 1 and 20 are 2.
#[test]
fn ties_are_judged_by_ranks() {
    let group = |(value, count)| Group {
        lowest: value,
        highest: value,
        count,
    };
    let ranks = Known::Quantile {
        q: 0.5,
        value: 1.0,
        error: 0.0,
        ranked: Ranked::new([(0.0, 30), (1.0, 50), (2.0, 20)].map(group).to_vec()),
    };
    let below = |high: f64| Range {
        low: f64::NEG_INFINITY,
        high,
        open: true,
    };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    // 30 are below 1.
    near(ranks.outside(below(1.0)), binomial_at_most(30, 100, 0.5));
    near(ranks.inside(below(1.0)), binomial_at_least(30, 100, 0.5));
    // 80 are below 2.
    near(ranks.inside(below(2.0)), binomial_at_least(80, 100, 0.5));
    // At most 1: the 80 that are 0 or 1.
    let closed = Range {
        low: f64::NEG_INFINITY,
        high: 1.0,
        open: false,
    };
    near(ranks.inside(closed), binomial_at_least(80, 100, 0.5));
}

/// Ranges with two ends. 60 of 100 are from 0.5 to 0.7: both tails inside, twice the smaller one outside.
#[test]
fn ranges_with_two_ends_by_hand() {
    let share = Known::Share { count: 60, total: 100 };
    let range = |low: f64, high: f64| Range { low, high, open: false };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    let inside = binomial_at_least(60, 100, 0.5).max(binomial_at_most(60, 100, 0.7));
    near(share.inside(range(0.5, 0.7)), inside);
    near(share.outside(range(0.3, 0.5)), 2.0 * binomial_at_least(60, 100, 0.5));
    // Exact numbers need no test.
    let same = range(1.0 / 1.05, 1.05);
    assert_eq!(Known::Exact(1.0).inside(same), 0.0);
    assert_eq!(Known::Exact(1.1).outside(same), 0.0);
    let open = Range {
        low: f64::NEG_INFINITY,
        high: 1.0,
        open: true,
    };
    assert_eq!(
        (Known::Exact(1.0).inside(open), Known::Exact(1.0).outside(open)),
        (1.0, 0.0)
    );
}

/// Pairs of cells that differ in a setting: each cell is found with its partner. There are no results yet.
#[test]
fn pairs_and_families_of_cells_are_found() {
    use crate::claim::units::units;
    let text = "[settings]\neta = [10, 20]\nnoise = ['ar', 'white']\n\
                [[claims]]\nid = 'W1'\nwhere = { eta = 20 }\n\
                test = { cells = 'e_a', of = 'new', axis = 'noise', from = 'white', \
                within = 1.05 }";
    let file = ExperimentFile::parse(text).unwrap();
    let settings = [(10.0, "ar"), (10.0, "white"), (20.0, "ar"), (20.0, "white")];
    let cells = settings.into_iter().enumerate().map(|(index, (eta, noise))| {
        let mut cell = cell(index, eta, 100);
        cell.settings.insert(Key::Noise, Scalar::from(noise));
        cell
    });
    let results = summary(cells.collect());
    let claim = &file.claims[0];
    let test = ClaimTest::from_table(&claim.test[0]).unwrap();
    let found = units(claim, &test, &file, &results).unwrap();
    let members: Vec<&Members> = found.iter().map(|unit| &unit.members).collect();
    assert_eq!(members, [&Members::Pair(3, 2)]);
    let found = line(&file, &results);
    assert!(found.contains("did not keep pairs of cells in e_a of 'new'"), "{found}");
}

/// Times: a ratio of medians, whose error is the spread of one repetition. More trials do not help.
#[test]
fn times_are_judged_by_their_quartiles() {
    let time = |method: &str, median: f64, spread: f64| crate::outcome::method_times::MethodTime {
        cell: 0,
        method: method.to_owned(),
        median_seconds: median,
        q25_seconds: median * (1.0 - spread),
        q75_seconds: median * (1.0 + spread),
        rounds: Vec::new(),
    };
    let results = summary(vec![cell(0, 10.0, 100)]);
    let file = claim(
        "everywhere",
        "test = { time = 'estimate', of = 'a', to = 'b', below = 1 }",
    );
    let judged = |spread| judge(&file, &results, &[time("a", 1.0, spread), time("b", 1.5, spread)], LOOK).remove(0);
    assert_eq!((judged(0.02).verdict, judged(0.02).timed), (Verdict::Holds, true));
    // ln 1.5 is 1.1 times sqrt 2 * 2 * 0.175 / 1.349.
    let open = judged(0.175);
    assert_eq!(
        (open.verdict, open.needed),
        (Verdict::Undecided, Some(Needed { from: None, to: None }))
    );
    let none = judge(&file, &results, &[], LOOK).remove(0);
    assert!(
        none.line
            .contains("no times of 'a' were measured; they need timing = true"),
        "{}",
        none.line
    );
}

/// Of 1,000 trials 300 have a ratio of 1/2, 400 of exactly 1 and 300 of 3, so the median is a tie without error. 700
/// are at most 1, so it is certainly below 1.05. Only 300 are evidence that it is below 1.
#[test]
fn a_median_among_ties_is_judged_by_their_number() {
    let pairs = |x: f64, count: usize| vec![(x, 1.0); count];
    let all = [pairs(0.5, 300), pairs(1.0, 400), pairs(3.0, 300)].concat();
    let mut results = three([0.5; 3], [0; 3]);
    for cell in &mut results.cells {
        cell.pair(all.clone());
    }
    let found = |limit: &str| {
        let test = format!("test = {{ ratio = 'e_a', of = 'new', to = 'old', {limit} }}");
        judged(&claim("everywhere", &test), &results)
    };
    let near = found("below = 1.05");
    assert_eq!(near.verdict, Verdict::Holds);
    let expected = binomial_at_least(700, 1000, 0.5);
    assert!((near.cells[0].p_pass / expected - 1.0).abs() < 1e-9);
    assert_eq!(found("below = 1").verdict, Verdict::DoesNotHold);
}

/// A setting with an open cell is not reported as one where a claim holds.
#[test]
fn what_holds_is_told_of_settings_whose_cells_all_pass() {
    let place = |eta: &str, noise: &str| {
        let mut cell = cell(0, 1.0, 10);
        cell.settings.insert(Key::Eta, Scalar::Text(eta.to_owned()));
        cell.settings.insert(Key::Noise, Scalar::Text(noise.to_owned()));
        cell.place()
    };
    let all = [
        place("1", "ar"),
        place("1", "white"),
        place("2", "ar"),
        place("2", "white"),
    ];
    // The first passes, the second is open, the others fail.
    let text = crate::claim::condition(&all, &[0], &[2, 3]).unwrap_or_default();
    assert!(
        !text.contains("with eta = 1 %;") && !text.ends_with("with eta = 1 %"),
        "{text}"
    );
    let both = crate::claim::condition(&all, &[0, 1], &[2, 3]);
    assert_eq!(both.as_deref(), Some("with eta = 1 %"));
}

/// Each test of a claim has its own outputs.
#[test]
fn tests_of_several_outputs_are_told_each_by_itself() {
    let tests = "test = [{ share = 'lost', of = 'new', below = 0.5 }, \
                 { ratio = 'e_a', of = 'new', to = 'old', below = 2 }]";
    let judged = judged(&claim("everywhere", tests), &three([0.5; 3], [0; 3]));
    let texts: Vec<&str> = judged.tests.iter().map(|test| test.what.as_str()).collect();
    assert!(
        texts[0].ends_with("of new") && texts[1].contains("new over old"),
        "{texts:?}"
    );
}

/// Of two parts the sentence names the one that decides: 30 of 100 are certainly below one half, 1 of 3 is not.
#[test]
fn the_part_that_decides_is_named() {
    let range = Range {
        low: 0.5,
        high: f64::INFINITY,
        open: true,
    };
    let part = |test: usize, count: u64, total: u64| Part {
        test,
        range,
        number: Known::Share { count, total }.into(),
    };
    let evidence = Evidence {
        parts: vec![part(0, 1, 3), part(1, 30, 100)],
        ..Evidence::default()
    };
    assert_eq!(evidence.decisive().unwrap().test, 1);
    assert!(evidence.p_values().fail < 0.01);
}
