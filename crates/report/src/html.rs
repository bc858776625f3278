//! A report as one HTML page that needs no network: light and dark, printable, for screens from 400 px.
//!
//! All text is escaped; words between backticks become code.

mod table;
mod verdict;

pub use crate::table::{CellText, Column, Table, markdown_text};
pub use verdict::Verdict;
use verdict::{badge, mark};

use super::markup::{address, escape};
use super::plot::{self, Picture};
use asobench_study::files::PAGE_MAKER;

const CSS: &str = include_str!("html/page.css");
const JS: &str = include_str!("html/page.js");
/// The base64 of the SHA-256 of what stands between the tags of the page's one script: a browser runs no other.
const JS_HASH: &str = "ah6Ar5lfnulANw02omloEd9g6Ibt3q99k/gvEc4AL30=";

/// A page of sections with a table of contents.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    introduction: Section,
    sections: Vec<Section>,
}

impl Page {
    /// A page without sections.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            introduction: Section::default(),
            sections: Vec::new(),
        }
    }

    /// Adds content above the table of contents.
    pub fn introduction(&mut self, write: impl FnOnce(&mut Section)) {
        write(&mut self.introduction);
    }

    /// Adds a section. Its id, the target of links, keeps only letters, digits and `-_.` of the given id, and gets a
    /// number if it is taken.
    pub fn section(&mut self, id: &str, heading: &str, write: impl FnOnce(&mut Section)) {
        let before = self.sections.last().unwrap_or(&self.introduction);
        let mut section = Section {
            id: self.free_id(id),
            heading: heading.to_owned(),
            tables: before.tables,
            figures: before.figures,
            ..Section::default()
        };
        write(&mut section);
        self.sections.push(section);
    }

    fn free_id(&self, id: &str) -> String {
        let kept = |c: char| c.is_alphanumeric() || "-_.".contains(c);
        let id: String = id.chars().map(|c| if kept(c) { c } else { '-' }).collect();
        let taken =
            |id: &str| id.is_empty() || id == "contents" || self.sections.iter().any(|section| section.id == id);
        if !taken(&id) {
            return id;
        }
        let numbered = (2..).map(|i| format!("{id}-{i}"));
        numbered.into_iter().find(|id| !taken(id)).unwrap_or(id)
    }

    /// The page as an HTML document.
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let introduction = &self.introduction.body;
        let contents: String = self.sections.iter().map(Section::entry).collect();
        let sections: String = self
            .sections
            .iter()
            .enumerate()
            .map(|(i, section)| section.html(i == 0))
            .collect();
        let figures = plot::STYLE;
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{PAGE_MAKER}\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src \
             'unsafe-inline'; script-src 'sha256-{JS_HASH}'; img-src data:\">\n\
             <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>\n{CSS}</style>\n{figures}\n</head>\n<body>\n\
             <a class=\"skip\" href=\"#contents\">Contents</a>\n<div class=\"page\">\n\
             <header>\n<h1>{title}</h1>\n{introduction}</header>\n<div class=\"columns\">\n\
             <nav id=\"contents\" aria-label=\"Contents\">\n<h2>Contents</h2>\n<ol>\n\
             {contents}</ol>\n</nav>\n\
             <main>\n{sections}</main>\n</div>\n</div>\n<script>\n{JS}</script>\n</body>\n</html>\n"
        )
    }
}

/// A section of a page, or the content of a detail.
#[derive(Clone, Debug, Default)]
pub struct Section {
    id: String,
    heading: String,
    verdicts: Vec<Verdict>,
    body: String,
    tables: usize,
    figures: usize,
}

impl Section {
    fn add(&mut self, parts: &[&str]) {
        for part in parts {
            self.body.push_str(part);
        }
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.add(&["<p>", &inline(text), "</p>\n"]);
    }

    /// Adds the question that an experiment answers.
    pub fn question(&mut self, text: &str) {
        self.add(&["<p class=\"question\">", &inline(text), "</p>\n"]);
    }

    /// Adds the text of a claim.
    pub fn claim(&mut self, text: &str) {
        self.add(&["<p class=\"claim\">", &inline(text), "</p>\n"]);
    }

    /// Adds the answer in a sentence after its verdict. If all answers of a section have the same verdict, its sign
    /// also stands in the table of contents.
    pub fn answer(&mut self, verdict: Verdict, sentence: &str) {
        self.verdicts.push(verdict);
        let (badge, sentence) = (badge(verdict), inline(sentence));
        self.add(&["<p class=\"answer\">", &badge, " ", &sentence, "</p>\n"]);
    }

    /// Adds a part with its own link `#SECTION:ID`, under a heading with a verdict.
    pub fn part(&mut self, id: &str, verdict: Verdict, heading: &str, write: impl FnOnce(&mut Self)) {
        let body = self.inside(write);
        self.verdicts.push(verdict);
        let id = escape(&format!("{}:{id}", self.id));
        let (heading, badge) = (inline(heading), badge(verdict));
        self.add(&[&format!(
            "<article id=\"{id}\">\n<h3>{heading} {badge}</h3>\n{body}</article>\n"
        )]);
    }

    /// Adds a heading inside the section.
    pub fn heading(&mut self, text: &str) {
        self.add(&["<h3>", &inline(text), "</h3>\n"]);
    }

