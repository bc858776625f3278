//! The lanes from outside: the same bits for every width and every partition of the trials, and the figures of faer.
//!
//! `ASOBENCH_LANES=avx2,portable` limits the widths (valgrind has no AVX-512), `ASOBENCH_LANES_SMALL` the cells:
//!
//! ```text
//! ASOBENCH_LANES=avx2,portable ASOBENCH_LANES_SMALL=1 \
//!     valgrind --error-exitcode=1 target/release/deps/it-... --test-threads=1 lanes::widths
//! ASOBENCH_LANES=avx2,portable \
//!     valgrind --error-exitcode=1 target/release/deps/asobench_lanes-... --test-threads=1 --skip every_operation
//! ```

#![expect(clippy::format_push_string, reason = "files of a few lines")]

mod against_faer;
mod coverage;
mod widths;

use asobench::lanes::Isa;
use asobench::plant::random_stable;
use asobench::signal::{Purpose, stream};
use asobench::study::{Experiment, Trials, file::ExperimentFile};

/// The widths of this machine, of those that are asked for.
fn tested() -> Vec<Isa> {
    let asked = std::env::var("ASOBENCH_LANES").ok();
    let asked = |isa: &Isa| match &asked {
        None => true,
        Some(list) => list.split(',').any(|name| name == isa.name()),
    };
    let all = Isa::ALL.iter().copied();
    let tested: Vec<Isa> = all.filter(|isa| isa.is_here() && asked(isa)).collect();
    assert!(!tested.is_empty());
    tested
}

/// Whether there is little time.
fn small() -> bool {
    std::env::var_os("ASOBENCH_LANES_SMALL").is_some()
}

/// One cell with its methods.
struct Case {
    name: String,
    text: String,
}

const ALL_MEASURES: &str = r#"["e_a", "e_b", "e_h", "e_x0", "e_x_max", "e_x_rms", "e_a_as_printed", "e_b_as_printed",
    "e_h_as_printed", "e_x0_as_printed", "e_x_max_as_printed", "e_x_rms_as_printed", "spectral_radius", "condition",
    "e_g", "fit_fresh", "rms_x", "change"]"#;

/// Least squares and four passes, all reported.
const IV: &str = "[[methods]]\nestimator = \"iv\"\nreport = [0, 1, 2, 3, 4]\n";

impl Case {
    /// `top` stands above the settings; the plant is a random stable one, of poles in a disc of radius 0.9.
    fn new(name: &str, order: usize, top: &str, settings: &str, methods: &str) -> Self {
        let plant = random_stable(order, 0.9, &mut stream(21, order as u64, Purpose::Plant));
        let x0: Vec<f64> = (0..order).map(|i| 1.0 - 0.25 * i as f64).collect();
        let (a, b) = (plant.a(), plant.b());
        let text = format!(
            "seed = 77\n{top}\n[settings]\nplant = \"p\"\n{settings}\n\
             [plants.p]\na = {a:?}\nb = {b:?}\nx0 = {x0:?}\n{methods}"
        );
        let name = name.to_owned();
        Self { name, text }
    }

    /// Everything that lanes can measure.
    fn all(name: &str, order: usize, settings: &str, methods: &str) -> Self {
        let top = format!("measures = {ALL_MEASURES}\nparameters = true");
        Self::new(name, order, &top, settings, methods)
    }

    fn experiment(&self) -> Experiment {
        let file = ExperimentFile::parse(&self.text);
        let file = file.unwrap_or_else(|error| panic!("{}: {error}", self.name));
        let experiment = Experiment::new(file);
        experiment.unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }
}

/// Empty storage for the trials of the experiment's cell.
fn empty(experiment: &Experiment) -> Trials {
    Trials::new(experiment, &experiment.cells[0])
}

/// Every order, and the shortest window.
fn orders(cases: &mut Vec<Case>) {
    let orders: &[usize] = if small() {
        &[1, 2, 6, 8]
    } else {
        &[1, 2, 3, 4, 5, 6, 7, 8, 12, 20, 24]
    };
    for &order in orders {
        let (window, horizon) = (4 * order + 31, 4 * order + 100);
        let settings = format!("window = {window}\nhorizon = {horizon}\neta = 8.0\nx0 = \"plant\"");
        cases.push(Case::all(&format!("order {order}"), order, &settings, IV));
        // The shortest window: ill-conditioned, and noise that makes estimates diverge.
        let (window, horizon) = (3 * order, 3 * order + 70);
        for eta in [0.0, 60.0] {
            let settings = format!("window = {window}\nhorizon = {horizon}\neta = {eta:?}");
            cases.push(Case::all(
                &format!("N = 3n, order {order}, eta {eta}"),
                order,
                &settings,
                IV,
            ));
        }
    }
}

/// Readings E4, E11, E12 and the start.
fn readings(cases: &mut Vec<Case>) {
    let mut methods = "[[methods]]\nname = \"plain\"\nestimator = \"ls\"\n".to_owned();
    for reading in ["refresh", "frozen", "literal"] {
        for start in ["estimate", "zero"] {
            methods += &format!(
                "[[methods]]\nname = \"{reading}-{start}\"\nestimator = \"iv\"\nauxiliary = \"{reading}\"\n\
                 initial_state = \"{start}\"\niterations = 5\nreport = [0, 1, 2, 3, 4, 5]\n"
            );
        }
    }
    let mut driven = String::new();
    for reading in ["refresh", "frozen", "literal"] {
        for gain in ["dead-beat", "scaled:0.5", "scaled:1.0"] {
            driven += &format!(
                "[[methods]]\nname = \"{reading}-{gain}\"\nestimator = \"iv\"\nauxiliary = \"{reading}\"\n\
                 drive = \"observer\"\ngain = \"{gain}\"\nreport = [0, 1, 2, 3, 4]\n"
            );
        }
    }
    for (order, eta) in [(2, 5.0), (6, 5.0), (6, 80.0), (3, 300.0)] {
        let settings = format!("window = 50\nhorizon = 97\neta = {eta:?}");
        for (name, methods) in [("readings", &methods), ("driven by an observer", &driven)] {
            cases.push(Case::all(
                &format!("{name}, order {order}, eta {eta}"),
                order,
                &settings,
                methods,
            ));
        }
    }
}

