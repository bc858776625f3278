//! The extremes of a study that is too large for a page. The CSV table has the rest.

use super::paper;
use crate::folder::Files;
use crate::html::{CellText, Column, Section, Table};
use crate::plot::{Plot, Point, Style};

/// Largest number of rows that a page shows; a longer table is reduced to its extremes.
const MOST_ROWS: usize = 250;
/// Rows at each extreme.
const END: usize = 10;
/// Largest number of names along an axis.
const NAMES: usize = 60;
/// Largest number of points of a series that are drawn with separate bars.
const BARS: usize = 200;

/// A table of any length: complete as CSV, with only some rows on the page.
pub(crate) struct LongTable {
    table: Table,
    csv: String,
    count: usize,
    /// The column whose smallest and largest numbers are the extremes.
    by: usize,
}

impl LongTable {
    /// A table without rows; `by` is the title of the column that decides which rows are extreme.
    pub(super) fn new(caption: &str, columns: Vec<Column>, by: &str) -> Self {
        let by = columns.iter().position(|column| column.title == by);
        let table = Table::new(caption, columns);
        Self {
            csv: table.csv(),
            table,
            count: 0,
            by: by.unwrap_or(0),
        }
    }

    /// Adds a row.
    pub(super) fn row(&mut self, row: Vec<CellText>) {
        self.csv.push_str(&self.table.csv_row(&row));
        self.count += 1;
        self.table.row(row);
        if self.table.rows.len() > 2 * MOST_ROWS {
            self.leave_ends();
        }
    }

    fn leave_ends(&mut self) {
        let by = self.by;
        let value = |row: &Vec<CellText>| row.get(by).and_then(|cell| cell.sort_value);
        let rows = &mut self.table.rows;
        rows.retain(|row| value(row).is_some());
        rows.sort_by(|a, b| value(a).partial_cmp(&value(b)).unwrap_or(std::cmp::Ordering::Equal));
        if rows.len() > 2 * END {
            rows.drain(END..rows.len() - END);
        }
    }

    /// Number of rows.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The table, or `None` if it is empty.
    pub(super) fn unless_empty(self) -> Option<Self> {
        (self.count > 0).then_some(self)
    }

    /// The files of the table, `tables/NAME.csv` and those for a paper, if it is for one; the first can be taken once.
    pub(super) fn files(&mut self, name: &str, title: &str, is_for_paper: bool) -> Files {
        let mut files = vec![(format!("tables/{name}.csv"), self.take_csv())];
        if let Some(table) = self.for_paper().filter(|_| is_for_paper) {
            files.extend(paper::files(name, title, table));
        }
        files
    }

    /// Takes the complete table as CSV.
    pub(super) fn take_csv(&mut self) -> String {
        std::mem::take(&mut self.csv)
    }

    /// The table if it fits a page of a paper, and is not empty.
    fn for_paper(&self) -> Option<&Table> {
        let whole = self.count == self.table.rows.len() && self.count > 0;
        (whole && paper::fits(&self.table)).then_some(&self.table)
    }

    /// Adds the table to a section, after a note if it is not complete.
    pub(super) fn show(self, section: &mut Section, file: &str) {
        let (table, note) = self.shown(file);
        if let Some(note) = note {
            section.paragraph(&note);
        }
        section.table(&table);
    }

    /// The table for the page, with a note if it is not complete.
    pub(super) fn shown(mut self, file: &str) -> (Table, Option<String>) {
        if self.count <= MOST_ROWS {
            return (self.table, None);
        }
        self.leave_ends();
        let title = &self.table.columns[self.by].title;
        let note = format!(
            "Shown are the rows with the smallest and the largest \"{title}\", of {} rows in all; {file} has every \
             row.",
            self.count
        );
        (self.table, Some(note))
    }
}

