//! Experiment files that say what cannot be: one line each, with the place and what was expected.

use super::{EVERYTHING, Place, assert_same, stderr, succeeds};

impl Place {
    /// `check` and `run` refuse a file in the same words; nothing is left behind.
    pub fn refuses_file(&self, text: &str, parts: &[&str]) {
        self.write("bad.toml", text.as_bytes());
        let all = [&["bad.toml: "], parts].concat();
        self.refuses(&["check", "bad.toml"], &all);
        self.refuses(&["run", "bad.toml", "--out", "bad"], &all);
        assert!(!self.path("bad").exists(), "{text}");
    }

    pub fn accepts_file(&self, content: &[u8]) {
        self.write("good.toml", content);
        succeeds(&self.run(&["check", "good.toml"]));
    }
}

#[test]
fn unknown_keys_have_line_column_and_the_nearest_name() {
    let place = Place::new();
    for (text, parts) in [
        ("sed = 1", ["line 1, column 1", "'sed'", "did you mean 'seed'"]),
        ("\n[setings]\neta = 1", ["line 2, column 2", "'setings'", "'settings'"]),
        (
            "[settings]\n  wndow = 98",
            ["line 2, column 3", "'wndow'", "did you mean 'window'"],
        ),
        (
            "[[methods]]\nsolvr = \"lu\"",
            ["line 2, column 1", "'solvr'", "did you mean 'solver'"],
        ),
        (
            "[plants.m]\na = [0.5]\nunstabel = true",
            ["line 3, column 1", "'unstabel'", "'unstable'"],
        ),
        (
            "[noises.m]\nnumerater = [1]",
            ["line 2, column 1", "'numerater'", "'numerator'"],
        ),
        (
            "[feedbacks.m]\nidentfy = 3",
            ["line 2, column 1", "'identfy'", "'identify'"],
        ),
        (
            "[[slopes]]\nmeasur = \"e_a\"",
            ["line 2, column 1", "'measur'", "'measure'"],
        ),
        ("[[bounds]]\nbelo = 1", ["line 2, column 1", "'belo'", "'below'"]),
        ("[quick]\ntrial = 3", ["line 2, column 1", "'trial'", "'trials'"]),
        (
            "[quick]\ntrials = 3\n[quick.settings]\netaa = 1",
            ["line 4, column 1", "'etaa'", "'eta'"],
        ),
        ("exclude = [{ etta = 1 }]", ["line 1", "'etta'", "did you mean 'eta'"]),
        (
            "zip = [[\"eta\", \"windw\"]]",
            ["line 1", "'windw'", "did you mean 'window'"],
        ),
        ("measures = [\"e_aa\"]", ["line 1", "'e_aa'", "did you mean 'e_a'"]),
        (
            "store = \"summary\"",
            ["line 1, column 9", "'summary'", "summaries, trials"],
        ),
        (
            "trials = { untl = \"e_a\" }",
            ["line 1, column 12", "'untl'", "'until'"],
        ),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn wrong_types_have_line_and_column() {
    let place = Place::new();
    for (text, parts) in [
        ("seed = \"x\"", ["line 1, column 8", "expected u64"]),
        ("seed = -1", ["line 1, column 8", "-1"]),
        ("seed = 1.5", ["line 1, column 8", "1.5"]),
        ("title = 3", ["line 1, column 9", "expected a string"]),
        ("measures = \"e_a\"", ["line 1, column 12", "expected a sequence"]),
        ("settings = 3", ["line 1, column 12", "expected a map"]),
        ("trials = \"many\"", ["line 1, column 10", "whole number of trials"]),
        ("trials = 1.5", ["line 1, column 10", "whole number of trials"]),
        ("curves = 1", ["line 1, column 10", "expected a boolean"]),
        ("compare = [[\"ls\"]]", ["line 1", "length 2"]),
        ("[settings]\neta = true", ["line 2, column 7", "expected a number"]),
        ("[settings]\neta = [[1]]", ["line 2, column 7", "a list within a list"]),
        ("[settings]\neta = [1, 1.0]", ["line 2, column 7", "1 is given twice"]),
        (
            "[settings]\neta = { arange = [1, 2, 3] }",
            ["line 2", "expected linspace or logspace"],
        ),
        (
            "[settings]\neta = { linspace = [1, 2, 2.5] }",
            ["line 2", "whole count"],
        ),
        ("[settings]\neta = { logspace = [0, 2, 3] }", ["line 2", "ends above 0"]),
        (
            "[[methods]]\niterations = -1",
            ["line 2, column 14", "expected a whole number"],
        ),
        (
            "[[methods]]\nsolver = true",
            ["line 2, column 10", "expected a whole number, a fraction, a text"],
        ),
        ("seed = = 1", ["line 1", "="]),
        ("seed = 1\nseed = 2", ["line 2", "duplicate"]),
        ("[settings", ["line 1", "unclosed"]),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn lists_and_grids() {
    let place = Place::new();
    let thousand = "{ linspace = [1, 1000, 1000] }";
    let large = format!("[settings]\neta = {thousand}\namplitude = {thousand}\nx0 = {thousand}");
    place.refuses_file(&large, &["settings", "1000000000 cells", "at most 100000"]);
    let long: Vec<String> = (0..300_000).map(|i| i.to_string()).collect();
    let long = format!("[settings]\neta = [{}]", long.join(","));
    place.refuses_file(&long, &["line 2, column 7", "more than 10000 values"]);
    for (text, parts) in [
        ("[settings]\neta = []", ["line 2, column 7", "an empty list"]),
        ("measures = []", ["measures", "an empty list"]),
        ("methods = []", ["methods", "an empty list"]),
        ("[[methods]]\nsolver = []", ["methods[0].solver", "an empty list"]),
        ("[[methods]]\nreport = []", ["methods[0].report", "an empty list"]),
        (
            "zip = [[\"eta\", \"window\"]]\n[settings]\neta = [1, 2]\nwindow = [18, 28, 38]",
            ["zip: 'eta' has 2 values", "'window' 3"],
        ),
        (
            "zip = [[\"eta\", \"window\"]]\n[settings]\neta = [1, 2]",
            ["zip: 'eta' has 2", "'window' 1"],
        ),
        (
            "zip = [[\"eta\", \"l\"]]\n[settings]\neta = [1, 2]",
            ["zip: 'l'", "no list"],
        ),
        ("zip = [[\"eta\", \"eta\"]]", ["zip: 'eta'", "is given twice"]),
        (
            "exclude = [{ eta = [1, 2] }]\n[settings]\neta = [1, 2]",
            ["exclude", "no cell"],
        ),
        ("exclude = [{}]", ["exclude", "no cell"]),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn settings_that_cannot_be() {
    let place = Place::new();
    for (text, parts) in [
        (
            "window = 17",
            [
                "window",
                "too short for order 6: expected any whole number from 3n = 18 on, even or odd",
            ],
        ),
        ("window = [98, 12]", ["window", "12 samples is too short"]),
        (
            "l = 2\nwindow = 98",
            ["l: cannot be set together with 'window'", "N = 3n + 2l"],
        ),
        ("l = -1", ["l: -1", "whole number"]),
        ("window = 98.5", ["window: 98.5", "whole number"]),
        ("window = 1e12", ["window: 1000000000000", "10000000"]),
        ("horizon = 1e8", ["horizon: 100000000", "10000000"]),
        ("window = 9999999", ["horizon", "10000199 samples"]),
        (
            "horizon = 97",
            ["horizon", "K = 97 samples is shorter than the window N = 98"],
        ),
        (
            "window = 98\nhorizon = 98",
            [
                "horizon: the record of K = 98 samples ends",
                "'e_x_max' has no sample k >= N",
            ],
        ),
        (
            "eta_of = \"measured\"\neta = [5, 100]",
            ["eta: 100 % of the measured output", "less than 100 %"],
        ),
        ("horizon = \"automatic\"", ["horizon: 'automatic'", "expected a number"]),
        ("order = 0", ["order", "at least 1"]),
        ("order = -2", ["order: -2", "whole number"]),
        ("order = 1000", ["window", "order 1000"]),
        ("order = 1001", ["order: ", "at most 1000"]),
        ("order = 100000", ["order: ", "at most 1000"]),
        (
            "plant = \"random\"\nplant_order = 20000",
            ["plant_order: ", "at most 1000"],
        ),
        (
            "plant = \"random\"\nplant_order = 1000\norder = 2\nhorizon = 1e6",
            ["horizon: a record", "7676 MiB; expected at most 4096"],
        ),
        ("eta = nan", ["line 2, column 7", "not a finite number"]),
        ("eta = [1, inf]", ["line 2", "inf is not a finite number"]),
        ("eta = -1", ["eta: -1", "at least 0"]),
        ("eta = \"ten\"", ["eta: 'ten'", "expected a number"]),
        ("amplitude = 0", ["amplitude", "positive"]),
        ("amplitude = -1", ["amplitude", "-1"]),
        // Noise and errors would underflow, or squares overflow.
        ("amplitude = 1e-163", ["amplitude of 1e-163", "1e-100 to 1e100"]),
        ("amplitude = 1e163", ["amplitude of 1e163", "1e-100 to 1e100"]),
        ("x0 = 1e-163", ["initial state of 1e-163", "1e-100 to 1e100"]),
        ("process_noise = 1e160", ["process noise of 1e160", "1e-100 to 1e100"]),
        ("input_noise = -1", ["input-measurement noise", "-1 %"]),
        ("x0 = \"plan\"", ["x0: 'plan'", "\"plant\""]),
        ("x0 = \"plant\"", ["x0", "no x0"]),
        ("plant = \"random\"\npole_radius = 1", ["radius in (0, 1)", "1"]),
        ("plant = \"random\"\nplant_order = 0", ["order", "at least 1"]),
        ("plant = \"nikolov2032\"", ["plant: ", "did you mean 'nikolov2023'"]),
        ("noise = \"whit\"", ["noise: ", "did you mean 'white'"]),
        ("noise = 3", ["noise: ", "'3'"]),
        ("feedback = \"non\"", ["feedback: ", "did you mean 'none'"]),
        ("input = \"sings\"", ["input: ", "did you mean 'signs'"]),
        (
            "sequence = \"independant\"",
            ["sequence: ", "did you mean 'independent'"],
        ),
        ("eta_over = \"exac\"", ["eta_over: ", "did you mean 'exact'"]),
        ("eta_of = \"noisefree\"", ["eta_of: ", "did you mean 'noise-free'"]),
        ("observer_start = \"x0\"", ["observer_start: ", "x0-hat"]),
        (
            "numerator = \"statespace\"",
            ["numerator: ", "did you mean 'state-space'"],
        ),
        ("gain = \"deadbeat\"", ["gain: ", "dead-beat"]),
        ("gain = \"poles:0.1,0.2\"", ["gain: ", "2 poles, but the order is 6"]),
        ("gain = \"scaled:x\"", ["gain: ", "'x'"]),
    ] {
        place.refuses_file(&format!("[settings]\n{text}"), &parts);
    }
    place.refuses_file(
        "curves = true\n[settings]\nhorizon = [400, 200000]",
        &["horizon: curves = true", "1954 MiB; expected at most 1024"],
    );
}

#[test]
fn plants_noises_and_feedbacks() {
    let place = Place::new();
    let unstable = "[settings]\nplant = \"m\"\nnoise = \"white\"\n[plants.m]\na = [1.2]\nb = [1]\n";
    place.refuses_file(unstable, &["plants.m", "not stable", "unstable = true"]);
    place.accepts_file(format!("{unstable}unstable = true").as_bytes());
    // Noise of a level that no trial can have: every trial failed.
    let nominal = unstable.replace("[plants", "eta_over = \"nominal\"\neta = 5\n[plants");
    place.refuses_file(
        &format!("{nominal}unstable = true"),
        &["eta_over: \"nominal\"", "not stable", "\"exact\""],
    );
    let quiet = nominal.replace("eta = 5", "eta = 0");
    place.accepts_file(format!("{quiet}unstable = true").as_bytes());
    let silent = "[settings]\neta = 5\nnoise = \"m\"\n[noises.m]\nnumerator = ";
    for numerator in ["[0.0]", "[0.0, 0]", "[1e-300]"] {
        place.refuses_file(
            &format!("{silent}{numerator}"),
            &["noises.m: eta = 5 %", "variance 0", "not zero"],
        );
    }
    place.accepts_file(format!("{silent}[0.0, 1.0]").as_bytes());
    // Without a figure of the state, or scored from the start, the record may end with the window.
    for measures in [
        "measures = [\"e_a\"]\n[settings]",
        "[settings]\nscored_from = \"start\"",
    ] {
        place.accepts_file(format!("{measures}\nwindow = 98\nhorizon = 98").as_bytes());
    }
    let plant = "[settings]\nplant = \"m\"\n[plants.m]\n";
    let noise = "[settings]\nnoise = \"m\"\n[noises.m]\n";
    let feedback = "[settings]\nfeedback = \"m\"\n[feedbacks.m]\n";
    for (head, text, parts) in [
        (plant, "a = [0.5]", ["plants.m", "either b or h"]),
        (plant, "a = [0.5]\nb = [1]\nh = [1]", ["plants.m", "either b or h"]),
        (plant, "a = []\nb = []", ["plants.m", "n >= 1"]),
        (plant, "a = [0.5]\nb = [1, 2]", ["plants.m", "one length"]),
        (plant, "a = [nan]\nb = [1]", ["plants.m", "finite"]),
        (noise, "numerator = []", ["noises.m", "at least one"]),
        (
            noise,
            "numerator = [1]\ndenominator = [2]",
            ["noises.m", "beginning with 1"],
        ),
        (
            noise,
            "numerator = [1]\ndenominator = [1, -2]",
            ["noises.m", "unit circle"],
        ),
        (feedback, "", ["feedbacks.m", "numerator"]),
        (
            feedback,
            "state_gain = [1]\nidentify = 50",
            ["feedbacks.m", "6 numbers"],
        ),
        (
            feedback,
            "numerator = [0.3]\nidentify = 5",
            ["feedbacks.m", "state_gain and identify"],
        ),
        (
            feedback,
            "state_gain = [0, 0, 0, 0, 0, 0]\nidentify = 100000000",
            ["feedbacks.m", "identify"],
        ),
        (feedback, "numerator = [0.3]\nreference = -1", ["amplitude", "-1"]),
        ("", "[plants.random]\na = [0.5]\nb = [1]", ["plants.random", "built in"]),
        ("", "[noises.ar]\nnumerator = [1]", ["noises.ar", "built in"]),
        ("", "[feedbacks.none]\nnumerator = [1]", ["feedbacks.none", "built in"]),
    ] {
        place.refuses_file(&format!("{head}{text}"), &parts);
    }
}

#[test]
fn methods() {
    let place = Place::new();
    for (text, parts) in [
        ("estimator = \"lss\"", ["line 2, column 13", "did you mean 'ls'"]),
        (
            "estimator = \"ls\"\niterations = 3",
            ["methods[0] (ls): 'iterations'", "'iv' or 'wnsf' only"],
        ),
        (
            "estimator = \"ls\"\nauxiliary = \"frozen\"",
            ["methods[0] (ls): 'auxiliary'", "'iv' only"],
        ),
        ("solver = \"luu\"", ["methods[0] (iv)", "did you mean 'lu'"]),
        ("solver = [\"lu\", \"cholesky\"]", ["methods[1]", "least squares only"]),
        (
            "solver = \"qr\"\nstage10 = \"as-printed\"",
            ["methods[0]", "'partitioned' only"],
        ),
        ("report = [0, 9]", ["methods[0].report", "no pass 9"]),
        ("iterations = 0", ["methods[0] (iv)", "1 to 1000"]),
        ("iterations = 1000000", ["methods[0] (iv)", "1 to 1000"]),
        ("gain = \"x\"", ["methods[0] (iv)", "unknown gain 'x'"]),
        ("gain = \"poles:0.1\"", ["methods[0]", "1 poles, but the order is 6"]),
        (
            "instruments = \"r\"\ndrive = \"observer\"",
            ["methods[0]", "need drive 'model'"],
        ),
        ("[[methods]]", ["methods", "two outputs are called 'ls'"]),
        (
            "name = \"a\"\n[[methods]]\nname = \"a\"",
            ["methods", "two outputs are called 'a"],
        ),
        (
            "command = [\"a\"]",
            ["methods[0].name", "expected a name for the method"],
        ),
        (
            "name = \"a\"\ncommand = [\"a\"]\nbatch = 65537",
            ["methods[0].batch", "1 to 65536"],
        ),
        (
            "name = \"a\"\ncommand = [\"a\"]\nworkers = 1025",
            ["methods[0].workers", "1 to 1024"],
        ),
    ] {
        place.refuses_file(&format!("[[methods]]\n{text}"), &parts);
    }
}

#[test]
fn comparisons_slopes_and_bounds() {
    let place = Place::new();
    for (text, parts) in [
        ("compare = [[\"iv(5)\", \"ls\"]]", ["compare", "did you mean 'iv(4)'"]),
        (
            "compare = [[\"ls\", \"ls\"]]",
            ["compare", "'ls' is compared with itself"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_a\"\nover = \"eta\"",
            ["slopes.over", "no list"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_g\"\nover = \"eta\"\n[settings]\neta = [1, 2]",
            ["slopes", "not among the measures"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_a\"\nover = \"noise\"\n[settings]\nnoise = [\"ar\", \"white\"]",
            ["slopes.over: 'noise'", "numbers above 0"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_a\"\nover = \"eta\"\nfrom = 2\n[settings]\neta = [1, 2]",
            ["slopes.over: 'eta'", "at least two values"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_a\"\nover = \"eta\"\nfrom = nan\n[settings]\neta = [1, 2]",
            ["slopes.over: 'eta'", "at least two values"],
        ),
        (
            "[[slopes]]\nmeasure = \"e_a\"\nover = \"eta\"\n[settings]\neta = [0, 1, 2]",
            ["slopes.over: 'eta'", "above 0"],
        ),
        (
            "[[bounds]]\nmeasure = \"e_a\"",
            ["bounds", "'below', 'rounding' or both"],
        ),
        ("[[bounds]]\nmeasure = \"e_a\"\nbelow = nan", ["bounds", "finite"]),
        (
            "[[bounds]]\nmeasure = \"e_g\"\nbelow = 1",
            ["bounds", "not among the measures"],
        ),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn numbers_of_trials() {
    let place = Place::new();
    let until = "output = \"ls\", relative_mcse = 0.1, minimum = 1, maximum = 2 }";
    for (text, parts) in [
        ("trials = 0", ["trials", "1 to 4000000000"]),
        ("trials = -5", ["line 1, column 10", "expected at least 1"]),
        ("trials = 5000000000", ["trials", "1 to 4000000000"]),
        (
            "trials = 99999999999999999999",
            ["line 1, column 10", "99999999999999999999"],
        ),
        ("[quick]\ntrials = 0", ["quick.trials", "1 to 4000000000"]),
        ("[quick]\ntrials = -1", ["line 2, column 10", "-1"]),
        ("[quick]\ntrials = 5000000000", ["quick.trials", "1 to 4000000000"]),
        (
            &format!("trials = {{ until = \"e_g\", {until}"),
            ["trials.until", "not among the measures"],
        ),
        (
            &format!("trials = {{ until = \"e_c\", {until}"),
            ["line 1", "unknown measure 'e_c'"],
        ),
        (
            &format!("trials = {{ until = \"e_a\", {}", until.replace("ls", "lss")),
            ["trials.output", "did you mean 'ls'"],
        ),
        (
            &format!("trials = {{ until = \"e_a\", {}", until.replace("0.1", "0")),
            ["trials", "above 0"],
        ),
        (
            &format!("trials = {{ until = \"e_a\", {}", until.replace("0.1", "nan")),
            ["trials", "above 0"],
        ),
        (
            &format!("trials = {{ until = \"e_a\", {}", until.replace("= 1,", "= 3,")),
            ["trials", "'minimum' is above"],
        ),
        (
            &format!("trials = {{ until = \"e_a\", {}", until.replace("= 1,", "= 0,")),
            ["trials", "1 to 4000000000"],
        ),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn files_that_are_none() {
    let place = Place::new();
    place.refuses(&["check", "none.toml"], &["none.toml", "No such file"]);
    place.refuses(&["check", "."], &[".: no results in this folder"]);
    place.write("binary.toml", &[0xff, 0xfe, 0, 1, 2]);
    place.refuses(&["run", "binary.toml"], &["binary.toml", "UTF-8"]);
    place.write("deep.toml", format!("a = {}", "[".repeat(100_000)).as_bytes());
    place.refuses(&["check", "deep.toml"], &["deep.toml", "line 1"]);
    // A file without anything is the experiment of every default.
    place.accepts_file(b"");
    place.accepts_file(format!("# {}", "x".repeat(10_000_000)).as_bytes());
    let noise: String = "[noises.m]\nnumerator = [".to_owned() + &"1.5, ".repeat(2_000_000) + "]\nx = 1";
    place.refuses_file(&noise, &["line 3, column 1", "unknown key 'x'"]);
}

/// A byte-order mark and the line ends of another system are no part of a study.
#[test]
fn marks_and_line_ends_move_no_bit() {
    let place = Place::new();
    let expected = place.results("plain", &["--trials", "20"]);
    for (name, text) in [
        ("mark", format!("\u{feff}{EVERYTHING}")),
        ("crlf", EVERYTHING.replace('\n', "\r\n")),
        ("both", format!("\u{feff}{}", EVERYTHING.replace('\n', "\r\n"))),
    ] {
        place.write(&format!("{name}.toml"), text.as_bytes());
        let output = place.run(&["run", &format!("{name}.toml"), "--out", name, "--trials", "20"]);
        assert_eq!(output.status.code(), Some(0), "{name}: {}", stderr(&output));
        assert_same(&super::contents(&place.path(name)), &expected, name);
    }
    // Lines are counted alike.
    place.refuses_file("\u{feff}seed = 1\r\nsed = 2\r\n", &["line 2, column 1", "'sed'"]);
}

#[test]
fn plants_that_change() {
    let place = Place::new();
    let change = "[settings]\nchange = \"m\"\n[changes.m]\n";
    place.accepts_file(format!("{change}at = 50\ngain = 2").as_bytes());
    place.refuses_file("[settings]\nchange = \"non\"", &["change: ", "did you mean 'none'"]);
    let looped = format!(
        "{}feedback = \"l\"\n[feedbacks.l]\nnumerator = [0.1]\n",
        change.replace("[changes.m]\n", "")
    );
    let looped = format!("{looped}[changes.m]\nat = 50\ngain = 2");
    place.refuses_file(&looped, &["settings: a plant that changes", "open loop only"]);
    let lanes = format!("engine = \"lanes\"\n{change}at = 50\ngain = 2");
    place.refuses_file(&lanes, &["engine: \"lanes\" do not cover a plant that changes"]);
    let known = format!("{change}at = 50\ngain = 2\n[[methods]]\nestimator = \"known\"");
    place.refuses_file(&known, &["one plant for all trials and samples"]);
    for (text, parts) in [
        ("at = 50", ["changes.m", "expected a plant, or a gain"]),
        ("gain = 2", ["line 3", "missing field `at`"]),
        ("at = 400\ngain = 2", ["changes.m.at: 400", "K = 400"]),
        (
            "at = 50\ngain = 2\nplant = \"random\"",
            ["changes.m", "both a plant and factors"],
        ),
        ("at = 50\nplant = \"random\"", ["changes.m", "one plant for all trials"]),
        (
            "at = 50\nplant = \"o\"\n[plants.o]\na = [0.5]\nb = [1]",
            ["settings: a plant of order 6", "order 1"],
        ),
        ("at = 50\npoles = 2.6", ["changes.m", "not stable"]),
    ] {
        place.refuses_file(&format!("{change}{text}"), &parts);
    }
}

/// An option that is true or false is read from a file, and from the manifest that results have of it.
#[test]
fn a_boolean_option_is_read_back() {
    let place = Place::new();
    let study = "trials = 2\nmeasures = [\"e_g\"]\n[settings]\nplant = \"mine\"\nnoise = \"white\"\neta = 5\n\
                 window = 400\n\
                 [plants.mine]\nA = [1, -1.8, 0.82]\nB = [0, 0.1, 0.1]\n[[methods]]\nestimator = \"srivc\"\n\
                 orders = \"nb=2,nf=2,nk=1\"\nts = 0.1\nintegrator = false\n";
    place.write("study.toml", study.as_bytes());
    succeeds(&place.run(&["run", "study.toml", "--out", "out"]));
    succeeds(&place.run(&["report", "out"]));
    place.refuses_file(
        &study.replace("= false", "= 0"),
        &["bad.toml: line 15, column 14", "expected a boolean"],
    );
}
