//! The experiment file of a case, with comments.

use super::arguments::Arguments;
use super::case::{Case, noise_filter};
use super::methods::{Chosen, Methods};
use super::places::Places;
use crate::cli::estimate::words::chance;
use crate::cli::template::filled;
use crate::signal::arithmetic::variance;
use crate::text::{beginning, number, rounded, visible};

/// Returns the file's text.
pub(super) fn text(case: &Case, arguments: &Arguments, methods: &Methods, places: &Places) -> String {
    let (model, name) = (&case.model, arguments.estimator);
    let record = visible(beginning(&Places::name(&case.report.file), 100));
    let denominators = [("A", &model.a), ("F", &model.f)];
    let denominators = denominators.iter().filter(|(_, polynomial)| polynomial.len() > 1);
    let denominators = denominators.map(|(name, polynomial)| format!("{name} = {}\n", list(polynomial)));
    let noise = noise_filter(model).map(|filter| {
        let (c, d) = (list(filter.numerator()), list(&filter.denominator()));
        format!("C = {c}\nD = {d}\n")
    });
    filled(
        include_str!("template.toml"),
        &[
            ("title", quoted(&format!("A study of {record}"))),
            ("record", record),
            ("n", case.report.window.to_string()),
            ("detrended", case.detrended()),
            ("name", name.to_string()),
            ("about", about(case, arguments, methods)),
            ("samples", samples(case).to_owned()),
            ("input", input(case, places)),
            ("lambda", rounded(model.noise_variance, 6)),
            ("eta", number(case.eta())),
            ("denominators", denominators.collect()),
            ("B", list(&model.b)),
            ("x0", list(&case.x0)),
            ("noise", noise.unwrap_or_default()),
            ("tables", tables(case, places)),
            ("methods", methods.chosen.iter().map(table).collect()),
            ("claims", claims(case, methods)),
        ],
    )
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

/// Comments on the case and its methods.
fn about(case: &Case, arguments: &Arguments, methods: &Methods) -> String {
    let equation = case.model.equation(Some(6));
    let lines = equation.lines().map(|line| format!("    {line}"));
    let lines = lines.chain([
        input_in_words(case),
        noise_in_words(case).to_owned(),
        loop_in_words(case, arguments.open_loop),
    ]);
    let doubts = doubts(case).into_iter().map(|doubt| format!("WARNING: {doubt}"));
    let left_out = methods.left_out.iter().map(|reason| format!("Left out: {reason}"));
    let lines = lines.chain(doubts).chain(left_out);
    lines.fold(String::new(), |text, line| text + "# " + &line + "\n")
}

const fn samples(case: &Case) -> &'static str {
    match case.spectrum {
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
    }
}

/// The settings of feedback, input and window.
fn input(case: &Case, places: &Places) -> String {
    let n = case.report.window;
    let feedback = match case.feedback {
        Some(_) => "# u = r - K(q) y\nfeedback = \"record\"\n",
        None => "",
    };
    let input = if case.spectrum.is_some() {
        let amplitude = number(variance(&case.input.1).sqrt());
        let windows = format!("window = [{n}, {}, {}]", 2 * n, 4 * n);
        format!("input = \"spectrum\"\namplitude = {amplitude}\n{windows}\n")
    } else {
        let column = format!("file:{}#{}", Places::name(&places.record), case.input.0);
        format!("input = {}\nwindow = {n}\n", quoted(&column))
    };
    feedback.to_owned() + &input
}

/// The residuals that are drawn, and the tables of spectrum and feedback.
fn tables(case: &Case, places: &Places) -> String {
    let residuals = case.drawn.as_ref().map(|_| {
        let column = quoted(&format!("file:{}#e", Places::name(&places.residuals)));
        format!(
            "# Centred and scaled to the estimated variance, which divides by N less the parameters.\nresiduals = \
             {column}\n"
        )
    });
    let spectrum = case.spectrum.as_ref().map(|filter| {
        let (input, d) = (case.input.0, list(&filter.denominator()));
        format!("\n# The spectrum of {input}.\n[noises.spectrum]\nD = {d}\n")
    });
    let feedback = case.feedback.as_ref().map(|law| {
        let (numerator, denominator) = (list(law.numerator()), list(&law.denominator()));
        format!("\n[feedbacks.record]\nnumerator = {numerator}\ndenominator = {denominator}\n")
    });
    [residuals, spectrum, feedback].into_iter().flatten().collect()
}

/// The table of a method.
fn table(method: &Chosen) -> String {
    // Texts and numbers are the same in both notations.
    let options = method.options.iter().map(|(key, value)| format!("{key} = {value}\n"));
    let report = method.pass.map(|pass| format!("report = [{pass}]\n"));
    let options: String = options.chain(report).collect();
    format!("\n[[methods]]\nestimator = \"{}\"\n{options}", method.name)
}

fn claims(case: &Case, methods: &Methods) -> String {
    // Of a normal law whose mean is a quarter of its standard deviation off, 40 or 60 % are above the truth.
    const BIAS: &str = "statistic = \"share-above\", between = [0.4, 0.6]";
    const COVERAGE: &str = "statistic = \"coverage\", between = [0.9, 0.99]";
    let claim = |id: &str, text: &str, test: &str| {
        format!("\n[[claims]]\nid = \"{id}\"\ntext = \"{text}\"\nsource = \"own\"\ntest = {test}\n")
    };
    let of_method = |Chosen {
                         name, label, errors, ..
                     }: &Chosen| {
        let test = |of: &str| format!("{{ value = \"parameters\", of = \"{label}\", {of} }}");
        let (id, of_errors, test) = if *errors {
            let intervals = "95 % intervals miss each coefficient in 1 to 10 % of such records";
            ("errors", intervals, format!("[{}, {}]", test(BIAS), test(COVERAGE)))
        } else {
            ("bias", "standard errors: none", test(BIAS))
        };
        let text = format!(
            "{label}: 40 to 60 % of the estimates of every coefficient are above the truth, as they are where the \
             bias is within a quarter of the spread; {of_errors}."
        );
        claim(&format!("{id}-{name}"), &text, &test)
    };
    let mut text: String = methods.chosen.iter().map(of_method).collect();
    if let [own, others @ ..] = &methods.labels()[..]
        && !others.is_empty()
    {
        let best = format!("No other method has an e_g that is 5 % smaller than that of {own} in a typical trial.");
        let test = format!("{{ ratio = \"e_g\", of = {others:?}, to = \"{own}\", above = 0.95 }}");
        text += &claim("best", &best, &test);
        if case.spectrum.is_some() {
            let (n, most) = (case.report.window, 4 * case.report.window);
            let falls = format!(
                "The e_g of {own} falls with the square root of N: four times the samples halve the error of a typical \
                 trial."
            );
            let test = format!(
                "{{ cells = \"e_g\", of = \"{own}\", axis = \"window\", from = {n}, to = {most}, between = [0.43, \
                 0.58] }}"
            );
            text += &claim("samples", &falls, &test);
        }
    }
    text
}
