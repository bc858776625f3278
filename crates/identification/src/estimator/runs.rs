//! Several records of one plant in one window.

use std::borrow::Cow;
use std::ops::Range;

/// The records that follow each other in a window: parts of a record on either side of a gap, or records of several
/// experiments. Equations and filters begin anew in each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Runs(Vec<Range<usize>>);

impl Runs {
    /// Makes the runs of these lengths.
    pub fn new(lengths: &[usize]) -> Self {
        let mut end = 0;
        let run = |length: &usize| {
            let start = end;
            end += length;
            start..end
        };
        Self(lengths.iter().map(run).collect())
    }

    /// Returns the index ranges of the records.
    pub fn iter(&self) -> std::slice::Iter<'_, Range<usize>> {
        self.0.iter()
    }

    /// Returns the number of samples of all.
    pub fn samples(&self) -> usize {
        self.0.last().map_or(0, |run| run.end)
    }

    /// Returns the number of records.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Returns a signal of all records without the first `from` samples of each.
    pub(super) fn without_first<'a>(&self, from: usize, signal: &'a [f64]) -> Cow<'a, [f64]> {
        let rest = |run: &Range<usize>| &signal[(run.start + from).min(run.end)..run.end];
        match self.0.as_slice() {
            [one] => Cow::Borrowed(rest(one)),
            runs => runs.iter().flat_map(rest).copied().collect(),
        }
    }

    /// Returns the index range of the first record of more than n samples, whose initial state can be estimated.
    pub fn first(&self, n: usize) -> Range<usize> {
        let first = self.0.iter().find(|run| run.len() > n);
        first.or(self.0.first()).cloned().unwrap_or_default()
    }
}

impl<'a> IntoIterator for &'a Runs {
    type Item = &'a Range<usize>;
    type IntoIter = std::slice::Iter<'a, Range<usize>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests;
