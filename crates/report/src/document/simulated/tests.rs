use super::*;
use crate::document::report;
use crate::document::tests::study;
use asobench_identification::metric::SlopeOf;
use asobench_study::study::Measure;
use asobench_study::study::file::{Key, SlopeTable, StudyKind};

/// A file with something of each kind, each value told apart from all others.
const DISCRETE: &str = r#"
title = "A | title"
question = "Is it?"
hypothesis = "It is."
seed = 4711
trials = { until = "e_a", output = "ls", relative_mcse = 0.0123, minimum = 11, maximum = 712 }
measures = ["e_a", "e_a_as_printed", "fit_fresh", "condition"]
parameters = true
compare = [["mine(4)", "ls"]]
zip = [["eta", "window"]]
exclude = [{ noise = "white", amplitude = 7.25 }]
[settings]
plant = ["own", "random", "nikolov2023"]
noise = ["white", "blue"]
amplitude = [6.25, 7.25]
eta = [3.5, 4.5]
window = [131, 137]
feedback = "loop"
pole_radius = 0.4321
[plants.own]
A = [1, -0.5125]
B = [0, 0.8125]
[noises.blue]
C = [1, 0.3125]
[feedbacks.loop]
numerator = [0.0625]
[[methods]]
[[methods]]
name = "mine"
solver = "qr"
report = [4]
[[bounds]]
measure = "e_a"
below = 0.0375
[[claims]]
id = "W7"
text = "Mine is better."
source = "a paper"
holds = "somewhere"
level = 0.0111
where = { eta = 3.5 }
given = { share = "failed", of = "ls", below = 0.0222 }
test = { ratio = "e_a", of = "mine(4)", to = "ls", below = 0.9125 }
"#;

/// The study of that file, and a slope: made-up results have none to compute it of.
fn discrete() -> Study {
    let mut study = study(DISCRETE);
    study.file.slopes.push(SlopeTable {
        measure: Measure::Ea,
        over: Key::Amplitude,
        statistic: SlopeOf::default(),
        from: 6.125,
    });
    study
}

/// The rows of a part: those that are shown, and the defaults.
fn rows<'a>(parts: &'a [Part], heading: &str) -> [Vec<&'a str>; 2] {
    let part = parts.iter().find(|part| part.heading == heading).unwrap();
    [&part.rows, &part.defaults].map(|rows| rows.iter().map(|(term, _)| term.as_str()).collect())
}

fn value<'a>(parts: &'a [Part], wanted: &str) -> &'a str {
    let mut all = parts.iter().flat_map(|part| part.rows.iter().chain(&part.defaults));
    &all.find(|(term, _)| term == wanted)
        .unwrap_or_else(|| panic!("{wanted}"))
        .1
}

#[test]
fn nothing_that_the_file_says_is_missing() {
    let parts = parts(&discrete());
    for (term, texts) in [
        ("title", &["A | title"][..]),
        ("question", &["Is it?"]),
        ("hypothesis", &["It is."]),
        ("plant own", &["A [1, -0.5125]", "B [0, 0.8125]"]),
        // The printed coefficients of Nikolov et al. (2023), section 4.
        (
            "plant nikolov2023",
            &["[-9e-5, 0.002835, -0.035525, 0.2275, -0.7875, 1.4", "0.6, 0.2, 0.1"],
        ),
        ("noise", &["white \u{b7} blue"]),
        ("noise blue", &["numerator [1, 0.3125], denominator [1]"]),
        ("feedback loop", &["u(k) = -K(q) y(k) + r(k)", "numerator [0.0625]"]),
        ("amplitude", &["6.25 \u{b7} 7.25"]),
        ("eta", &["3.5 \u{b7} 4.5 (%)"]),
        ("window", &["131 \u{b7} 137"]),
        ("pole_radius", &["0.4321"]),
        // 3 plants x 2 noises x 2 amplitudes x 2 windows, less 3 x 2 with white noise of 7.25.
        (
            "cells",
            &["18: plant 3 \u{d7} amplitude 2 \u{d7} noise 2 \u{d7} eta + window 2"],
        ),
        ("zip", &["eta, window"]),
        ("exclude", &["amplitude 7.25, noise white"]),
        (
            "trials",
            &["until e_a", "output ls", "0.0123", "minimum 11", "maximum 712"],
        ),
        ("seed", &["4711"]),
        ("a", &["e_a, e_a_as_printed"]),
        ("noise-free output", &["fit_fresh"]),
        ("none", &["condition"]),
        ("each coefficient", &["a_i and h_i"]),
        ("iv", &["estimator iv; defaults: solver partitioned, iterations 4"]),
        ("mine", &["solver qr", "report [4]; defaults: iterations 4"]),
        ("order", &["auto: 1 \u{b7} 2 \u{b7} 6"]),
        ("fit_fresh", &["Larger is better."]),
        ("parameters", &["true"]),
        ("compare", &["mine(4) over ls"]),
        ("slope", &["over amplitude", "from 6.125"]),
        ("bound", &["e_a, below 0.0375"]),
    ] {
        let value = value(&parts, term);
        for text in texts {
            assert!(value.contains(text), "{term}: '{value}' without '{text}'");
        }
    }
}