/// Keeps of too many names only those with the smallest and the largest values of the last series, and returns a note.
/// The names are along x, or along y in a horizontal plot.
pub(super) fn extremes(plots: &mut [Plot]) -> Option<String> {
    let lies = plots.iter().any(|plot| plot.y.has_names());
    let upright = plots.iter().any(|plot| plot.x.has_names());
    if !lies && !upright {
        return None;
    }
    let parts = |point: &Point| {
        if lies { (point.y, point.x) } else { (point.x, point.y) }
    };
    let last = plots
        .iter()
        .filter_map(|plot| plot.series.iter().rfind(|series| !series.points.is_empty()));
    let mut places: Vec<(f64, usize)> = last
        .flat_map(|series| &series.points)
        .map(parts)
        .filter(|(_, value)| value.is_finite())
        .map(|(name, value)| (value, name as usize))
        .collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut names: Vec<usize> = places.iter().map(|(_, name)| *name).collect();
    names.sort_unstable();
    names.dedup();
    let count = names.len();
    if count <= NAMES {
        return None;
    }
    let mut kept: Vec<usize> = Vec::new();
    for (low, high) in places.iter().zip(places.iter().rev()) {
        for (_, name) in [low, high] {
            if kept.len() < NAMES && !kept.contains(name) {
                kept.push(*name);
            }
        }
        if kept.len() == NAMES {
            break;
        }
    }
    for series in plots.iter_mut().flat_map(|plot| &mut plot.series) {
        series.points.retain(|point| kept.contains(&(parts(point).0 as usize)));
    }
    Some(format!(
        " Of {count} places along the axis, only the {NAMES} with the smallest and the largest values \
         are drawn; the table has the rest."
    ))
}

/// Draws the intervals of many points as a band instead of bars.
pub(super) fn crowded(plots: &mut [Plot]) {
    let series = plots.iter_mut().flat_map(|plot| &mut plot.series);
    for series in series {
        if series.style == Style::ErrorBars && series.points.len() > BARS {
            series.style = Style::Band;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{PlotAxis, Series};

    #[test]
    fn a_long_table_is_whole_as_csv_and_shows_its_ends() {
        let columns = vec![Column::text("cell"), Column::number("median", "")];
        let mut table = LongTable::new("", columns, "median");
        let rows = 3 * MOST_ROWS;
        for i in 0..rows {
            let value = if i == 7 { f64::NAN } else { (i * 7919 % rows) as f64 };
            table.row(vec![CellText::text(i.to_string()), CellText::number("", value)]);
        }
        assert_eq!(table.take_csv().lines().count(), 1 + rows);
        let (table, note) = table.shown("results.csv");
        let values: Vec<f64> = table.rows.iter().filter_map(|row| row[1].sort_value).collect();
        let ends = (0..END).chain(rows - END..rows).map(|i| i as f64);
        let left_out = (7 * 7919 % rows) as f64;
        assert!(END as f64 <= left_out && left_out < (rows - END) as f64);
        assert_eq!(values, ends.collect::<Vec<f64>>());
        assert!(note.is_some_and(|note| note.contains("of 750 rows in all") && note.contains("results.csv")));
    }

    #[test]
    fn of_many_names_the_extremes_are_drawn() {
        let names: Vec<String> = (0..1000).map(|i| i.to_string()).collect();
        let points = (0..1000).map(|i| Point::new(f64::from(i), f64::from(i * 7919 % 1000)));
        let plot = Plot::new("", PlotAxis::categories("", &names), PlotAxis::linear(""));
        let plot = plot.series(Series::new("a", Style::ErrorBars, points.collect()));
        let mut plots = [plot];
        let note = extremes(&mut plots).unwrap();
        assert!(note.contains("Of 1000 places"), "{note}");
        let mut drawn: Vec<f64> = plots[0].series[0].points.iter().map(|point| point.y).collect();
        drawn.sort_by(f64::total_cmp);
        let half = NAMES / 2;
        let expected = (0..half).chain(1000 - half..1000).map(|i| i as f64);
        assert_eq!(drawn, expected.collect::<Vec<f64>>());
        assert_eq!(extremes(&mut plots), None);
    }

    #[test]
    fn many_bars_are_a_band() {
        let points: Vec<Point> = (0..=BARS).map(|i| Point::new(i as f64, 1.0)).collect();
        for (count, style) in [(BARS, Style::ErrorBars), (BARS + 1, Style::Band)] {
            let series = Series::new("a", Style::ErrorBars, points[..count].to_vec());
            let mut plots = [Plot::new("", PlotAxis::linear(""), PlotAxis::linear("")).series(series)];
            crowded(&mut plots);
            assert_eq!(plots[0].series[0].style, style);
        }
    }
}
