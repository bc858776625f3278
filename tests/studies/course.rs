//! Errors over the number of samples seen, and plants that change, against windows of their own and by hand.

use super::{Place, succeeds};
use asobench::adaptive::{AdaptiveObserver, FedObserver, StateFilters};
use asobench::estimator::recursive::{RecursiveForm, RecursiveLeastSquares, RecursiveSettings};
use asobench::estimator::{Pass, Window};
use asobench::model::Orders;
use asobench::study::file::ExperimentFile;
use asobench::study::{Experiment, Measure, Trial};

const STUDY: &str = r#"
seed = 9
trials = 12
measures = ["e_a", "e_b", "e_a_course", "e_b_course", "e_x_course", "k_a", "k_x"]
[course]
at = [4, 6, 20, 35, 50, 80, 99]
from = 20
bound = 0.2
[settings]
plant = "p"
noise = "white"
eta = 5
window = 99
change = ["none", "c", "d"]
[plants.p]
A = [1, -1.5, 0.7]
B = [0, 1, 0.5]
[plants.q]
A = [1, -0.9, 0.2]
B = [0, 0.5, 0.5]
[changes.c]
at = 40
plant = "q"
[changes.d]
at = 30
over = 40
gain = 2
poles = 0.8
[[methods]]
estimator = "iv"
report = [0, 4]
[[methods]]
name = "sliding"
estimator = "iv"
last = 30
report = [4]
[[methods]]
estimator = "rls"
[[methods]]
estimator = "recursive-iv"
instruments = "auxiliary"
# By default a quarter of the equations of a short record, which a course has not.
start = 10
[[methods]]
estimator = "rpem"
forgetting = 0.98
[[methods]]
estimator = "zhang"
[[methods]]
estimator = "joint-ekf"
[[methods]]
estimator = "kreisselmeier"
"#;

fn experiment() -> Experiment {
    Experiment::new(ExperimentFile::parse(STUDY).unwrap()).unwrap()
}

/// The distance of two vectors over the size of the first.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = |of: &mut dyn Iterator<Item = f64>| of.map(|x| x * x).sum::<f64>().sqrt();
    size(&mut a.iter().zip(b).map(|(a, b)| a - b)) / size(&mut a.iter().copied())
}

/// At each point a method has the model of an estimate from these samples alone, and the measures follow from the
/// models and the true plant of each sample by their definitions.
#[test]
fn models_and_measures_of_a_course() {
    let experiment = experiment();
    let points = [4, 6, 20, 35, 50, 80, 99];
    for cell in &experiment.cells {
        let mut trial = Trial::new(&experiment, cell).unwrap();
        trial.keep_courses();
        trial.run(3).unwrap();
        let record = trial.record();
        let (data, mut rows) = (record.realisation, record.rows.iter());
        for (number, method) in experiment.methods.iter().enumerate() {
            let (at, models) = trial.course(number);
            assert_eq!(at, points);
            let reported = method.reported();
            // Windows of fewer than 3n samples have no model of the paper's.
            let skipped = points.len() * reported.len() - models.len();
            let of = |output: usize, point: usize| {
                let place = (point * reported.len() + output).checked_sub(skipped);
                place.map_or(&[][..], |place| &models[place])
            };
            for (output, pass) in reported.iter().enumerate() {
                let mut errors = [Vec::new(), Vec::new()];
                for (point, k) in points.into_iter().enumerate() {
                    let found = of(output, point);
                    let begin = k.saturating_sub(method.last().unwrap_or(k));
                    let window = Window::new(&data.u[begin..], &data.y[begin..], k - begin);
                    let shape = asobench::estimator::Shape {
                        order: 2,
                        window: k - begin,
                    };
                    // `last` is the same window of a shorter record.
                    let prepared = method.prepare(shape);
                    assert_eq!(prepared.is_ok(), k > 4);
                    if let Ok(mut estimator) = prepared {
                        let mut passes = vec![Pass::new(2); method.passes()];
                        estimator.estimate(window, &mut passes);
                        let expected = [&passes[*pass].a[..], &passes[*pass].b].concat();
                        assert_eq!(found, expected, "{number} {k}");
                    }
                    if found.is_empty() {
                        for of in &mut errors {
                            of.push(f64::NAN);
                        }
                        continue;
                    }
                    let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
                    data.plants.at(k - 1, &mut a, &mut b);
                    errors[0].push(distance(&a, &found[..2]));
                    errors[1].push(distance(&b, &found[2..]));
                }
                let row = rows.next().unwrap();
                let counted = &errors[0][2..];
                let rms = |of: &[f64]| {
                    let squares: f64 = of.iter().map(|error| error * error).sum();
                    (squares / of.len() as f64).sqrt()
                };
                let near = |a: f64, b: f64| {
                    let both_undefined = a.is_nan() && b.is_nan();
                    assert!((a - b).abs() <= 1e-12 * b.abs() || both_undefined, "{a} {b}");
                };
                near(row[Measure::CourseEa], rms(counted));
                near(row[Measure::CourseEb], rms(&errors[1][2..]));
                // The plant at the end is the truth of the whole window's estimate.
                near(row[Measure::Ea], errors[0][6]);
                let stays = (0..counted.len()).find(|i| counted[*i..].iter().all(|e| *e < 0.2));
                match stays {
                    Some(i) => assert_eq!(row[Measure::SettledA], (points[i + 2] - 20) as f64),
                    None => assert!(row[Measure::SettledA].is_nan()),
                }
            }
        }
        assert!(rows.next().is_none());
    }
}

