//! Names of lines at their ends, to the right of the last panel of each row, instead of in a legend.
//!
//! The rule: a line is named at its end if it reaches the last seventh of the x axis of such a panel, within the y
//! axis. At least two lines, and half of all, must; otherwise every name is in the legend, and so are those of other
//! marks. The legend has all names too where those at the ends need more than 27 % of the picture's width, or more than
//! two lines of text, or do not fit under each other, or would be farther from their lines than a quarter of the panel
//! (six tenths where there are six and more).

use super::axis::Span;
use super::backend::{Canvas, Drawn, TICK, at, plain};
use super::legend::Legend;
use super::metrics::{LINE, widest, wrap};
use super::scene::Part;
use super::{Course, Plot, Series, Style, distinct};
use plotters::style::text_anchor::HPos;

/// The share of the x axis that a line must reach.
const REACH: f64 = 1.0 - 1.0 / 7.0;
/// The largest share of the picture's width for names.
const WIDEST: f64 = 0.27;
/// The most lines of a name.
const LINES: usize = 2;
/// The farthest that a name is moved, as a share of the panel's height; farther where so many names would be a legend
/// in which no reader finds a line.
const FARTHEST: f64 = 0.25;
const MANY: usize = 6;
const FARTHEST_OF_MANY: f64 = 0.6;
/// From the axes to the names.
const LEAD: f64 = 22.0;

/// The names at the ends of lines, and the space that they need.
#[derive(Clone, Debug)]
pub(super) struct Ends<'a> {
    names: Vec<&'a str>,
    /// The space to the right of the axes.
    pub(super) room: f64,
    /// The widest name.
    limit: f64,
}

/// The end of a line in shares of both axes, from the left and from below.
type Place = [f64; 2];

impl<'a> Ends<'a> {
    /// The names that can stand at ends, in the panels at which rows end.
    pub(super) fn new(plots: &'a [Plot], last: &[(&'a Plot, &[Span; 2])], whole: f64) -> Option<Self> {
        let ended = |name: &&str| last.iter().any(|(plot, spans)| end(plot, spans, name).is_some());
        let all = lines(plots);
        let names: Vec<&str> = all.iter().copied().filter(ended).collect();
        let limit = WIDEST * whole - LEAD;
        let fits = |name: &&str| {
            let words = name.split_whitespace();
            widest(words, TICK) <= limit && wrap(name, TICK, limit).len() <= LINES
        };
        if names.len() < 2 || 2 * names.len() < all.len() || !names.iter().all(fits) {
            return None;
        }
        let text = |name: &&str| {
            let lines = wrap(name, TICK, limit);
            widest(lines.iter().map(String::as_str), TICK)
        };
        let room = LEAD + names.iter().map(text).fold(0.0, f64::max);
        Some(Self { names, room, limit })
    }

    /// Whether a name stands at an end.
    pub(super) fn has(&self, name: &str) -> bool {
        self.names.contains(&name)
    }

    /// Where the names beside a panel stand: their lines of text, the end of the line, and the middle of the name.
    fn places(&self, plot: &Plot, spans: &[Span; 2], area: [f64; 4]) -> Option<Vec<Named<'a>>> {
        let [left, top, right, bottom] = area;
        let ends = self
            .names
            .iter()
            .filter_map(|name| Some((*name, end(plot, spans, name)?)));
        let mut named: Vec<Named<'a>> = ends
            .map(|(name, [x, y])| {
                let from = (left + x * (right - left), bottom - y * (bottom - top));
                let text = wrap(name, TICK, self.limit);
                Named {
                    name,
                    text,
                    from,
                    middle: from.1,
                }
            })
            .collect();
        named.sort_by(|a, b| a.from.1.total_cmp(&b.from.1));
        let wanted: Vec<[f64; 2]> = named.iter().map(|of| [of.from.1, of.height()]).collect();
        let middles = spread(&wanted, [top, bottom])?;
        for (of, middle) in named.iter_mut().zip(middles) {
            of.middle = middle;
        }
        let share = if named.len() < MANY { FARTHEST } else { FARTHEST_OF_MANY };
        let far = share * (bottom - top);
        let near = named.iter().all(|of| (of.middle - of.from.1).abs() <= far);
        near.then_some(named)
    }

    /// Whether the names beside a panel of a given height fit.
    pub(super) fn fit(&self, plot: &Plot, spans: &[Span; 2], height: f64) -> bool {
        self.places(plot, spans, [0.0, 0.0, 1.0, height]).is_some()
    }

    /// Writes the names beside a panel, each with a line to the end that it names.
    pub(super) fn draw(
        &self,
        canvas: &Canvas,
        legend: &Legend<'_>,
        (plot, spans): (&Plot, &[Span; 2]),
        area: [f64; 4],
    ) -> Drawn {
        let right = area[2];
        for of in self.places(plot, spans, area).unwrap_or_default() {
            let (x, y) = of.from;
            // Not over the marker at the end.
            let start = if x < right - 2.0 { x + 7.0 } else { right + 2.0 };
            let course = [
                (start, y),
                (right + 2.0, y),
                (right + LEAD - 8.0, of.middle),
                (right + LEAD - 4.0, of.middle),
            ];
            let half = (of.height() - (LINE - 0.72) * TICK) / 2.0;
            let place = (right + LEAD, of.middle - half);
            canvas.part_of(Part::Name, legend.number(of.name), || {
                canvas.line(course.map(at), legend.lead(of.name))?;
                canvas.text(&of.text, &plain(TICK), HPos::Left, place).map(drop)
            })?;
        }
        Ok(())
    }
}

