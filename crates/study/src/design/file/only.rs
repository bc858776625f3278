//! A part of a file: some of its methods, and what can be said of them alone.

use crate::design::file::{Axis, ClaimTable, ExperimentFile, FileError, MethodTable, StudyKind, wrong};
use crate::text::{folded, listed};
use asobench_identification::estimator::EstimatorName;
use asobench_identification::names::UnknownName;
use std::collections::BTreeSet;

impl ExperimentFile {
    /// Keeps the methods (in continuous time the observers) with one of these names: the name of the method, or its
    /// estimator's, with all its outputs; or the label of an output, without the others. Claims and comparisons that
    /// need another method are left out; the second part names them.
    ///
    /// # Errors
    /// A name that no method has; a method whose options contradict each other.
    pub fn only(mut self, names: &[String]) -> Result<(Self, Vec<String>), FileError> {
        let methods = self.expanded()?;
        let methods = match self.kind() {
            StudyKind::Discrete => methods,
            StudyKind::Continuous => Vec::new(),
        };
        let of_method: Vec<Vec<String>> = methods.iter().map(MethodTable::names).collect();
        let of_observer: Vec<Vec<String>> = self
            .observers
            .iter()
            .map(|table| vec![table.label(), table.observer.name().to_owned()])
            .collect();
        let all = texts(of_method.iter().chain(&of_observer));
        let is_known = |name: &str| all.iter().any(|known| folded(known) == folded(name));
        // Names may have commas too.
        let parts = |name: &String| -> Vec<String> {
            if is_known(name) {
                return vec![name.clone()];
            }
            name.split(',').map(|part| part.trim().to_owned()).collect()
        };
        let names: Vec<String> = names.iter().flat_map(parts).collect();
        if let Some(name) = names.iter().find(|name| !is_known(name)) {
            return wrong(name, unknown(name, &all));
        }
        let wanted = |of: &[String]| {
            names
                .iter()
                .any(|name| of.iter().any(|own| folded(own) == folded(name)))
        };
        self.methods = methods.iter().filter_map(|method| method.part(&wanted)).collect();
        let of_kept: Vec<Vec<String>> = self.methods.iter().map(MethodTable::names).collect();
        let kept = of_observer.iter().filter(|of| wanted(of));
        let kept = texts(of_kept.iter().chain(kept));
        let is_gone = |name: &str| all.contains(name) && !kept.contains(name);
        let mut left_out = Vec::new();
        self.compare.retain(|[first, second]| {
            let stays = !is_gone(first) && !is_gone(second);
            if !stays {
                left_out.push(format!("the comparison of {first} with {second}"));
            }
            stays
        });
        let mut of_others = Vec::new();
        self.claims.retain(|claim| {
            let named: Vec<String> = names_of(claim).collect();
            let gone = named.iter().filter(|name| is_gone(name));
            let gone: Vec<&str> = gone.map(String::as_str).collect();
            if gone.is_empty() {
                return true;
            }
            if named.iter().any(|name| kept.contains(name.as_str())) {
                let others = listed(&gone, NAMES);
                left_out.push(format!("claim {}, which compares with {others}", claim.id));
            } else {
                of_others.push(claim.id.clone());
            }
            false
        });
        match of_others.as_slice() {
            [] => {}
            [one] => left_out.push(format!("claim {one} of another method")),
            several => left_out.push(format!("claims {} of other methods", listed(several, NAMES))),
        }
        let mut of_table = of_observer.iter();
        self.observers.retain(|_| of_table.next().is_some_and(|of| wanted(of)));
        Ok((self, left_out))
    }
}

/// All names of some lists.
fn texts<'a>(lists: impl Iterator<Item = &'a Vec<String>>) -> BTreeSet<&'a str> {
    lists.flatten().map(String::as_str).collect()
}

/// The message about a name that no method has.
fn unknown(name: &str, all: &BTreeSet<&str>) -> String {
    let all: Vec<&str> = all.iter().copied().collect();
    match name.parse::<EstimatorName>() {
        Ok(estimator) => format!(
            "an estimator, but no method of this file has it; expected {}, or [[methods]] with estimator = \
             \"{estimator}\" in the file",
            all.join(", ")
        ),
        Err(_) => UnknownName::new("method", name, &all).to_string(),
    }
}

impl MethodTable {
    /// Returns what of a table from [`Self::expand`] has a wanted name: the whole, or the outputs that have it.
    fn part(&self, wanted: &impl Fn(&[String]) -> bool) -> Option<Self> {
        if wanted(&self.own_names()) {
            return Some(self.clone());
        }
        self.with_outputs(|label| wanted(&[label]))
    }

    /// Returns the names of a table from [`Self::expand`]: its own, its estimator's, and the labels of its outputs.
    fn names(&self) -> Vec<String> {
        let mut names = self.own_names();
        if self.program().is_none() {
            names.extend(self.labels());
        }
        names
    }

    /// Returns its own name and its estimator's.
    fn own_names(&self) -> Vec<String> {
        let mut names = vec![self.base_name()];
        if self.program().is_none() {
            names.push(self.estimator().name().to_owned());
        }
        names
    }
}

/// Names that a list spells out.
const NAMES: usize = 3;

/// The outputs and methods that the tests of a claim name, and other texts.
fn names_of(claim: &ClaimTable) -> impl Iterator<Item = String> {
    let tests = claim.test.iter().chain(&claim.given);
    let named = tests.flat_map(|test| test.output.iter().chain(&test.to));
    named
        .flat_map(|axis: &Axis| axis.values(false))
        .map(|name| name.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "compare = [[\"iv(4)\", \"ls\"]]\n\
        [[methods]]\nestimator = \"ls\"\n[[methods]]\nestimator = \"iv\"\nreport = [1, 4]\nname = \"iv\"\n\
        [[claims]]\nid = \"A\"\ntest = { value = \"e_a\", of = \"ls\", below = 1 }\n\
        [[claims]]\nid = \"B\"\ntest = { ratio = \"e_a\", of = \"iv(4)\", to = \"ls\", below = 1 }\n";

    fn only(names: &[&str]) -> Result<(ExperimentFile, Vec<String>), FileError> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        ExperimentFile::parse(TWO).unwrap().only(&names)
    }

    #[test]
    fn what_needs_other_methods_is_left_out_and_named() {
        let (file, left_out) = only(&["LS"]).unwrap();
        assert_eq!((file.methods.len(), file.claims.len(), file.compare.len()), (1, 1, 0));
        let compared = ["the comparison of iv(4) with ls", "claim B, which compares with iv(4)"];
        assert_eq!(left_out, compared);
        assert!(crate::design::experiment::Experiment::new(file).is_ok());
        let (file, left_out) = only(&["iv(4)"]).unwrap();
        assert_eq!(file.methods[0].labels(), ["iv(4)"]);
        assert_eq!(
            left_out,
            [
                "the comparison of iv(4) with ls",
                "claim B, which compares with ls",
                "claim A of another method"
            ]
        );
        let (file, left_out) = only(&["ls", "iv"]).unwrap();
        assert_eq!((file.methods.len(), file.claims.len(), left_out.len()), (2, 2, 0));
    }

    #[test]
    fn a_name_that_no_method_has_is_refused() {
        let error = only(&["oe"]).unwrap_err().to_string();
        assert!(
            error.contains("an estimator, but no method of this file has it") && error.contains("ls"),
            "{error}"
        );
        let error = only(&["lss"]).unwrap_err().to_string();
        assert!(error.contains("unknown method 'lss', did you mean 'ls'?"), "{error}");
    }
}
