//! The experiment file of a case, with comments.

use super::arguments::Arguments;
use super::case::{Case, noise_filter};
use super::methods::{Chosen, Methods};
use super::places::Places;
use crate::cli::estimate::words::chance;
use crate::signal::arithmetic::variance;
use crate::text::{beginning, number, rounded, visible};
use std::fmt::{self, Write};

/// Returns the file's text.
pub(super) fn text(case: &Case, arguments: &Arguments, methods: &Methods, places: &Places) -> String {
    let mut text = String::new();
    let written = write(&mut text, case, arguments, methods, places);
    written.expect("writing to a string does not fail");
    text
}

/// Describes the input of the trials.
pub(super) fn input_in_words(case: &Case) -> String {
    let (name, n) = (case.input.0, case.report.window);
    match &case.spectrum {
        None => format!("Every trial has the record's own {name}, {n} samples."),
        Some(filter) => format!(
            "{name} is drawn anew in every trial: Gaussian, with the spectrum of the record's {name} about its mean, \
             an autoregression of order {}.",
            filter.denominator().len() - 1
        ),
    }
}

/// Describes the noise of the trials.
pub(super) fn noise_in_words(case: &Case) -> &'static str {
    if case.drawn.is_some() {
        "Noise is drawn with replacement from the record's residuals."
    } else {
        "Noise is Gaussian, of the estimated variance."
    }
}

/// Describes whether the trials are in closed loop, and how that is known.
pub(super) fn loop_in_words(case: &Case, open: bool) -> String {
    match (&case.feedback, case.report.feedback.filter(|_| !open)) {
        (Some(_), _) => "The loop is closed by the feedback that was given.".to_owned(),
        (None, Some(test)) => format!(
            "The loop is open: u does not follow y, as a strong feedback would show ({}).",
            chance(test.p_value)
        ),
        (None, None) => "The loop is open, as --open-loop says.".to_owned(),
    }
}

/// Returns reasons why the trials may differ from the record.
pub(super) fn doubts(case: &Case) -> Vec<String> {
    let Some(residuals) = &case.residuals else {
        return Vec::new();
    };
    let tests = [
        (
            residuals.white,
            "the residuals are not white: the trials have another noise than the record",
        ),
        (
            residuals.free_of_past_input,
            "past input explains residuals: the trials have another plant than the record",
        ),
    ];
    let failed = tests
        .into_iter()
        .filter_map(|(test, doubt)| Some((test.filter(|test| !test.passed)?, doubt)));
    failed
        .map(|(test, doubt)| format!("{doubt} ({}); expected other orders", chance(test.p_value)))
        .collect()
}

/// Formats a TOML string. JSON's form is the same if there are no invisible characters.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().copied().map(number).collect();
    format!("[{}]", numbers.join(", "))
}

fn write(text: &mut String, case: &Case, arguments: &Arguments, methods: &Methods, places: &Places) -> fmt::Result {
    let record = visible(beginning(&Places::name(&case.report.file), 100));
    let (name, n) = (arguments.estimator, case.report.window);
    writeln!(
        text,
        "# A study of the record {record}: {n} samples, {}. Its plant and noise are those that {name} \
         estimated:",
        case.detrended()
    )?;
    let equation = case.model.equation().rounded(6).to_string();
    for line in equation.lines() {
        writeln!(text, "#     {line}")?;
    }
    writeln!(text, "# {}\n# {}", input_in_words(case), noise_in_words(case))?;
    writeln!(text, "# {}", loop_in_words(case, arguments.open_loop))?;
    for doubt in doubts(case) {
        writeln!(text, "# WARNING: {doubt}")?;
    }
    for reason in &methods.left_out {
        writeln!(text, "# Left out: {reason}")?;
    }
    writeln!(
        text,
        "# `asobench run` answers for a plant like this one: how far each method is off (medians of errors; in the \
         report bias and\n\
         # spread of every coefficient), whether its bias matters beside its spread, and whether its standard errors \
         can be\n\
         # trusted (claims)."
    )?;
    let samples = match case.spectrum {
        None => {
            "# How many samples for a wanted accuracy? The spread falls with the square root of N for an input like \
             this one:\n\
                 # half of it takes four times the samples. `--trial-input spectrum` runs N, 2N and 4N."
        }
        Some(_) => {
            "# How many samples for a wanted accuracy? Compare the windows N, 2N and 4N: the claim 'samples' tells \
             whether errors\n\
                    # fall with the square root of N."
        }
    };
    writeln!(text, "{samples}")?;
    writeln!(text, "title = {}", quoted(&format!("A study of {record}")))?;
    writeln!(
        text,
        "question = \"How accurate are the methods for a plant like that of the record?\""
    )?;
    writeln!(
        text,
        "hypothesis = \"A method whose structure contains plant and noise has no relevant bias.\""
    )?;
    writeln!(
        text,
        "seed = 1\ntrials = 1000\nmeasures = [\"e_a\", \"e_b\", \
         \"e_g\", \"fit_fresh\"]\ncoverage = true"
    )?;
    write_settings(text, case, places)?;
    write_tables(text, case, places)?;
    for method in &methods.chosen {
        writeln!(text, "\n[[methods]]\nestimator = \"{}\"", method.name)?;
        for (key, value) in &method.options {
            // Texts and numbers are the same in both notations.
            writeln!(text, "{key} = {value}")?;
        }
        if let Some(pass) = method.pass {
            writeln!(text, "report = [{pass}]")?;
        }
    }
    write_claims(text, case, methods)?;
    writeln!(text, "\n[quick]\ntrials = 50")
}

