//! Checks that the claims of a file can be judged by its results.

use crate::design::file::{
    Axis, ClaimTable, ClaimTest, ExperimentFile, FileError, Key, Settings, StudyKind, TestKind, TestUnit,
    TheoryReference, TrialRule, cells, conditions, matches, wrong,
};
use crate::design::{Experiment, smooth};
use crate::text::folded;
use asobench_identification::names::UnknownName;
use std::collections::{BTreeMap, BTreeSet};

/// Checks every claim of an experiment.
///
/// # Errors
/// The first fault.
pub(crate) fn check(experiment: &Experiment) -> Result<(), FileError> {
    check_looks(&experiment.file)?;
    let claims = &experiment.file.claims;
    for (i, claim) in claims.iter().enumerate() {
        let place = format!("claims[{i}]");
        let at = |key: &str, message: String| wrong(format_args!("{place}.{key}"), message);
        if claim.test.is_empty() {
            continue;
        }
        if let Err(expected) = check_id(&claim.id) {
            return at("id", format!("'{}'; {expected}", claim.id.escape_debug()));
        }
        if claims[..i].iter().any(|other| folded(&other.id) == folded(&claim.id)) {
            return at("id", format!("two claims are called '{}'", claim.id));
        }
        if !(claim.level > 0.0 && claim.level < 0.5) {
            return at(
                "level",
                format!("{}; expected a rate above 0 and below 0.5", claim.level),
            );
        }
        check_tests(experiment, claim, &place)?;
    }
    check_kind(&experiment.file)
}

/// Checks the keys that say what the verdicts of a file are worth.
fn check_kind(file: &ExperimentFile) -> Result<(), FileError> {
    if file.family && file.claims.iter().all(|claim| claim.test.is_empty()) {
        let message = "there is no claim with a test to correct over; expected [[claims]]";
        return wrong("family", message);
    }
    if file.confirms == Some(file.seed) {
        let message = format!(
            "{} is the seed itself; expected the seed of other trials, which this study confirms",
            file.seed
        );
        return wrong("confirms", message);
    }
    Ok(())
}

/// Checks that the planned number of looks means something.
fn check_looks(file: &ExperimentFile) -> Result<(), FileError> {
    let wrong = |message: &str| wrong("looks", message);
    match (file.looks, &file.trials) {
        (Some(0), _) => wrong("0; expected at least 1"),
        (Some(_), TrialRule::Until(_) | TrialRule::Decided(_)) => {
            wrong("means nothing with a rule 'until', which plans its looks itself; expected a number of trials")
        }
        _ => Ok(()),
    }
}

/// Checks that the claim that ends the trials is one that their results can decide.
pub(crate) fn check_target(file: &ExperimentFile, id: &str) -> Result<(), FileError> {
    let wrong = |message: String| wrong("trials.until", message);
    let Some(claim) = file.claims.iter().find(|claim| claim.id == id) else {
        let ids = file.claims.iter().map(|claim| claim.id.as_str());
        let measures = file.measures.iter().map(|measure| measure.name());
        return wrong(UnknownName::new("claim or measure", id, ids.chain(measures)).to_string());
    };
    if claim.test.is_empty() {
        return wrong(format!("the claim '{id}' has no test"));
    }
    if claim.exploratory && file.confirms.is_none() {
        return wrong(format!(
            "the claim '{id}' is exploratory, so no error rate ends its trials; expected another claim, or run \
             --confirm"
        ));
    }
    if claim.cases()?.iter().flatten().any(ClaimTest::is_timed) {
        return wrong(format!("the claim '{id}' is about times, which trials cannot decide"));
    }
    Ok(())
}

fn check_id(id: &str) -> Result<(), &'static str> {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    if id.is_empty() || !id.chars().all(fits) {
        Err("expected letters, digits, '.', '-' and '_'")
    } else if id.parse::<f64>().is_ok() {
        Err("expected a name, not a number")
    } else {
        Ok(())
    }
}

