//! The legend above the plots, and the look of each series. (plotters' own legend is a box that covers data.)

use super::backend::{Canvas, Drawn, LABEL, at, plain};
use super::inks::{COLOURS, PAPER, reference_ink, series_ink};
use super::metrics::{widest, wrap};
use super::scene::Part;
use super::{Plot, Style, distinct};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

/// The look of a place in the palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look(pub(super) usize);

impl Look {
    /// Index of the dashes and markers: when the colours of the palette repeat, these change.
    fn turn(self) -> usize {
        self.0 + self.0 / COLOURS
    }

    /// The colour without dashes.
    pub(super) fn ink(self) -> RGBColor {
        series_ink(self.0, 0)
    }

    /// The style of lines.
    pub(super) fn line(self, width: u32) -> ShapeStyle {
        series_ink(self.0, self.turn()).stroke_width(width)
    }

    /// The style of steps: dashes only where colours repeat.
    pub(super) fn step(self, width: u32) -> ShapeStyle {
        series_ink(self.0, self.0 / COLOURS).stroke_width(width)
    }

    /// The marker at a place.
    pub(super) fn marker(self, canvas: &Canvas, at: (i32, i32)) -> Drawn {
        let ink = self.ink();
        let corners: &[(i32, i32)] = match self.turn() % 7 {
            0 => return canvas.draw(Circle::new(at, 46, ink.filled())),
            1 => &[(-40, -40), (40, -40), (40, 40), (-40, 40)],
            2 => &[(0, -54), (50, 38), (-50, 38)],
            3 => &[(0, -58), (58, 0), (0, 58), (-58, 0)],
            4 => &[(0, 54), (50, -38), (-50, -38)],
            5 => {
                canvas.draw(Circle::new(at, 46, PAPER.filled()))?;
                return canvas.draw(Circle::new(at, 46, ink.stroke_width(18)));
            }
            _ => return canvas.draw(Cross::new(at, 45, ink.stroke_width(20))),
        };
        let corners = corners.iter().map(|(x, y)| (at.0 + x, at.1 + y));
        canvas.draw(Polygon::new(corners.collect::<Vec<_>>(), ink))
    }

    /// A box.
    pub(super) fn draw_box(self, canvas: &Canvas, corners: [(i32, i32); 2]) -> Drawn {
        let style = self.ink().mix(0.22).filled().stroke_width(15);
        canvas.draw(Rectangle::new(corners, style))
    }

    /// Draws a sample of a series about a place.
    fn sample(self, style: Style, solid: bool, canvas: &Canvas, (x, y): (i32, i32)) -> Drawn {
        let line = if solid {
            self.ink().stroke_width(20)
        } else {
            self.line(20)
        };
        let around = |half: i32| [(x - half, y - 80), (x + half, y + 80)];
        match style {
            Style::Line => canvas.line([(x - 200, y), (x + 200, y)], line),
            Style::Steps => canvas.line([(x - 200, y), (x + 200, y)], self.step(26)),
            Style::Band | Style::Region => {
                let [(left, top), (right, bottom)] = around(200);
                let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
                canvas.draw(Polygon::new(corners, self.ink().mix(0.16)))?;
                match style {
                    Style::Region => Ok(()),
                    _ => canvas.line([(left, y), (right, y)], line),
                }
            }
            Style::Notes => Ok(()),
            Style::Spans => {
                let style = self.ink().stroke_width(30);
                canvas.line([(x - 200, y), (x + 200, y)], style)
            }
            Style::ErrorBars | Style::Marks => {
                canvas.line([(x, y - 90), (x, y + 90)], self.ink().stroke_width(12))?;
                self.marker(canvas, (x, y))
            }
            Style::Boxes => {
                self.draw_box(canvas, around(140))?;
                self.marker(canvas, (x, y))
            }
        }
    }
}

/// The labels of all panels in order of appearance, with the look of each series.
#[derive(Debug)]
pub(super) struct Legend<'a> {
    /// Label, style, look, and whether its lines are never dashed.
    series: Vec<(&'a str, Style, Look, bool)>,
    references: Vec<&'a str>,
}

/// Empty space at both sides of titles and legends.
pub(super) const EDGE: f64 = 12.0;

