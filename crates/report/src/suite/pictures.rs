//! The distribution functions of d.

use super::subject::SuitePage;
use crate::plot::{Picture, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use asobench_identification::metric::Estimate;
use asobench_study::suite::{IDEAL, KINDS, MethodResults, Scenario, ScenarioResults, ideal_share, share_within};
use asobench_study::text;

/// The decades of d that are drawn, and points in each.
const DECADES: (i32, i32) = (-2, 4);
const POINTS: i32 = 12;
/// Panels beside each other.
const COLUMNS: usize = 4;
/// From so many runs on a curve has a band beside others.
const FEW: usize = 100;

/// The values of d.
fn grid() -> impl Iterator<Item = f64> {
    let (from, to) = DECADES;
    (POINTS * from..=POINTS * to).map(|i| 10.0_f64.powf(f64::from(i) / f64::from(POINTS)))
}

/// A part of a page: the scenarios in open or in closed loop.
struct Loop<'a> {
    of: &'a SuitePage<'a>,
    is_closed: bool,
    /// The words of captions, and with dashes those of files.
    words: &'static str,
}

impl<'a> Loop<'a> {
    /// Those that have scenarios.
    fn all(of: &'a SuitePage<'a>) -> impl Iterator<Item = Self> {
        let loops = [("in open loop", false), ("in closed loop", true)];
        let loops = loops.map(|(words, is_closed)| Self { of, is_closed, words });
        loops.into_iter().filter(|of| of.scenarios().next().is_some())
    }

    fn scenarios(&self) -> impl Iterator<Item = &'a Scenario> {
        let is_closed = self.is_closed;
        self.of.suite.scenarios().filter(move |of| of.is_closed == is_closed)
    }

    /// The results of a method that is for such scenarios.
    fn results(&self, method: &MethodResults) -> Vec<ScenarioResults> {
        let both = self.of.suite.scenarios().zip(&method.scenarios);
        let both = both.filter(|(scenario, of)| scenario.is_closed == self.is_closed && of.has_runs());
        both.map(|(_, results)| results.clone()).collect()
    }

    /// A plot with both ideals.
    fn plot(&self, title: &str) -> Plot {
        let x = PlotAxis::log("d").range(10.0_f64.powi(DECADES.0), 10.0_f64.powi(DECADES.1));
        let y = PlotAxis::linear("share of runs").range(0.0, 1.0);
        let law = if self.of.suite.division.is_open() {
            "law of an efficient method"
        } else {
            "efficient: chi-squared(p)/p"
        };
        let ideal = grid().map(|d| Point::new(d, ideal_share(d, self.scenarios())));
        let plot = Plot::new(title, x, y);
        let plot = plot.series(Series::new(law, Style::Line, ideal.collect()).slot(2));
        let truth = self.of.methods.iter().find(|method| method.method == IDEAL);
        match truth.map(|method| curve(&self.results(method))) {
            None => plot,
            Some(points) => plot.series(Series::new(IDEAL, Style::Line, points).slot(1)),
        }
    }

    fn count(&self) -> String {
        text::count(self.scenarios().count() as u64, "scenario")
    }
}

/// The first picture, with its caption: one method of each kind and the newcomer, a panel for each kind of loop.
pub(super) fn overview(of: &SuitePage<'_>) -> (Picture, String) {
    let title = "Share of runs within d of the truth";
    // The ideals have the colours 1 and 2, the newcomer 0: a kind has the same on every page.
    let newcomer = of.newcomer.map(|name| (0, name));
    let kinds = KINDS.iter().enumerate();
    let kinds = kinds.map(|(place, kind)| (place + 3, *kind));
    let named = newcomer.into_iter().chain(kinds);
    let found = named.filter_map(|(slot, name)| {
        let method = of.methods.iter().find(|of| of.method == name);
        method.map(|method| (slot, method))
    });
    let drawn: Vec<(usize, &MethodResults)> = found.collect();
    let panels = Loop::all(of).map(|part| {
        let mut plot = part.plot(&format!("{}, {}", part.words, part.count()));
        for (slot, method) in &drawn {
            let results = part.results(method);
            let runs: usize = results.iter().map(|of| of.d.len()).sum();
            let (style, points) = match runs {
                0 => continue,
                // The bands of so few runs would cover each other.
                1..FEW => (Style::Line, curve(&results)),
                _ => (Style::Band, band(&results)),
            };
            plot = plot.series(Series::new(method.method.clone(), style, points).slot(*slot));
        }
        plot
    });
    let panels: Vec<Plot> = panels.collect();
    let description = format!("{title}, a panel for open and for closed loops");
    let sharing = Sharing { x: true, y: true };
    let picture = small_multiples(title, &description, &panels, 2, sharing);
    let caption = format!(
        "{title}, scenarios weighted equally: one method of each kind, all others are in the part Method by method. A \
         curve ends at the share of runs that are within d = 10,000. Dotted: the law of an efficient method; dashed: \
         `{IDEAL}`, the prediction error method of the true structure started at the truth. Band: 95 % Monte-Carlo \
         interval, drawn from {FEW} runs on."
    );
    (picture, caption)
}

/// Name, picture and caption for open and closed loops: a panel for each method.
pub(super) fn distributions(of: &SuitePage<'_>) -> Vec<(String, Picture, String)> {
    let division = if of.suite.division.is_open() { "choosing-" } else { "" };
    let drawn = Loop::all(of).map(|part| {
        let title = format!("Share of runs within d of the truth, {}", part.words);
        let caption = format!(
            "{title}: {}, weighted equally. Beside each method the law of an efficient one, and `{IDEAL}`. Band: 95 % \
             Monte-Carlo interval.",
            part.count()
        );
        let others = of.methods.iter().filter(|method| method.method != IDEAL);
        let panels = others.filter_map(|method| {
            let results = part.results(method);
            let plot = part.plot(&method.method);
            let own = Series::new("the method", Style::Band, band(&results)).slot(0);
            (!results.is_empty()).then(|| plot.series(own))
        });
        let panels: Vec<Plot> = panels.collect();
        let description = format!("{title}, a panel for each method");
        let sharing = Sharing { x: false, y: true };
        let picture = small_multiples(&title, &description, &panels, COLUMNS, sharing);
        (format!("{division}{}", part.words.replace(' ', "-")), picture, caption)
    });
    drawn.collect()
}

/// The share of runs within d, with its interval.
fn band(results: &[ScenarioResults]) -> Vec<Point> {
    let points = grid().map(|d| {
        let Estimate { value, mcse } = share_within(d, results.iter());
        let [low, high] = [-1.96, 1.96].map(|z| (value + z * mcse).clamp(0.0, 1.0));
        Point::interval(d, value, low, high)
    });
    points.collect()
}

fn curve(results: &[ScenarioResults]) -> Vec<Point> {
    let points = grid().map(|d| Point::new(d, share_within(d, results.iter()).value));
    points.collect()
}