/// e_x(k) of a recursion is that of the library's observer that the recursion feeds, with dead-beat filters.
#[test]
fn the_state_is_that_of_the_fed_observer() {
    let experiment = experiment();
    for cell in &experiment.cells {
        let mut trial = Trial::new(&experiment, cell).unwrap();
        trial.run(5).unwrap();
        let record = trial.record();
        let data = record.realisation;
        let settings = RecursiveSettings::new(Orders::arx(2, 2, 1));
        let rls = RecursiveLeastSquares::new(settings, RecursiveForm::SquareRoot);
        let mut fed = FedObserver::new(rls, StateFilters::new(&[0.0, 0.0]));
        let mut errors = Vec::new();
        for k in 1..=99 {
            fed.update(data.u[k - 1], data.y[k - 1]).unwrap();
            if [20, 35, 50, 80, 99].contains(&k) {
                errors.push(distance(&data.states[2 * k..2 * k + 2], fed.state()));
            }
        }
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        let expected = (squares / 5.0).sqrt();
        // Outputs: iv(0), iv(4), sliding, rls.
        let found = record.rows[3][Measure::CourseEx];
        assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
    }
}

/// The summary has the medians of trials, whatever computed them.
#[test]
fn a_summary_has_the_quantiles_of_each_point() {
    let place = Place::new();
    place.write("course.toml", STUDY.as_bytes());
    for (out, threads) in [("one", "1"), ("three", "3")] {
        let arguments = ["run", "course.toml", "--out", out, "--threads", threads, "--block", "5"];
        succeeds(&place.run(&arguments));
    }
    let read = |out: &str| std::fs::read(place.path(out).join("summary.json")).unwrap();
    assert!(read("one") == read("three"));
    let summary: serde_json::Value = serde_json::from_slice(&read("one")).unwrap();
    let experiment = experiment();
    for (number, cell) in experiment.cells.iter().enumerate() {
        let mut trial = Trial::new(&experiment, cell).unwrap();
        let (mut errors, mut missing) = (Vec::new(), 0);
        for index in 0..12 {
            trial.run(index).unwrap();
            errors.push(trial.record().rows[1][Measure::Ea]);
            missing += usize::from(errors.last().is_some_and(|error| error.is_nan()));
        }
        errors.sort_by(f64::total_cmp);
        let course = &summary["cells"][number]["outputs"][1]["course"];
        assert_eq!(course["k"][6], 99);
        // The sketch interpolates between the sixth and the seventh of twelve.
        let median = course["e_a"]["q50"][6].as_f64().unwrap();
        let bounds = 0.99 * errors[5]..1.01 * errors[6];
        assert!(bounds.contains(&median), "{median} {errors:?}");
        assert_eq!(course["e_a"]["without"][6], missing as f64 / 12.0);
        // Four samples are fewer than 3n.
        assert_eq!(course["e_a"]["without"][0], 1.0);
        assert!(course["e_a"]["q50"][0].is_null());
    }
}

#[test]
fn mistakes_in_a_course_get_one_line() {
    let place = Place::new();
    let course = |text: &str| format!("[settings]\nwindow = 98\n[course]\n{text}\n");
    place.accepts_file(course("at = [20, 98]").as_bytes());
    for (file, parts) in [
        (course("at = []"), ["course.at", "ascending"]),
        (course("at = [0, 5]"), ["course.at", "above 0"]),
        (course("at = [50, 20]"), ["course.at", "ascending"]),
        (course("at = [20]\nbound = 0"), ["course.bound: 0", "above 0"]),
        (
            course("at = [20]\nfrom = 30"),
            ["course.from: 30", "point of the course is 20"],
        ),
        (course("at = [200]"), ["course.at", "no point within the window N = 98"]),
        (
            course("at = [98]").replace("window", "horizon = 98\nwindow"),
            ["horizon: ", "the last point of [course]"],
        ),
        (
            "measures = [\"k_a\"]".to_owned(),
            ["measures: 'k_a'", "expected that table"],
        ),
        (
            format!("engine = \"lanes\"\n{}", course("at = [20]")),
            ["engine: \"lanes\" do not cover", "(course)"],
        ),
        (
            format!("{}[[methods]]\nobserver = \"kalman\"", course("at = [20]")),
            ["methods[0].observer: 'kalman'", "dead-beat"],
        ),
        ("[[methods]]\nlast = 0".to_owned(), ["methods[0].last: 0", "above 0"]),
        (
            "[[methods]]\nlast = 10".to_owned(),
            ["methods[0]", "10 samples is too short"],
        ),
        (
            "[[methods]]\nestimator = \"kreisselmeier\"\ngamma = 2".to_owned(),
            ["gamma", "expected a number of"],
        ),
    ] {
        place.refuses_file(&file, &parts);
    }
}

/// The models over k of one trial are printed.
#[test]
fn a_replay_has_the_course() {
    let place = Place::new();
    place.write("course.toml", STUDY.as_bytes());
    succeeds(&place.run(&["run", "course.toml", "--out", "r", "--trials", "2"]));
    let replay = place.run(&["replay", "r", "1:1", "--format", "json"]);
    succeeds(&replay);
    let text = super::stdout(&replay);
    for part in ["Course of rls", "Course of iv(4)", "a_1(k)", "b_2(k)"] {
        assert!(text.contains(part), "{part}");
    }
}