impl<'a> Legend<'a> {
    /// Builds the legend that several plots share: the same label looks the same in each.
    pub(super) fn new(plots: &'a [Plot]) -> Self {
        let all = || plots.iter().flat_map(|plot| &plot.series);
        let taken: Vec<usize> = all().filter_map(|series| series.slot).collect();
        let mut free = (0..).filter(|slot| !taken.contains(slot));
        let mut series: Vec<(&str, Style, Look, bool)> = Vec::new();
        for item in all() {
            if series.iter().all(|(label, ..)| *label != item.label) {
                let slot = item.slot.or_else(|| free.next()).unwrap_or(0);
                let here = |plot: &&Plot| plot.series.iter().any(|of| of.label == item.label);
                let solid = plots.iter().filter(here).all(Plot::has_one_line);
                series.push((&item.label, item.style, Look(slot), solid));
            }
        }
        let references = plots.iter().flat_map(|plot| &plot.references);
        let references = distinct(references.map(|reference| reference.label.as_str()));
        Self { series, references }
    }

    /// The number of a series.
    pub(super) fn number(&self, label: &str) -> Option<usize> {
        self.series.iter().position(|(other, ..)| *other == label)
    }

    /// The look of a series.
    pub(super) fn look(&self, label: &str) -> Look {
        self.number(label).map_or(Look(0), |number| self.series[number].2)
    }

    /// The style of a reference line.
    pub(super) fn reference(&self, label: &str) -> ShapeStyle {
        let known = self.references.iter().position(|other| *other == label);
        reference_ink(known.unwrap_or(0)).stroke_width(16)
    }

    /// The style of what leads from the end of a line to its name.
    pub(super) fn lead(&self, label: &str) -> ShapeStyle {
        if self.references.contains(&label) {
            return self.reference(label);
        }
        self.look(label).ink().stroke_width(10)
    }

    /// Draws the legend in rows below `top`, without the names that stand elsewhere; returns its lower end.
    pub(super) fn draw(&self, canvas: &Canvas, top: f64, elsewhere: impl Fn(&str) -> bool) -> Drawn<f64> {
        const SAMPLE: f64 = 40.0;
        const TEXT: f64 = SAMPLE + 8.0;
        let series = self.series.iter().enumerate();
        let series = series.map(|(number, (label, ..))| (*label, Some(number)));
        let references = self.references.iter().map(|label| (*label, None));
        let (mut x, mut y, mut end) = (EDGE, top, top);
        for (label, number) in series
            .chain(references)
            .filter(|(label, _)| !label.is_empty() && !elsewhere(label))
        {
            let lines = wrap(label, LABEL, canvas.width - 2.0 * EDGE - TEXT);
            let width = TEXT + widest(lines.iter().map(String::as_str), LABEL);
            if x > EDGE && x + width > canvas.width - EDGE {
                (x, y) = (EDGE, end);
            }
            let (left, height) = at((x, y + 11.0));
            let mut text = 0.0;
            canvas.part_of(Part::Name, number, || {
                match number {
                    Some(number) => {
                        let (_, style, look, solid) = self.series[number];
                        look.sample(style, solid, canvas, (left + 200, height))?;
                    }
                    None => canvas.line([(left, height), (left + 400, height)], self.reference(label))?,
                }
                text = canvas.text(&lines, &plain(LABEL), HPos::Left, (x + TEXT, y + 5.2))?;
                Ok(())
            })?;
            x += width + 22.0;
            end = f64::max(end, y + text + 2.8);
        }
        Ok(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{PlotAxis, Series};

    #[test]
    fn a_label_looks_the_same_in_every_panel_and_no_two_alike() {
        let plot = |labels: &[(&str, Option<usize>)]| {
            let mut plot = Plot::new("", PlotAxis::linear(""), PlotAxis::linear(""));
            plot.series = labels
                .iter()
                .map(|(label, slot)| Series {
                    slot: *slot,
                    ..Series::new(*label, Style::Line, Vec::new())
                })
                .collect();
            plot
        };
        let plots = [
            plot(&[("LS", None), ("ridge", None), ("IV", Some(1))]),
            plot(&[("IV", Some(1)), ("LS", None), ("SVD", None)]),
        ];
        let legend = Legend::new(&plots);
        let looks = ["LS", "IV", "ridge", "SVD"].map(|label| legend.look(label));
        assert_eq!(looks, [0, 1, 2, 3].map(Look));
        let inks: Vec<RGBAColor> = (0..49).map(|i| Look(i).line(1).color).collect();
        for (i, ink) in inks.iter().enumerate() {
            assert!(!inks[..i].contains(ink), "{i}");
        }
    }
}
