//! What the suite's page is about.

use asobench_study::suite::{MethodResults, Suite};

/// What a page of the suite is made of.
pub struct SuitePage<'a> {
    /// The suite.
    pub suite: &'a Suite,
    /// The results of all methods, each with every scenario of the suite.
    pub methods: &'a [MethodResults],
    /// The method that is measured against the others, if there is one.
    pub newcomer: Option<&'a str>,
    /// Whether the reports of the studies are beside the page.
    pub has_studies: bool,
    /// The command that prints the page's numbers.
    pub command: &'a str,
}
