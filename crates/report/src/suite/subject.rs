//! The subject of the suite's page.

use asobench_study::suite::{Contribution, Laws, MethodResults, RecordedFits, Suite, Times};

/// The contents of a page of the suite.
#[derive(Clone, Copy)]
pub struct SuitePage<'a> {
    /// A division of the suite.
    pub suite: &'a Suite,
    /// The results of all methods, each with every scenario of the suite.
    pub methods: &'a [MethodResults],
    /// The method that is measured against the others, if there is one.
    pub newcomer: Option<&'a str>,
    /// The methods that others have computed, with where they are from.
    pub contributed: &'a [Contribution],
    /// Whether the reports of the studies are beside the page.
    pub has_studies: bool,
    /// The command that prints the page's numbers.
    pub command: &'a str,
    /// The times of the methods, if they were measured.
    pub times: Option<&'a Times>,
    /// The law of d in each scenario, if it was shown.
    pub laws: Option<&'a Laws>,
    /// The open division, if the page shows it too.
    pub open: Option<&'a SuitePage<'a>>,
    /// The FIT of recorded data, if the page shows it.
    pub recorded: Option<&'a RecordedFits>,
}

impl<'a> SuitePage<'a> {
    /// A page of results alone, whose numbers a command prints.
    pub fn new(suite: &'a Suite, methods: &'a [MethodResults], command: &'a str) -> Self {
        Self {
            suite,
            methods,
            newcomer: None,
            contributed: &[],
            has_studies: false,
            command,
            times: None,
            laws: None,
            open: None,
            recorded: None,
        }
    }
}
