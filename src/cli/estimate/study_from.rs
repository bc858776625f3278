//! `asobench study-from`: turns a record and its estimate into an experiment file, a study of the user's own case.

use crate::cli::error::Error;
use crate::cli::estimate::{self, hints, orders};
use crate::cli::output::{note, print};
use crate::text::{rounded, shell_word, visible, wrap};
use case::Case;
use places::Places;

mod arguments;
mod case;
mod file;
mod methods;
mod places;

pub(in crate::cli) use arguments::Arguments;

pub(in crate::cli) fn run(mut arguments: Arguments) -> Result<(), Error> {
    let places = Places::new(&arguments.out)?;
    let (record, options) = (arguments.record.clone(), arguments.options.clone());
    let mut estimator = estimate::Arguments::of_one(record, arguments.estimator, options);
    orders::understand(&mut estimator)?;
    arguments.record.clone_from(&estimator.record);
    arguments.options.clone_from(&estimator.options);
    estimator.options.begin_as_in_studies(arguments.estimator);
    let arguments = &arguments;
    let case = Case::new(arguments, &estimator)?;
    let methods = methods::all(&case, arguments);
    let text = file::text(&case, arguments, &methods, &places);
    places.write(&case, text.as_bytes())?;
    conclude(&case, arguments, &methods, &places)
}

/// Prints what was written, and the next command.
fn conclude(case: &Case, arguments: &Arguments, methods: &methods::Methods, places: &Places) -> Result<(), Error> {
    let name = arguments.estimator;
    let orders = case.model.orders();
    let mut text = String::new();
    let mut line = |line: String| text += &wrap(&line, 79, "  ");
    line(format!(
        "The plant is {name} {orders}; its noise has the variance {}.",
        rounded(case.model.noise_variance, 4)
    ));
    line(file::input_in_words(case));
    line(file::noise_in_words(case).to_owned());
    line(file::loop_in_words(case, arguments.open_loop));
    line(format!("Methods: {}.", methods.labels().join(", ")));
    let written = places.columns(case).into_iter().map(|(path, _)| path);
    let written: Vec<String> = written
        .chain([places.file.as_path()])
        .map(|path| visible(path.display()))
        .collect();
    line(format!("Written: {}.", written.join(", ")));
    line(format!("Next: asobench run {}", shell_word(places.file.display())));
    print(&text)?;
    hints::tell(&case.hints);
    for doubt in file::doubts(case) {
        note(&format!("warning: {doubt}"));
    }
    Ok(())
}
