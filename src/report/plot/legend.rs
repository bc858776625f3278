//! The legend above the plots, and which series looks how.

use super::canvas::{Anchor, COLOURS, Canvas, LABEL, WIDTH, course, px};
use super::metrics::{width, wrap};
use super::{Plot, Style};

/// Dashes of the palette, so that lines differ without colour.
const DASHES: [&str; 7] = ["", "9 5", "3 4", "12 4 3 4", "18 5", "6 3 2 3 2 3", "1.5 3"];
/// Dashes of reference lines, which have the colour of the text.
const REFERENCE_DASHES: [&str; 5] = ["2 5", "14 4 2 4", "6 6", "10 3 2 3 2 3", ""];

/// The look of a place in the palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look(usize);

impl Look {
    /// The class with the colour.
    pub(super) fn class(self) -> String {
        format!("s{}", self.0 % COLOURS)
    }

    pub(super) fn dashes(self) -> &'static str {
        // Beyond the palette the colours return with other dashes.
        DASHES[(self.0 + self.0 / COLOURS) % DASHES.len()]
    }

    /// The marker about a place.
    pub(super) fn marker(self, canvas: &mut Canvas, (x, y): (f64, f64)) {
        let corners: &[(f64, f64)] = match (self.0 + self.0 / COLOURS) % 7 {
            0 => return disc(canvas, "dot", (x, y)),
            1 => &[(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)],
            2 => &[(0.0, -5.4), (5.0, 3.8), (-5.0, 3.8)],
            3 => &[(0.0, -5.8), (5.8, 0.0), (0.0, 5.8), (-5.8, 0.0)],
            4 => &[(0.0, 5.4), (5.0, -3.8), (-5.0, -3.8)],
            5 => return disc(canvas, "open", (x, y)),
            _ => {
                let bars = [((-4.5, -4.5), (4.5, 4.5)), ((-4.5, 4.5), (4.5, -4.5))];
                for (a, b) in bars {
                    canvas.line("line", "", (x + a.0, y + a.1), (x + b.0, y + b.1));
                }
                return;
            }
        };
        let outline: Vec<(f64, f64)> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
        canvas.path("dot", "", &format!("{}Z", course(&outline)));
    }
}

fn disc(canvas: &mut Canvas, class: &str, (x, y): (f64, f64)) {
    let (left, y) = (px(x - 4.6), px(y));
    let half = |step: &str| format!("a4.6 4.6 0 1 1 {step} 0");
    canvas.path(
        class,
        "",
        &format!("M{left} {y}{}{}Z", half("9.2"), half("-9.2")),
    );
}

/// What a label stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    Series(Style, Look),
    Reference(usize),
}

/// The labels of all panels with their looks, in order of appearance, series first.
#[derive(Debug)]
pub(super) struct Legend {
    entries: Vec<(String, Entry)>,
}

impl Legend {
    /// The legend that several plots share: the same label looks the same in each.
    pub(super) fn of(plots: &[Plot]) -> Self {
        let series = || plots.iter().flat_map(|plot| &plot.series);
        let taken: Vec<usize> = series().filter_map(|series| series.slot).collect();
        let mut free = (0..).filter(|slot| !taken.contains(slot));
        let mut entries: Vec<(String, Entry)> = Vec::new();
        for series in series() {
            if entries.iter().all(|(label, _)| *label != series.label) {
                let slot = series.slot.or_else(|| free.next()).unwrap_or(0);
                entries.push((
                    series.label.clone(),
                    Entry::Series(series.style, Look(slot)),
                ));
            }
        }
        let references = plots.iter().flat_map(|plot| &plot.references);
        let mut count = 0;
        for reference in references {
            let known = entries.iter().any(|(label, entry)| {
                *label == reference.label && matches!(entry, Entry::Reference(_))
            });
            if !known {
                entries.push((reference.label.clone(), Entry::Reference(count)));
                count += 1;
            }
        }
        Self { entries }
    }

    /// The look of a series.
    pub(super) fn look(&self, label: &str) -> Look {
        let looks = self.entries.iter().filter_map(|entry| match entry {
            (name, Entry::Series(_, look)) if name == label => Some(*look),
            _ => None,
        });
        looks.into_iter().next().unwrap_or(Look(0))
    }