fn write_settings(text: &mut String, case: &Case, places: &Places) -> fmt::Result {
    let n = case.report.window;
    writeln!(
        text,
        "\n[settings]\nplant = \"record\"\nnoise = \"record\"\n# As estimated.\nx0 = \"plant\""
    )?;
    if case.feedback.is_some() {
        writeln!(text, "# u = r - K(q) y\nfeedback = \"record\"")?;
    }
    if case.spectrum.is_some() {
        let amplitude = number(variance(&case.input.1).sqrt());
        let windows = format!("window = [{n}, {}, {}]", 2 * n, 4 * n);
        writeln!(text, "input = \"spectrum\"\namplitude = {amplitude}\n{windows}")?;
    } else {
        let column = format!("file:{}#{}", Places::name(&places.record), case.input.0);
        writeln!(text, "input = {}\nwindow = {n}", quoted(&column))?;
    }
    writeln!(
        text,
        "# eta/100 is the standard deviation of e: 100 sqrt(lambda), lambda = {} as estimated.\neta_over = \
         \"absolute\"\neta = {}",
        rounded(case.model.noise_variance, 6),
        number(case.eta())
    )
}

fn write_tables(text: &mut String, case: &Case, places: &Places) -> fmt::Result {
    let model = &case.model;
    writeln!(text, "\n# A(q) y = B(q)/F(q) u + noise\n[plants.record]")?;
    for (name, polynomial) in [("A", &model.a), ("F", &model.f)] {
        if polynomial.len() > 1 {
            writeln!(text, "{name} = {}", list(polynomial))?;
        }
    }
    writeln!(text, "B = {}\nx0 = {}", list(&model.b), list(&case.x0))?;
    writeln!(
        text,
        "\n# The noise on y is C/D of this table: that of the model over its A, too.\n[noises.record]"
    )?;
    if let Some(filter) = noise_filter(model) {
        writeln!(
            text,
            "C = {}\nD = {}",
            list(filter.numerator()),
            list(&filter.denominator())
        )?;
    }
    if case.drawn.is_some() {
        let column = format!("file:{}#e", Places::name(&places.residuals));
        writeln!(
            text,
            "# Centred and scaled to the estimated variance, which divides by N less the parameters.\nresiduals = {}",
            quoted(&column)
        )?;
    }
    if let Some(filter) = &case.spectrum {
        writeln!(
            text,
            "\n# The spectrum of {}.\n[noises.spectrum]\nD = {}",
            case.input.0,
            list(&filter.denominator())
        )?;
    }
    if let Some(law) = &case.feedback {
        writeln!(
            text,
            "\n[feedbacks.record]\nnumerator = {}\ndenominator = {}",
            list(law.numerator()),
            list(&law.denominator())
        )?;
    }
    Ok(())
}

fn write_claims(text: &mut String, case: &Case, methods: &Methods) -> fmt::Result {
    // Of a normal law whose mean is a quarter of its standard deviation off, 40 or 60 % are above the truth.
    const BIAS: &str = "statistic = \"share-above\", between = [0.4, 0.6]";
    const COVERAGE: &str = "statistic = \"coverage\", between = [0.9, 0.99]";
    for Chosen {
        name, label, errors, ..
    } in &methods.chosen
    {
        let test = |of: &str| format!("{{ value = \"parameters\", of = \"{label}\", {of} }}");
        let (id, claim, test) = if *errors {
            let claim = "95 % intervals miss each coefficient in 1 to 10 % of such records";
            ("errors", claim, format!("[{}, {}]", test(BIAS), test(COVERAGE)))
        } else {
            ("bias", "standard errors: none", test(BIAS))
        };
        writeln!(
            text,
            "\n[[claims]]\nid = \"{id}-{name}\"\n\
             text = \"{label}: 40 to 60 % of the estimates of every coefficient are above the truth, as they are where \
             the bias is within a quarter of the spread; {claim}.\"\nsource = \
             \"own\"\n\
             test = {test}"
        )?;
    }
    if let [own, others @ ..] = &methods.labels()[..]
        && !others.is_empty()
    {
        writeln!(
            text,
            "\n[[claims]]\nid = \"best\"\n\
             text = \"No other method has an e_g that is 5 % smaller than that of {own} in a typical trial.\"\nsource \
             = \"own\"\n\
             test = {{ ratio = \"e_g\", of = {others:?}, to = \"{own}\", above = 0.95 }}"
        )?;
        if case.spectrum.is_some() {
            let n = case.report.window;
            writeln!(
                text,
                "\n[[claims]]\nid = \"samples\"\n\
                 text = \"The e_g of {own} falls with the square root of N: four times the samples halve the error of \
                 a typical trial.\"\n\
                 source = \"own\"\n\
                 test = {{ cells = \"e_g\", of = \"{own}\", axis = \"window\", from = {n}, to = {}, \
                 between = [0.43, 0.58] }}",
                4 * n
            )?;
        }
    }
    Ok(())
}