    /// Adds a heading below [`Self::heading`].
    pub fn subheading(&mut self, text: &str) {
        self.add(&["<h4>", &inline(text), "</h4>\n"]);
    }

    /// Adds a list of short texts; nothing if it is empty.
    pub fn list(&mut self, items: &[impl AsRef<str>]) {
        if items.is_empty() {
            return;
        }
        self.add(&["<ul>\n"]);
        for item in items {
            self.add(&["<li>", &inline(item.as_ref()), "</li>\n"]);
        }
        self.add(&["</ul>\n"]);
    }

    /// Adds names with values: settings, versions.
    pub fn settings(&mut self, pairs: &[(impl AsRef<str>, impl AsRef<str>)]) {
        self.add(&["<dl>\n"]);
        for (name, value) in pairs {
            let (name, value) = (inline(name.as_ref()), inline(value.as_ref()));
            self.add(&["<dt>", &name, "</dt><dd>", &value, "</dd>\n"]);
        }
        self.add(&["</dl>\n"]);
    }

    /// Adds links to files beside the page: label and relative path.
    pub fn files(&mut self, files: &[(impl AsRef<str>, impl AsRef<str>)]) {
        let links = files.iter().map(|(label, path)| {
            let (label, path) = (escape(label.as_ref()), address(path.as_ref()));
            format!("<a href=\"{path}\">{label}</a>")
        });
        let links = links.collect::<Vec<_>>().join(" \u{b7} ");
        self.add(&["<p>Files: ", &links, "</p>\n"]);
    }

    /// Adds a table and numbers it.
    pub fn table(&mut self, table: &Table) {
        self.tables += 1;
        self.add(&[&table.html(self.tables)]);
    }

    /// Adds a figure: unchanged SVG documents above its number and caption. A narrow screen shows the narrow one.
    pub fn figure(&mut self, picture: &Picture, caption: &str) {
        self.figures += 1;
        let (number, caption) = (self.figures, inline(caption));
        let wide = picture.wide.inline_svg();
        let (first, second) = match &picture.narrow {
            Some(narrow) => {
                let narrow = narrow.inline_svg();
                let second = format!("<div class=\"narrow\">\n{narrow}</div>\n");
                ("class=\"broad\"".to_owned(), second)
            }
            None => (scrolled(&format!("Figure {number}")), String::new()),
        };
        self.add(&[&format!(
            "<figure>\n<div {first}>\n{wide}</div>\n{second}\
             <figcaption><b>Figure {number}.</b> {caption}</figcaption>\n</figure>\n"
        )]);
    }

    /// Adds code or a command, unchanged.
    pub fn code(&mut self, code: &str) {
        let code = escape(code.trim_end());
        self.add(&["<pre tabindex=\"0\"><code>", &code, "</code></pre>\n"]);
    }

    /// Adds content that is visible after a click on the summary, and in print.
    pub fn details(&mut self, summary: &str, write: impl FnOnce(&mut Self)) {
        let body = self.inside(write);
        let summary = inline(summary);
        self.add(&[&format!("<details>\n<summary>{summary}</summary>\n{body}</details>\n")]);
    }

    /// Collects what is written into a part of the section, and updates the numbers of tables and figures.
    fn inside(&mut self, write: impl FnOnce(&mut Self)) -> String {
        let mut inner = Self {
            tables: self.tables,
            figures: self.figures,
            ..Self::default()
        };
        write(&mut inner);
        (self.tables, self.figures) = (inner.tables, inner.figures);
        self.verdicts.extend(inner.verdicts);
        inner.body
    }

    /// The line in the table of contents.
    fn entry(&self) -> String {
        let (id, heading) = (escape(&self.id), inline(&self.heading));
        let (first, rest) = (self.verdicts.first(), self.verdicts.get(1..));
        let same = first.filter(|first| rest.is_none_or(|rest| rest.iter().all(|v| v == *first)));
        let mark = same.copied().map_or_else(
            || "<span class=\"sign\" aria-hidden=\"true\">\u{b7}</span>".to_owned(),
            mark,
        );
        format!("<li><a href=\"#{id}\">{mark}<span>{heading}</span></a></li>\n")
    }

    fn html(&self, first: bool) -> String {
        let (id, heading, body) = (escape(&self.id), inline(&self.heading), &self.body);
        let class = if first { " class=\"first\"" } else { "" };
        format!("<section id=\"{id}\"{class}>\n<h2>{heading}</h2>\n{body}</section>\n")
    }
}

/// The attributes of a part that scrolls by itself.
fn scrolled(label: &str) -> String {
    format!("class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"")
}

/// Escapes a text and turns pairs of backticks into code.
fn inline(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let mut html = String::with_capacity(text.len());
    for (i, part) in parts.iter().enumerate() {
        let last = i + 1 == parts.len();
        match (i % 2 == 1, last) {
            (true, false) => {
                for piece in ["<code>", &escape(part), "</code>"] {
                    html.push_str(piece);
                }
            }
            // A backtick without a partner stays a backtick.
            (true, true) => {
                html.push('`');
                html.push_str(&escape(part));
            }
            _ => html.push_str(&escape(part)),
        }
    }
    html
}

#[cfg(test)]
mod tests;
