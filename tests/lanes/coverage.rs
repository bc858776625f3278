//! The studies that the lanes do not cover, and the reasons that are given.

use super::{Case, IV};
use asobench::estimator::Method;
use asobench::study::file::ExperimentFile;
use asobench::study::{Engine, Experiment, Plan, Worker};

/// A study of a plant of order 2 with changes.
fn study(top: &str, settings: &str, more: &str) -> String {
    Case::new("", 2, top, settings, more).text
}

fn parse(text: &str) -> ExperimentFile {
    ExperimentFile::parse(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn what_is_not_covered_runs_on_faer_or_is_refused() {
    let loops = "[feedbacks.f]\nnumerator = [0.1]\n";
    let feedback = format!("{loops}{IV}");
    let reference = format!("{loops}[[methods]]\nestimator = \"iv\"\ninstruments = \"r\"\n");
    let wide: Vec<f64> = (0..25).map(|i| if i == 0 { 0.1 } else { 0.0 }).collect();
    let wide = format!("[plants.wide]\na = {wide:?}\nb = {wide:?}\n{IV}");
    let method = |option: &str| format!("[[methods]]\nestimator = \"iv\"\n{option}\n");
    for (top, settings, more, reason) in [
        ("", "feedback = \"f\"", feedback.as_str(), "feedback"),
        ("", "feedback = \"f\"", reference.as_str(), "feedback"),
        ("", "input_noise = 1.0", IV, "input noise"),
        ("", "plant = \"random\"", IV, "random plants"),
        ("", "order = 3", IV, "an order that is not the plant's"),
        ("", "plant = \"wide\"", wide.as_str(), "orders above 24"),
        ("", "horizon = 1048577", IV, "records of more than 1048576 samples"),
        ("", "", &method("solver = \"lu\""), "solver = \"lu\""),
        ("", "", &method("solver = \"qr\""), "solver = \"qr\""),
        (
            "",
            "",
            "[[methods]]\nestimator = \"ls\"\nsolver = \"cholesky\"\n",
            "solver = \"cholesky\"",
        ),
        ("", "", &method("stage10 = \"as-printed\""), "stage10 = \"as-printed\""),
        (
            "",
            "",
            &method("stage10 = \"as-printed-2024\""),
            "stage10 = \"as-printed-2024\"",
        ),
        ("", "", &method("stabilise = \"reflect\""), "stabilise = \"reflect\""),
    ] {
        runs_on_faer_or_is_refused(top, settings, more, reason);
    }
}

#[test]
fn disturbances_and_observers_of_methods_run_on_faer_or_are_refused() {
    let kalman = "[[methods]]\nestimator = \"iv\"\nobserver = \"kalman\"\n";
    let known = "[[methods]]\nestimator = \"known\"\n";
    let start = "scored_from = \"start\"";
    for (top, settings, more, reason) in [
        ("", "process_noise = 0.1", IV, "process noise"),
        ("", "x0_deviation = 0.1", IV, "random initial states"),
        ("", start, IV, start),
        ("", "", kalman, "observers of a method's own"),
        ("", "", known, "the estimator \"known\""),
    ] {
        runs_on_faer_or_is_refused(top, settings, more, reason);
    }
}

fn runs_on_faer_or_is_refused(top: &str, settings: &str, more: &str, reason: &str) {
    // A key that is given twice is no TOML: the plant goes where it is given.
    let text = study(top, settings, more);
    let text = if settings.starts_with("plant") {
        text.replacen("plant = \"p\"\n", "", 1)
    } else {
        text
    };
    for (engine, expected) in [("", Engine::Faer), ("engine = \"faer\"\n", Engine::Faer)] {
        let experiment = Experiment::new(parse(&format!("{engine}{text}")));
        let experiment = experiment.unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(experiment.engine(0).ok(), Some(expected), "{reason}");
        let plan = Plan::new(&experiment, &experiment.cells[0]);
        assert_eq!(plan.err().as_deref(), Some(reason));
        let worker = Worker::new(&experiment, &experiment.cells[0]).expect("a worker");
        assert!(
            matches!(worker, Worker::Faer(_)) && worker.stride(&experiment.cells[0]) == 1,
            "{reason}"
        );
    }
    let refused = Experiment::new(parse(&format!("engine = \"lanes\"\n{text}")));
    let message = refused.err().expect("refused").to_string();
    let expected = format!("engine: \"lanes\" do not cover {reason} (cell 0); expected \"auto\" or \"faer\"");
    assert_eq!(message, expected);
}

#[test]
fn what_is_covered_runs_on_lanes_unless_faer_is_asked_for() {
    let text = study("", "eta = [0, 5]", IV);
    for (engine, expected) in [
        ("auto", Engine::Lanes),
        ("lanes", Engine::Lanes),
        ("faer", Engine::Faer),
    ] {
        let experiment = Experiment::new(parse(&format!("engine = \"{engine}\"\n{text}"))).expect("a study");
        for (index, cell) in experiment.cells.iter().enumerate() {
            assert_eq!(experiment.engine(index).ok(), Some(expected));
            assert!(Plan::new(&experiment, cell).is_ok());
            let worker = Worker::new(&experiment, cell).expect("a worker");
            assert_eq!(matches!(worker, Worker::Lanes(_)), expected == Engine::Lanes);
            assert_eq!(matches!(worker, Worker::Faer(_)), expected == Engine::Faer);
        }
    }
    // Some cells only: each has its own, and the first that is not covered is named.
    let text = study(
        "",
        "feedback = [\"none\", \"f\"]\neta = 5.0",
        &format!("[feedbacks.f]\nnumerator = [0.1]\n{IV}"),
    );
    let experiment = Experiment::new(parse(&text)).expect("a study");
    assert_eq!(experiment.engine(0).ok(), Some(Engine::Lanes));
    assert_eq!(experiment.engine(1).ok(), Some(Engine::Faer));
    let refused = Experiment::new(parse(&format!("engine = \"lanes\"\n{text}")));
    let message = refused.err().expect("refused").to_string();
    assert!(message.contains("(cell 1)"), "{message}");
    let unknown = ExperimentFile::parse(&format!("engine = \"lane\"\n{text}"));
    let message = unknown.expect_err("refused").to_string();
    assert!(message.contains("'lane'") && message.contains("lanes"), "{message}");
}

/// A caller's estimator is nothing that lanes know.
#[test]
fn an_estimator_of_ones_own_runs_on_faer() {
    let mut experiment = Experiment::new(parse(&study("", "", IV))).expect("a study");
    let outputs = experiment.outputs();
    let options = asobench::estimator::IvOptions::default();
    experiment.methods = vec![Method::new("iv", outputs, move |shape| {
        let own = asobench::estimator::InstrumentalVariables::new(shape, &options)?;
        Ok(Box::new(own))
    })];
    assert_eq!(experiment.engine(0).ok(), Some(Engine::Faer));
    let plan = Plan::new(&experiment, &experiment.cells[0]);
    assert_eq!(plan.err().as_deref(), Some("an estimator of your own"));
}