fn check_tests(experiment: &Experiment, claim: &ClaimTable, place: &str) -> Result<(), FileError> {
    let cases = claim.cases().map_err(|error| error.within(place))?;
    let given = claim.given.as_ref().map(|table| {
        let test = ClaimTest::from_table(table);
        test.map_err(|error| error.within(&format!("{place}.given")))
    });
    let given = given.transpose()?;
    for case in cases {
        let mut unit: Option<TestUnit> = None;
        for ((key, _), test) in claim.tests().zip(case.iter().chain(&given)) {
            let place = format!("{place}.{key}");
            check_names(experiment, test).map_err(|error| error.within(&place))?;
            if unit.as_ref().is_some_and(|unit| *unit != test.unit()) {
                let message = "is about other cells than the test before it; expected a claim for each";
                return wrong(&place, message);
            }
            unit = Some(test.unit());
        }
    }
    Ok(())
}

/// Checks that the outputs, methods, measures and coefficients of a test exist.
fn check_names(experiment: &Experiment, test: &ClaimTest) -> Result<(), FileError> {
    let kind = experiment.file.kind();
    let continuous = kind == StudyKind::Continuous;
    let measures = test.measures();
    if let Some(other) = measures.iter().find(|measure| !measure.is_of(kind)) {
        return wrong(
            "",
            format!("'{other}' means nothing in a study in {} time", kind.name()),
        );
    }
    let by_ratio = matches!(
        test.kind,
        TestKind::Ratio { .. } | TestKind::Cells { .. } | TestKind::Slope(_)
    );
    if let Some(measure) = measures.iter().find(|measure| by_ratio && measure.may_be_negative()) {
        let message = format!(
            "'{measure}' may be negative, so ratios of it mean nothing; expected share = \
            \"{measure}\" with 'to', or a value"
        );
        return wrong("", message);
    }
    match &test.kind {
        TestKind::Time { to } if continuous => {
            return wrong("to", format!("'{to}': no times are measured in continuous time"));
        }
        TestKind::Time { to } => {
            let methods = experiment.file.methods.iter();
            let names: Vec<String> = methods.map(|method| method.output_name(1)).collect();
            for (key, name) in [("of", &test.output), ("to", to)] {
                if !names.contains(name) {
                    return wrong(key, UnknownName::new("method", name, &names));
                }
            }
        }
        _ => {
            experiment.output("of", &test.output)?;
        }
    }
    match &test.kind {
        TestKind::Ratio { to, measure_of_to, .. } if TheoryReference::named(to).is_some() => {
            let known = smooth(*measure_of_to).filter(|_| !continuous);
            let unknown = || FileError::key("to", format!("theory does not know '{measure_of_to}'"));
            known.ok_or_else(unknown)?;
        }
        TestKind::Wins { to, .. } | TestKind::Ratio { to, .. } => {
            experiment.output("to", to)?;
        }
        TestKind::Coefficient { name, .. } => check_coefficient(experiment, name.as_deref())?,
        _ => {}
    }
    if test.kind.other() == Some(&test.output) && measures.first() == measures.last() {
        return wrong("to", format!("'{}' is compared with itself", test.output));
    }
    Ok(())
}

fn check_coefficient(experiment: &Experiment, name: Option<&str>) -> Result<(), FileError> {
    if experiment.file.kind() == StudyKind::Continuous {
        let message = "coefficients of a and h mean nothing in a study in continuous time";
        return wrong("value", message);
    }
    let least = experiment.cells.iter().map(super::cell::Cell::order).min().unwrap_or(0);
    match name {
        Some(name) if name[2..].parse().is_ok_and(|i: usize| i > least) => {
            let message = format!("'{name}'; expected a coefficient up to {least}, the order");
            wrong("value", message)
        }
        _ => Ok(()),
    }
}

/// Checks that the cells to which the claims apply are in the grid: see [`ExperimentFile::check_filters`].
pub(crate) fn check_cells(file: &ExperimentFile, all: &[Settings]) -> Result<(), FileError> {
    for (i, claim) in file.claims.iter().enumerate() {
        let place = format!("claims[{i}]");
        check_where(&claim.cells, all).map_err(|error| error.within(&place))?;
        // `check` reports faults of a table itself.
        let cases = claim.cases().unwrap_or_default();
        let given = claim.given.as_ref().and_then(|table| ClaimTest::from_table(table).ok());
        for case in cases {
            for ((key, _), test) in claim.tests().zip(case.iter().chain(&given)) {
                let checked = check_unit(file, claim, test);
                checked.map_err(|error| error.within(&format!("{place}.{key}")))?;
            }
        }
    }
    Ok(())
}

