//! Tables by their columns: a heading, and beside it what stands below it for each item.

use super::extremes::LongTable;
use crate::html::{CellText, Column, Table};
use crate::results::Study;
use asobench_study::study::CellSummary;
use asobench_study::study::file::Key;

/// The text of a column for an item.
type Cell<'a, T> = Box<dyn Fn(&T) -> CellText + 'a>;

/// The columns of a table with a row for each item.
pub(crate) struct Columns<'a, I: Iterator> {
    items: I,
    headings: Vec<Column>,
    cells: Vec<Cell<'a, I::Item>>,
}

impl<'a, I: Iterator> Columns<'a, I> {
    /// A table without columns.
    pub(crate) fn new(items: I) -> Self {
        Self {
            items,
            headings: Vec::new(),
            cells: Vec::new(),
        }
    }

    /// Adds a column for each setting.
    pub(crate) fn keys(
        mut self,
        study: &Study,
        keys: &[Key],
        cell: impl Fn(&I::Item, Key) -> CellText + Copy + 'a,
    ) -> Self {
        for key in keys.iter().copied() {
            let column = if study.is_numeric(key) {
                Column::number(key.title(), key.entry().unit)
            } else {
                Column::text(key.title())
            };
            self = self.with(column, move |item| cell(item, key));
        }
        self
    }

    /// Adds a column for each setting of an item's cell that varies.
    pub(crate) fn settings<'s>(self, study: &Study, cell: impl Fn(&I::Item) -> &'s CellSummary + Copy + 'a) -> Self {
        self.keys(study, &study.varying(), move |item, key| {
            let value = cell(item).setting(key);
            match value.parse() {
                Ok(number) if cell(item).is_number(key) => CellText::number(value, number),
                _ => CellText::text(value),
            }
        })
    }

    /// Adds a column of texts.
    pub(crate) fn text<S: Into<CellText>>(self, title: &str, of: impl Fn(&I::Item) -> S + 'a) -> Self {
        self.with(Column::text(title), of)
    }

    /// Adds a column of numbers.
    pub(crate) fn number(self, title: impl Into<String>, unit: &str, of: impl Fn(&I::Item) -> CellText + 'a) -> Self {
        self.with(Column::number(title, unit), of)
    }

    /// Adds a column.
    pub(crate) fn with<S: Into<CellText>>(mut self, column: Column, of: impl Fn(&I::Item) -> S + 'a) -> Self {
        self.headings.push(column);
        self.cells.push(Box::new(move |item| of(item).into()));
        self
    }

    /// Makes the table; `by` is the title of the column that decides which rows are extreme.
    pub(crate) fn table(self, caption: &str, by: &str) -> LongTable {
        let mut table = LongTable::new(caption, self.headings, by);
        for item in self.items {
            table.row(self.cells.iter().map(|cell| cell(&item)).collect());
        }
        table
    }

    /// Makes a table that is short enough to be shown whole.
    pub(crate) fn whole(self, caption: impl Into<String>) -> Table {
        let mut table = Table::new(caption, self.headings);
        for item in self.items {
            table.row(self.cells.iter().map(|cell| cell(&item)));
        }
        table
    }
}
