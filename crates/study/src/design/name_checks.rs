//! Checks the names in a file: every name is visible and distinguishable from the others.

use crate::design::file::{ExperimentFile, FileError, Key, Scalar, wrong};
use crate::design::{CHANGES, CONTINUOUS_PLANTS, FEEDBACKS, NOISES, PLANTS, SIGNALS};
use crate::text::{alike, folded, name_fault};
use asobench_identification::signal::InputLaw;

/// Checks every name of a resolved file, except those of outputs.
///
/// # Errors
/// The first faulty name.
pub(crate) fn check_names(file: &ExperimentFile) -> Result<(), FileError> {
    tables("plants", file.plants.keys(), &PLANTS)?;
    let laws: Vec<&str> = InputLaw::ALL.iter().map(|law| law.name()).collect();
    tables("inputs", file.inputs.keys(), &laws)?;
    tables("noises", file.noises.keys(), &NOISES)?;
    tables("changes", file.changes.keys(), &CHANGES)?;
    tables("covariances", file.covariances.keys(), &[])?;
    tables("feedbacks", file.feedbacks.keys(), &FEEDBACKS)?;
    let plants = file.continuous_plants.keys();
    tables("continuous_plants", plants, &CONTINUOUS_PLANTS)?;
    tables("signals", file.signals.keys(), &SIGNALS)?;
    let claims = file.settings.get(&Key::Claim).map(|axis| axis.values(false));
    for claim in claims.into_iter().flatten() {
        match claim {
            Scalar::Text(text) if !text.is_empty() => own_name(&text, Key::Claim.name())?,
            _ => {}
        }
    }
    for (i, bound) in file.bounds.iter().enumerate() {
        if let Some(label) = &bound.label {
            own_name(label, &format!("bounds[{i}].label"))?;
        }
    }
    for (i, table) in file.observers.iter().enumerate() {
        method(&table.label(), &format!("observers[{i}].name"))?;
    }
    for (i, table) in file.methods.iter().enumerate() {
        let (name, place) = (table.output_name(1), format!("methods[{i}].name"));
        method(&name, &place)?;
        let estimator = folded(&name);
        let other = table.program().is_some() || estimator != table.estimator().name();
        if other && ["iv", "ls"].contains(&estimator.as_str()) {
            let message = format!("'{name}' is the name of another estimator; expected a different one");
            return wrong(&place, message);
        }
    }
    Ok(())
}

/// Checks that all labels of outputs can be told apart. `place` is where they are in the file.
pub(crate) fn check_labels(place: &str, labels: &[String]) -> Result<(), FileError> {
    match alike(labels.iter().map(String::as_str)) {
        None => Ok(()),
        Some([name, other]) if name == other => {
            let message = format!("two outputs are called '{name}'; expected different names");
            wrong(place, message)
        }
        Some(pair) => wrong(place, not_apart(pair)),
    }
}

fn not_apart([name, other]: [&str; 2]) -> String {
    format!(
        "'{name}' and '{other}' differ only in case, blanks or invisible characters; expected \
        other names"
    )
}

fn own_name(name: &str, place: &str) -> Result<(), FileError> {
    name_fault(name).map_or(Ok(()), |fault| wrong(place, fault))
}

/// Checks the name of a method or an observer. A label adds the pass to it in parentheses.
fn method(name: &str, place: &str) -> Result<(), FileError> {
    own_name(name, place)?;
    if name.contains(['(', ')']) {
        let message = format!("'{name}'; expected a name without parentheses");
        return wrong(place, message);
    }
    Ok(())
}

/// Checks the names of tables. None may be that of a built-in one, which it would hide.
fn tables<'a>(
    table: &str,
    names: impl Iterator<Item = &'a String> + Clone,
    built_in: &[&str],
) -> Result<(), FileError> {
    for name in names.clone() {
        own_name(name, table)?;
        if built_in.contains(&folded(name).as_str()) {
            let message = "the name is built in; expected another";
            return wrong(format_args!("{table}.{name}"), message);
        }
    }
    alike(names.map(String::as_str)).map_or(Ok(()), |pair| wrong(table, not_apart(pair)))
}
