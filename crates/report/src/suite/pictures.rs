//! The distribution functions of d.

use super::subject::SuitePage;
use crate::plot::{Picture, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use asobench_study::suite::{
    Estimated, IDEAL, MethodResults, Scenario, ScenarioResults, ideal_share, share_within,
};

/// The decades of d that are drawn, and points in each.
const DECADES: (i32, i32) = (-2, 4);
const POINTS: i32 = 12;
/// Panels beside each other.
const COLUMNS: usize = 4;

/// The values of d.
fn grid() -> impl Iterator<Item = f64> {
    let (from, to) = DECADES;
    (POINTS * from..=POINTS * to).map(|i| 10.0_f64.powf(f64::from(i) / f64::from(POINTS)))
}

/// Name, picture and caption for open and closed loops: a panel for each method.
pub(super) fn distributions(of: &SuitePage<'_>) -> Vec<(&'static str, Picture, String)> {
    let loops = [
        ("open", "in open loop", false),
        ("loop", "in closed loop", true),
    ];
    let drawn = loops.into_iter().filter_map(|(name, words, closed)| {
        let count = of.suite.scenarios().filter(|of| of.is_closed == closed).count();
        (count > 0).then(|| {
            let title = format!("Share of runs within d of the truth, {words}");
            let scenarios = if count == 1 { "scenario" } else { "scenarios" };
            let caption = format!(
                "{title}: {count} {scenarios}, weighted equally. Beside each method the law of an efficient \
                 one, and `{IDEAL}`, the prediction error method started at the truth. Band: 95 % Monte-Carlo interval."
            );
            (name, sheet(of, &title, closed), caption)
        })
    });
    drawn.collect()
}

fn sheet(of: &SuitePage<'_>, title: &str, closed: bool) -> Picture {
    let scenarios: Vec<&Scenario> = of.suite.scenarios().collect();
    let chosen = || {
        scenarios
            .iter()
            .copied()
            .filter(|of| of.is_closed == closed)
    };
    let part = |method: &MethodResults| -> Vec<ScenarioResults> {
        let both = scenarios.iter().zip(&method.scenarios);
        let chosen = both.filter(|(scenario, of)| scenario.is_closed == closed && of.has_runs());
        chosen.map(|(_, results)| results.clone()).collect()
    };
    let ideal: Vec<Point> = grid()
        .map(|d| Point::new(d, ideal_share(d, chosen())))
        .collect();
    let truth = of.methods.iter().find(|method| method.method == IDEAL);
    let truth = truth.map(|method| curve(&part(method), Point::new));
    let others = of.methods.iter().filter(|method| method.method != IDEAL);
    let others = others.filter(|method| !part(method).is_empty());
    let panels = others.map(|method| {
        let x = PlotAxis::log("d").range(10.0_f64.powi(DECADES.0), 10.0_f64.powi(DECADES.1));
        let y = PlotAxis::linear("share of runs").range(0.0, 1.0);
        let mut plot = Plot::new(method.method.clone(), x, y);
        plot = plot
            .series(Series::new("efficient: chi-squared(p)/p", Style::Line, ideal.clone()).slot(2));
        if let Some(truth) = &truth {
            plot = plot.series(Series::new(IDEAL, Style::Line, truth.clone()).slot(1));
        }
        let own = part(method);
        let points = grid().map(|d| {
            let Estimated { value, error } = share_within(d, own.iter());
            let [low, high] = [-1.96, 1.96].map(|z| (value + z * error).clamp(0.0, 1.0));
            Point::interval(d, value, low, high)
        });
        plot.series(Series::new("the method", Style::Band, points.collect()).slot(0))
    });
    let panels: Vec<Plot> = panels.collect();
    let description = format!("{title}, a panel for each method");
    let sharing = Sharing { x: true, y: true };
    small_multiples(title, &description, &panels, COLUMNS, sharing)
}

fn curve(results: &[ScenarioResults], point: impl Fn(f64, f64) -> Point) -> Vec<Point> {
    let points = grid().map(|d| point(d, share_within(d, results.iter()).value));
    points.collect()
}
