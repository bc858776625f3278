//! The files beside a page.

use super::extremes::LongTable;
use super::figure::Drawn;
use super::paper;
use crate::folder::Files;
use crate::html::Section;
use crate::results::Study;

/// The files of a study beside a page, and the links of a part of the page to them.
pub(super) struct Beside<'a> {
    study: &'a Study,
    pub(super) files: &'a mut Files,
    pub(super) links: Vec<(String, String)>,
}

impl<'a> Beside<'a> {
    pub(super) fn new(study: &'a Study, files: &'a mut Files) -> Self {
        let links = Vec::new();
        Self { study, files, links }
    }

    /// Adds the files of a table, those for a paper too if it is for one.
    pub(super) fn table(&mut self, table: &mut LongTable, name: &str, title: &str, is_for_paper: bool) {
        let stem = format!("{}-{name}", self.study.name);
        let all = table.files(&stem, title, is_for_paper);
        self.links.extend(paper::links(&all, &self.study.name));
        self.files.extend(all);
    }

    /// Adds a figure to a section and to the files, by its name there and in the link.
    pub(super) fn figure(&mut self, section: &mut Section, drawn: &Drawn, (name, label): (&str, &str)) {
        section.figure(&drawn.picture, &drawn.caption);
        let path = format!("figures/{}-{name}.svg", self.study.name);
        self.links.push((format!("{label}.svg"), path.clone()));
        self.files.push((path, drawn.picture.wide.svg()));
    }
}