#[test]
fn a_claim_has_its_words_test_and_level() {
    let parts = parts(&discrete());
    let claims = |part: &Part| {
        let claims = part.rows.iter().filter(|(term, _)| term == "claim W7");
        claims.map(|(_, value)| value.clone()).collect::<Vec<_>>()
    };
    assert_eq!(claims(&parts[0]), ["Mine is better. (source: a paper)"]);
    assert_eq!(
        claims(&parts[4]),
        [
            "(ratio e_a, of mine(4), to ls, below 0.9125); holds somewhere, where eta 3.5, given (share failed, of ls, \
             below 0.0222); level 1.11 %"
        ]
    );
}

#[test]
fn every_setting_is_there_once_and_defaults_come_last() {
    let parts = parts(&discrete());
    for key in Key::ALL.iter().filter(|key| key.is_of(StudyKind::Discrete)) {
        let all = parts.iter().flat_map(|part| part.rows.iter().chain(&part.defaults));
        let count = all.filter(|(term, _)| term == key.name()).count();
        // Plants have rows of their own, l stands for the window, and no cell has a label.
        let expected = usize::from(![Key::Plant, Key::L, Key::Claim].contains(key));
        assert_eq!(count, expected, "{key}");
    }
    let [given, defaults] = rows(&parts, "Data-generating mechanisms");
    assert!(given.contains(&"pole_radius") && given.contains(&"x0"));
    assert!(defaults.contains(&"plant_order") && !defaults.contains(&"amplitude"));
    let [given, defaults] = rows(&parts, "Performance measures");
    assert!(given.contains(&"parameters") && defaults.contains(&"coverage"));
}

#[test]
fn a_study_in_continuous_time_has_its_own() {
    let parts = parts(&study(
        "[continuous]\nuntil = 17.5\n[settings]\ndisturbance = \"two\"\nlevel = 0.7\n\
         [signals.two]\nwaves = [{ wave = \"sine\", amplitude = 0.55 }, { wave = \"white\" }]\n\
         [[observers]]\nobserver = \"gradient\"\ngains = [3.25]\n",
    ));
    for (term, text) in [
        ("continuous", "until 17.5"),
        ("plant bobtsov2023", "A = [["),
        ("disturbance two", "[(wave sine, amplitude 0.55"),
        ("level", "0.7"),
        ("theta", "x(0) - xi(0)"),
        ("gradient", "observer gradient, gains [3.25]"),
    ] {
        let value = value(&parts, term);
        assert!(value.contains(text), "{term}: {value}");
    }
    assert!(
        rows(&parts, "Data-generating mechanisms")[1]
            .iter()
            .all(|term| *term != "eta")
    );
}

/// The page and simulated.md have the five parts in order, and the texts of others as texts.
#[test]
fn the_page_and_the_file_have_the_same_order() {
    let files = report(&[discrete()], &mut |_| ());
    for (name, title) in [
        ("report.html", "A | title"),
        (asobench_study::files::SIMULATED, "A \\| title"),
    ] {
        let (_, text) = files.iter().find(|(of, _)| of == name).unwrap();
        let start = text.rfind("What was simulated").unwrap();
        let mut rest = &text[start..];
        for heading in [
            "Aims",
            title,
            "Data-generating mechanisms",
            "0.8125",
            "Estimands",
            "Methods",
            "Performance measures",
        ] {
            let at = rest.find(heading);
            rest = &rest[at.unwrap_or_else(|| panic!("{name}: {heading}"))..];
        }
    }
}

/// Of many values and rows only some are shown, with their number.
#[test]
fn long_lists_are_cut() {
    let pairs = vec!["[\"iv(4)\", \"ls\"]"; 50].join(", ");
    let parts = parts(&study(&format!(
        "measures = [\"e_a\"]\ncompare = [{pairs}]\n[settings]\neta = {{ linspace = [1, 60, 60] }}\n"
    )));
    assert!(value(&parts, "eta").starts_with("1 \u{b7} 2 "));
    assert!(value(&parts, "eta").contains("\u{b7} ... \u{b7} 41 \u{b7}"));
    assert!(value(&parts, "eta").contains("60 (60 values)"));
    assert_eq!(value(&parts, "and more"), "10 in manifest.json");
}

#[test]
fn every_measure_has_an_estimand() {
    let without = Measure::ALL.iter().filter(|of| estimand(**of).is_none());
    assert_eq!(without.collect::<Vec<_>>(), [&Measure::Ea; 0]);
    // No line names a measure that does not exist, and none is named twice.
    let text = include_str!("estimands.txt");
    let names = text.lines().filter_map(|line| line.rsplit_once(" | "));
    let names = names.flat_map(|(_, names)| names.split(' '));
    let known: Vec<Measure> = names.map(|name| name.parse().unwrap()).collect();
    assert_eq!(known.len(), Measure::ALL.len());
}