/// A name beside a panel.
struct Named<'a> {
    name: &'a str,
    text: Vec<String>,
    /// The end of its line.
    from: (f64, f64),
    /// The height of its middle.
    middle: f64,
}

impl Named<'_> {
    fn height(&self) -> f64 {
        LINE * TICK * self.text.len() as f64
    }
}

/// Whether a series is a line.
fn is_line(plot: &Plot, series: &Series) -> bool {
    match series.style {
        Style::Line | Style::Band | Style::Steps => true,
        Style::ErrorBars => !plot.x.has_names() && !plot.y.has_names(),
        _ => false,
    }
}

/// The names of all lines with points, each once.
fn lines(plots: &[Plot]) -> Vec<&str> {
    let all = plots.iter().flat_map(|plot| {
        let series = plot.series.iter();
        let series = series.filter(|series| is_line(plot, series) && !series.points.is_empty());
        let references = plot.references.iter();
        let references = references.filter(|of| !matches!(of.course, Course::Vertical(_)));
        series
            .map(|of| of.label.as_str())
            .chain(references.map(|of| of.label.as_str()))
    });
    distinct(all.filter(|name| !name.is_empty()))
}

/// The end of the line of a name in a panel, if it is seen far enough to the right.
fn end(plot: &Plot, [x, y]: &[Span; 2], name: &str) -> Option<Place> {
    let seen = |[across, up]: Place| {
        ((REACH..=1.0 + 1e-9).contains(&across) && (0.0..=1.0).contains(&up)).then_some([across, up])
    };
    let mut series = plot
        .series
        .iter()
        .filter(|series| series.label == name && is_line(plot, series));
    if let Some(series) = series.next() {
        let defined = |point: &&super::Point| x.coordinate(point.x).and(y.coordinate(point.y)).is_some();
        let last = series.points.iter().rfind(defined)?;
        return seen([x.share(last.x), y.share(last.y)]);
    }
    let reference = plot.references.iter().find(|of| of.label == name)?;
    let height = match reference.course {
        Course::Horizontal(at) => y.coordinate(at).map(|_| y.share(at)),
        Course::Vertical(_) => None,
        Course::Sloped { slope, through } => {
            x.coordinate(through.0)?;
            let above = y.coordinate(through.1)?;
            let run = x.length() * (1.0 - x.share(through.0));
            Some(y.share(y.value(above + slope * run)))
        }
    };
    seen([1.0, height?])
}

/// Middles of texts with given middles and heights, sorted by middle: as near to them as possible (least squares) where
/// none is on another and all are between top and bottom. With the heights before each taken off it is an isotonic
/// regression; `None` if they do not fit.
fn spread(wanted: &[[f64; 2]], [top, bottom]: [f64; 2]) -> Option<Vec<f64>> {
    let (Some(first), Some(last)) = (wanted.first(), wanted.last()) else {
        return Some(Vec::new());
    };
    let mut offsets = vec![0.0];
    for pair in wanted.windows(2) {
        let before = offsets.last().copied().unwrap_or(0.0);
        offsets.push(before + f64::midpoint(pair[0][1], pair[1][1]));
    }
    let whole = offsets.last().copied().unwrap_or(0.0);
    let (least, most) = (top + first[1] / 2.0, bottom - last[1] / 2.0 - whole);
    if most < least {
        return None;
    }
    // Neighbours that would be out of order move together: their mean and number.
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for ([middle, _], offset) in wanted.iter().zip(&offsets) {
        let mut block = (middle - offset, 1);
        while let Some((mean, count)) = blocks.pop_if(|(mean, _)| *mean > block.0) {
            let all = (count + block.1) as f64;
            block = ((mean * count as f64 + block.0 * block.1 as f64) / all, count + block.1);
        }
        blocks.push(block);
    }
    let places = blocks
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count));
    let bounded = places.map(|place| place.clamp(least, most));
    Some(bounded.zip(offsets).map(|(place, offset)| place + offset).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_near_as_they_can_be() {
        let all = |middles: &[f64]| middles.iter().map(|at| [*at, 10.0]).collect::<Vec<_>>();
        let near = |middles: &[f64], expected: &[f64]| {
            let found = spread(&all(middles), [0.0, 100.0]).unwrap();
            let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(close && found.len() == expected.len(), "{found:?}");
        };
        near(&[], &[]);
        near(&[20.0, 40.0, 95.0], &[20.0, 40.0, 95.0]);
        // Three at one place: about it.
        near(&[50.0, 50.0, 50.0], &[40.0, 50.0, 60.0]);
        // Two pairs that meet become one block: the mean of 40 - 0, 42 - 10, 55 - 20, 56 - 30 is 33.25.
        near(&[40.0, 42.0, 55.0, 56.0], &[33.25, 43.25, 53.25, 63.25]);
        near(&[1.0, 2.0, 99.0], &[5.0, 15.0, 95.0]);
        assert!(spread(&all(&[50.0; 11]), [0.0, 100.0]).is_none());
        near(
            &[50.0; 10],
            &[5.0, 15.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 85.0, 95.0],
        );
    }
}