    /// The dashes of a reference line.
    pub(super) fn reference_dashes(&self, label: &str) -> &'static str {
        let mut dashes = self.entries.iter().filter_map(|entry| match entry {
            (name, Entry::Reference(i)) if name == label => Some(*i),
            _ => None,
        });
        REFERENCE_DASHES[dashes.next().unwrap_or(0) % REFERENCE_DASHES.len()]
    }

    /// Draws the legend in rows below `top` and gives its height.
    pub(super) fn draw(&self, canvas: &mut Canvas, top: f64) -> f64 {
        const SAMPLE: f64 = 40.0;
        const ROW: f64 = 22.0;
        let (mut x, mut y) = (EDGE, top);
        let named = self.entries.iter().filter(|(label, _)| !label.is_empty());
        let mut height = 0.0;
        for (label, entry) in named {
            let lines = wrap(label, LABEL, WIDTH - 2.0 * EDGE - SAMPLE - 8.0);
            let widths = lines.iter().map(|line| width(line, LABEL));
            let needed = SAMPLE + 8.0 + widths.fold(0.0, f64::max);
            if x > EDGE && x + needed > WIDTH - EDGE {
                (x, y) = (EDGE, top + height);
            }
            entry.sample(canvas, x, y + ROW / 2.0, SAMPLE);
            for (i, line) in lines.iter().enumerate() {
                let place = (x + SAMPLE + 8.0, y + 16.0 + i as f64 * ROW);
                canvas.text("", Anchor::Start, place, line);
            }
            x += needed + 22.0;
            height = f64::max(height, y - top + ROW * lines.len() as f64);
        }
        height
    }
}

/// Empty space at both sides of titles and legends.
pub(super) const EDGE: f64 = 12.0;

impl Entry {
    /// A sample of what is drawn, from x over `length`, about the height y.
    fn sample(self, canvas: &mut Canvas, x: f64, y: f64, length: f64) {
        let (from, to) = ((x, y), (x + length, y));
        let middle = (x + length / 2.0, y);
        let (style, look) = match self {
            Self::Reference(i) => {
                let dashes = REFERENCE_DASHES[i % REFERENCE_DASHES.len()];
                return canvas.line("ref", dashes, from, to);
            }
            Self::Series(style, look) => (style, look),
        };
        canvas.group(&look.class(), |canvas| match style {
            Style::Line | Style::Steps => canvas.line("line", look.dashes(), from, to),
            Style::Markers => look.marker(canvas, middle),
            Style::Traces => {
                for dy in [-4.0, 0.0, 4.0] {
                    canvas.line("trace", "", (from.0, y + dy), (to.0, y + dy));
                }
            }
            Style::Band => {
                canvas.rectangle("band", (x, y - 8.0), (x + length, y + 8.0));
                canvas.line("line", look.dashes(), from, to);
            }
            Style::ErrorBars => {
                canvas.line("thin", "", (middle.0, y - 9.0), (middle.0, y + 9.0));
                look.marker(canvas, middle);
            }
            Style::Boxes => {
                canvas.rectangle("box", (x + 6.0, y - 7.0), (x + length - 6.0, y + 7.0));
                look.marker(canvas, middle);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::{Axis, Series};

    #[test]
    fn a_label_looks_the_same_in_every_panel_and_no_two_alike() {
        let plot = |labels: &[(&str, Option<usize>)]| {
            let mut plot = Plot::new("", Axis::linear(""), Axis::linear(""));
            for (label, slot) in labels {
                let series = Series::new(*label, Style::Line, Vec::new());
                let slot = slot.map_or(series.clone(), |slot| series.slot(slot));
                plot = plot.series(slot);
            }
            plot
        };
        let plots = [
            plot(&[("LS", None), ("ridge", None), ("IV", Some(1))]),
            plot(&[("IV", Some(1)), ("LS", None), ("SVD", None)]),
        ];
        let legend = Legend::of(&plots);
        let looks = ["LS", "IV", "ridge", "SVD"].map(|label| legend.look(label));
        assert_eq!(looks, [0, 1, 2, 3].map(Look));
        let classes: Vec<_> = (0..49)
            .map(|i| (Look(i).class(), Look(i).dashes()))
            .collect();
        for (i, class) in classes.iter().enumerate() {
            assert!(!classes[..i].contains(class), "{i}");
        }
    }
}