/// Reading E8 and the observer's start.
fn observers(cases: &mut Vec<Case>) {
    for (order, poles) in [
        (2, "0.2,-0.1"),
        (6, "0.5+0.2i,0.5-0.2i,0.3,0.2,0.1,-0.4"),
        (3, "0.9,0.1,1.02"),
    ] {
        for gain in ["dead-beat", "scaled:0.5", "scaled:1.0", &format!("poles:{poles}")] {
            for start in ["x0-hat", "zero"] {
                let settings =
                    format!("window = 61\nhorizon = 190\ngain = \"{gain}\"\nobserver_start = \"{start}\"\neta = 20.0");
                cases.push(Case::all(
                    &format!("gain {gain}, order {order}, {start}"),
                    order,
                    &settings,
                    IV,
                ));
            }
        }
    }
    // An observer without feedback on diverging models: it overflows, in part of the trials only its squares do.
    for (horizon, eta) in [(700, 60.0), (3000, 60.0)] {
        let settings = format!("window = 18\nhorizon = {horizon}\ngain = \"scaled:1.0\"\neta = {eta:?}");
        cases.push(Case::all(&format!("no feedback, K = {horizon}"), 6, &settings, IV));
    }
}

/// Inputs, noises and noise levels.
fn records(cases: &mut Vec<Case>) {
    for (name, more) in [
        ("gaussian", "input = \"gaussian\"\namplitude = 0.01"),
        ("periodic", "sequence = \"periodic-127\""),
        ("held", "sequence = \"held-127\""),
        ("white", "noise = \"white\""),
        ("arma", "noise = \"arma\""),
        ("nominal", "eta_over = \"nominal\""),
        ("noise in the window alone", "eta_over = \"window-alone\""),
        ("measured", "eta_of = \"measured\""),
        ("nominal measured", "eta_over = \"nominal\"\neta_of = \"measured\""),
        ("nearly all noise", "eta_of = \"measured\"\neta = 99.0"),
        ("a start at rest", "x0 = 0.0"),
    ] {
        let eta = if more.contains("eta =") { "" } else { "eta = 12.0\n" };
        let settings = format!("window = 140\nhorizon = 301\n{eta}{more}");
        let noises = "[noises.arma]\nnumerator = [1.0, 0.5]\ndenominator = [1.0, -1.2, 0.5]\n";
        for order in [2, 6] {
            cases.push(Case::all(
                &format!("{name}, order {order}"),
                order,
                &settings,
                &format!("{noises}{IV}"),
            ));
        }
    }
}

/// Fewer figures, which is other ways through the code.
fn figures(cases: &mut Vec<Case>) {
    for (name, top) in [
        ("three figures", "measures = [\"e_a\", \"e_b\", \"e_x_max\"]"),
        ("impulse response", "measures = [\"e_a\", \"e_g\"]"),
        ("fresh data", "measures = [\"fit_fresh\"]"),
        ("rms of the state", "measures = [\"rms_x\"]"),
        ("no states", "measures = [\"e_a\", \"spectral_radius\"]"),
        ("curves", "measures = [\"e_a\", \"e_x_rms\"]\ncurves = true"),
        (
            "curves as printed",
            "measures = [\"e_x_max_as_printed\"]\ncurves = true\nparameters = true",
        ),
        ("curves alone", "measures = [\"e_a\"]\ncurves = true"),
        (
            "rounding",
            "measures = [\"e_a\", \"e_b\"]\nbounds = [{ measure = \"e_a\", rounding = 100.0 }, { measure = \"e_b\", \
             below = 0.1 }]",
        ),
    ] {
        for (order, eta, x0) in [(2, 30.0, "1.0"), (6, 60.0, "0.0"), (6, 0.0, "\"plant\"")] {
            let settings = format!("window = {}\nhorizon = 120\neta = {eta:?}\nx0 = {x0}", 3 * order + 3);
            cases.push(Case::new(
                &format!("{name}, order {order}, eta {eta}"),
                order,
                top,
                &settings,
                IV,
            ));
        }
    }
}

/// Everything that the lanes cover.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    orders(&mut cases);
    readings(&mut cases);
    observers(&mut cases);
    records(&mut cases);
    figures(&mut cases);
    // The paper's cells.
    for (window, eta, noise) in [
        (18, 0.0, "ar"),
        (98, 10.018, "ar"),
        (218, 10.014, "ar"),
        (98, 10.0, "white"),
        (218, 10.0, "white"),
    ] {
        let text = format!(
            "seed = 1\nmeasures = {ALL_MEASURES}\nparameters = true\n[settings]\nwindow = {window}\nhorizon = 400\n\
             eta = {eta:?}\nnoise = \"{noise}\"\n{IV}"
        );
        let name = format!("nikolov2023, {noise}, N = {window}");
        cases.push(Case { name, text });
    }
    if small() {
        let mut number = 0;
        cases.retain(|case| {
            number += 1;
            number % 6 == 1
                || case.name.ends_with("eta 300")
                || case.name.contains("N = 3n")
                || case.name.starts_with("curves")
        });
    }
    cases
}
