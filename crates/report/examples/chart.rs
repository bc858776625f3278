//! A chart as SVG on stdout: `cargo run --release -p asobench-report --example chart > chart.svg`

use asobench_report::plot::{Plot, PlotAxis, Point, Series, Style};

fn main() {
    let points = (1..=20).map(|k| {
        let k = f64::from(k);
        Point::uncertain(k, (-k / 6.0).exp(), 0.02)
    });
    let error = Series::new("error", Style::Line, points.collect());
    let plot = Plot::new("Decay", PlotAxis::linear("k"), PlotAxis::linear("e_x")).series(error);
    println!("{}", plot.svg());
}