fn check_where(table: &BTreeMap<Key, Axis>, all: &[Settings]) -> Result<(), FileError> {
    let conditions = conditions(table);
    for (key, wanted) in &conditions {
        let values = all.iter().filter_map(|cell| cell.get(key));
        let names: BTreeSet<String> = values.map(ToString::to_string).collect();
        let mut wanted = wanted.iter().map(ToString::to_string);
        if let Some(other) = wanted.find(|name| !names.contains(name)) {
            let unknown = UnknownName::new("value", other, names);
            return wrong(format_args!("where.{key}"), unknown);
        }
    }
    if all.iter().any(|cell| matches(cell, &conditions)) {
        return Ok(());
    }
    let message = "no cell has these values; expected values from [settings]";
    wrong("where", message)
}

/// Checks that the settings named by a test vary in the file.
fn check_unit(file: &ExperimentFile, claim: &ClaimTable, test: &ClaimTest) -> Result<(), FileError> {
    let twice = |key: Key| format!("'{key}' is also in the claim's 'where'");
    match (&test.kind, test.unit()) {
        (_, TestUnit::Cell) => Ok(()),
        (_, TestUnit::Family(over, _)) if claim.cells.contains_key(&over) => {
            wrong("over", format!("{}; expected 'from' alone", twice(over)))
        }
        (TestKind::Slope(slope), _) => slope.check(&file.settings).or_else(|message| wrong("over", message)),
        (_, TestUnit::Family(..)) => Ok(()),
        (_, TestUnit::Pair(axis, ..)) if claim.cells.contains_key(&axis) => {
            wrong("axis", format!("{}; expected 'from' and 'to' alone", twice(axis)))
        }
        (_, TestUnit::Pair(axis, from, to)) => {
            let Some(Axis::Many(values)) = file.settings.get(&axis) else {
                return wrong("axis", format!("'{axis}' has no list in [settings]"));
            };
            let to = to.iter().flatten().map(|value| ("to", value));
            for (key, value) in std::iter::once(("from", &from)).chain(to) {
                if !values.contains(value) {
                    return wrong(key, UnknownName::new("value", value, values));
                }
            }
            if test.unit().steps(&file.settings).is_empty() {
                return wrong("to", "no other value than 'from'");
            }
            Ok(())
        }
    }
}

impl ExperimentFile {
    /// Checks that every entry of `exclude`, every claim and every bound's claim applies to at least one cell. Checks
    /// the file as written: `--quick` and `--set` may leave them without a cell.
    ///
    /// # Errors
    /// The first that applies to no cell. If the grid itself is wrong, nothing is checked.
    pub fn check_filters(&self) -> Result<(), FileError> {
        let Ok(resolved) = self.clone().resolve() else {
            return Ok(());
        };
        let Ok(all) = cells(&resolved.settings, &resolved.zip, &[]) else {
            return Ok(());
        };
        for (i, table) in self.exclude.iter().enumerate() {
            let conditions = conditions(table);
            if !all.iter().any(|cell| matches(cell, &conditions)) {
                let message = "no cell has these values; expected values from [settings]";
                return wrong(format_args!("exclude[{i}]"), message);
            }
        }
        crate::design::claim_checks::check_cells(&resolved, &all)?;
        for (i, bound) in self.bounds.iter().enumerate() {
            let Some(claim) = &bound.claim else { continue };
            let of = |cell: &Settings| cell.get(&Key::Claim).map(ToString::to_string);
            if !all.iter().any(|cell| of(cell).as_ref() == Some(claim)) {
                let message = format!("no cell has the claim '{claim}'; expected one of the setting 'claim'");
                return wrong(format_args!("bounds[{i}].claim"), message);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
