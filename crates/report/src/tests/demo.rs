//! A page with every kind of figure and table, from made-up numbers: `ASOBENCH_DEMO=DIR cargo test --release -p
//! asobench-report demo` writes it as `DIR/demo.html`, with its figures beside it.

use crate::html::{CellText, Column, Page, Table, Verdict};
use crate::plot::{Course, Heat, HeatCell, Picture, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};
use crate::tests::xml::elements;
use crate::uncertain;

const LENGTHS: [f64; 7] = [50.0, 98.0, 218.0, 400.0, 800.0, 1600.0, 3200.0];

/// Numbers in (0, 1) that look random.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43758.5453;
    x - x.floor()
}

fn rates() -> Plot {
    let mut plot = Plot::new(
        "Error over the length of the window, noise level 10 %, 10,000 trials a point",
        PlotAxis::log("N, samples"),
        PlotAxis::log("median of e_a, relative"),
    );
    for (slot, (name, factor)) in [("LS", 0.9), ("IV(4)", 1.2), ("IV(4), white noise", 0.55)]
        .into_iter()
        .enumerate()
    {
        let point = |n: &f64| {
            let value = factor / n.sqrt();
            Point::uncertain(*n, value, 0.03 * value)
        };
        let points = LENGTHS.iter().map(point).collect();
        plot = plot.series(Series::new(name, Style::ErrorBars, points).slot(slot));
    }
    let through = (50.0, 0.2);
    plot.reference("slope -1/2", Course::Sloped { slope: -0.5, through })
        .reference("bound of C2, 0.033", Course::Horizontal(0.033))
        .reference("N of C2, 98", Course::Vertical(98.0))
}

fn bands() -> Plot {
    let band = |level: f64, seed: usize| {
        let point = |k: usize| {
            let middle = level * (1.0 + 0.4 * noise(k + seed));
            let gap = k < 98;
            let value = if gap { f64::NAN } else { middle };
            Point::interval(k as f64, value, value * 0.3, value * 2.4)
        };
        (0..2000).map(point).collect()
    };
    Plot::new(
        "Claim C2: error of the state over time",
        PlotAxis::linear("k, samples"),
        PlotAxis::log("e_x(k), relative"),
    )
    .series(Series::new("LS: median, 5-95 %", Style::Band, band(0.05, 0)))
    .series(Series::new("IV(4): median, 5-95 %", Style::Band, band(0.16, 7)))
    .reference("the paper's bound on every k >= N, 0.065", Course::Horizontal(0.065))
}

fn boxes(names: &[&str]) -> Plot {
    let group = |level: f64| -> Vec<Point> {
        let quantiles = |i: usize| {
            let level = level * (0.5 + noise(i + 3));
            let quantiles = [0.3, 0.6, 1.0, 1.7, 4.0].map(|factor| level * factor);
            (i != 2).then(|| Point::quantiles(i as f64, quantiles))
        };
        (0..names.len()).filter_map(quantiles).collect()
    };
    let mut plot = Plot::new(
        "e_a by noise: 5, 25, 50, 75 and 95 % quantiles",
        PlotAxis::categories("noise", names),
        PlotAxis::log("e_a, relative"),
    );
    for (label, level) in [("LS", 0.09), ("IV(4)", 0.12), ("IV(10)", 0.1)] {
        plot = plot.series(Series::new(label, Style::Boxes, group(level)));
    }
    plot
}

fn shares() -> Plot {
    let names = ["LS", "IV(4)", "IV(4), frozen auxiliary model", "ridge 0.1", "SVD"];
    let point = |(i, shift): (usize, f64)| {
        let share = 10.0 + 18.0 * noise(i) + shift;
        Point::interval(share, i as f64, share - 3.0, share + 3.0)
    };
    let points = |shift: f64| (0..names.len()).map(|i| point((i, shift))).collect();
    Plot::new(
        "Share of trials that meet the bound",
        PlotAxis::linear("trials with e_a < 0.033, %").range(0.0, 40.0),
        PlotAxis::categories("estimator", &names),
    )
    .series(Series::new("N = 98", Style::ErrorBars, points(0.0)))
    .series(Series::new("N = 218", Style::ErrorBars, points(6.0)))
    .reference("half of C1", Course::Vertical(25.0))
}

fn distribution() -> Plot {
    let steps = |scale: f64| {
        let mut values: Vec<f64> = (0..300).map(|i| scale * (0.1 + noise(i))).collect();
        values.sort_by(f64::total_cmp);
        let values = values.into_iter().enumerate();
        values
            .map(|(i, value)| Point::new(value, (i as f64 + 1.0) / 300.0))
            .collect()
    };
    let mut plot = Plot::new(
        "Distribution of max e_x",
        PlotAxis::log("max e_x, relative"),
        PlotAxis::linear("share of trials").range(0.0, 1.0),
    );
    for (i, name) in [
        "LS",
        "IV(1)",
        "IV(2)",
        "IV(3)",
        "IV(4)",
        "IV(5)",
        "IV(10)",
        "ridge 0.01",
    ]
    .into_iter()
    .enumerate()
    {
        let points = steps(0.3 * 1.3_f64.powi(i as i32));
        plot = plot.series(Series::new(name, Style::Line, points));
    }
    plot
}

fn panels() -> Picture {
    let panel = |(i, noise_name): (usize, &str)| {
        let mut plot = rates();
        plot.title = format!("Noise {noise_name}");
        plot.references.truncate(1);
        for point in plot.series.iter_mut().flat_map(|series| &mut series.points) {
            let factor = 2.0_f64.powi(i as i32);
            (point.y, point.low, point.high) = (point.y * factor, point.low * factor, point.high * factor);
        }
        plot
    };
    let names = [
        "1/A(q)",
        "white",
        "random walk",
        "AR(1), 0.9",
        "burst of outliers at random times",
    ];
    let panels: Vec<Plot> = names.into_iter().enumerate().map(panel).collect();
    small_multiples(
        "Rates by kind of noise",
        "Five panels.",
        &panels,
        3,
        Sharing { x: true, y: true },
    )
}

fn grid() -> Heat {
    let columns = ["50", "98", "218", "400", "998", "2000"].map(str::to_owned);
    let cell = |i: usize, j: usize| {
        let value = 0.2 * (1.0 + 2.0 * i as f64) / (1.0 + (j % 3) as f64) * (0.7 + noise(i + j));
        (i + j != 5).then(|| HeatCell {
            value,
            text: uncertain(value, 0.011 * value),
        })
    };
    let rows = ["1 %", "3 %", "10 %", "30 %"].map(str::to_owned);
    Heat {
        title: "Median of e_a over noise level and length".to_owned(),
        description: "Grows with the noise level, falls with the length.".to_owned(),
        column_label: "N, samples".to_owned(),
        cells: (0..4).map(|i| (0..6).map(|j| cell(i, j)).collect()).collect(),
        rows: rows.to_vec(),
        columns: columns.to_vec(),
    }
}

fn figures() -> Vec<(&'static str, Picture, &'static str)> {
    let few = ["1/A(q)", "white", "AR(1)", "burst of outliers"];
    let many: Vec<String> = (0..14).map(|i| format!("estimator number {i}")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    vec![
        ("rates", rates().picture(), "Bars are 95 % intervals of the median."),
        ("bands", bands().picture(), "Before `k = N` there is no estimate."),
        ("boxes", boxes(&few).picture(), "No estimate at AR(1)."),
        ("many", boxes(&many).picture(), "Names that do not fit are turned."),
        ("shares", shares().picture(), "Bars are 95 % intervals."),
        (
            "distribution",
            distribution().picture(),
            "Eight series, more than colours.",
        ),
        ("panels", panels(), "The dotted line has slope -1/2."),
        (
            "grid",
            Picture {
                wide: grid().drawing(),
                narrow: None,
            },
            "Digits in parentheses are standard errors.",
        ),
    ]
}

fn verdicts() -> Table {
    let columns = vec![
        Column::text("claim"),
        Column::text("what it says"),
        Column::text("verdict"),
        Column::number("median e_a, LS", ""),
        Column::number("median e_a, IV(4)", ""),
        Column::number("bound met", "% of trials"),
        Column::number("failed", "trials"),
    ];
    let mut table = Table::new(
        "Every claim with its verdict. Digits in parentheses are Monte-Carlo standard errors.",
        columns,
    );
    let verdicts = [
        (Verdict::Holds, "noise-free, N = 18: e_a, e_b, e_x are zero"),
        (Verdict::DoesNotHold, "eta = 10.018 %, N = 98: e_a < 0.033"),
        (Verdict::HoldsInPart, "log RMSE falls with slope -1/2 in log N"),
        (Verdict::Undecided, "four passes are enough"),
    ];
    for (i, (verdict, says)) in verdicts.into_iter().enumerate() {
        let value = 10.0_f64.powi(-4 * i as i32) * (1.0 + noise(i));
        table.row([
            CellText::text(format!("C{}", i + 1)).link(format!("#c{}", i + 1)),
            CellText::text(says),
            CellText::verdict(verdict),
            CellText::number(uncertain(value, value / 150.0), value),
            CellText::number(uncertain(1.3 * value, value / 90.0), 1.3 * value),
            CellText::number("5.2 \u{b1} 0.2", 5.2 - i as f64),
            if i == 2 {
                CellText::number("-", f64::NAN)
            } else {
                CellText::number((31 * i).to_string(), 31.0 * i as f64)
            },
        ]);
    }
    table
}

fn long_table() -> Table {
    let columns = vec![
        Column::number("trial", ""),
        Column::text("status"),
        Column::number("condition", ""),
    ];
    let mut table = Table::new("Trials that failed", columns);
    for i in 0..45 {
        let condition = 1e12 * (1.0 + 1e4 * noise(i));
        table.row([
            CellText::number((i * 37).to_string(), (i * 37) as f64),
            CellText::text("rank deficient in pass 2"),
            CellText::number(format!("{condition:.1e}"), condition),
        ]);
    }
    table
}

fn page() -> Page {
    let mut page = Page::new("asobench: what the papers claim and what a typical realisation shows");
    page.introduction(|s| {
        s.paragraph(
            "Made-up numbers, to look at the page. Every number has its Monte-Carlo \
            standard error; `asobench report` would write it.",
        );
        s.settings(&[
            ("version", "0.1.0"),
            ("revision", "dc6db91"),
            ("seed", "2023"),
            ("trials", "10,000 a cell"),
        ]);
    });
    page.section("verdicts", "Verdicts", |s| s.table(&verdicts()));
    let figures = figures();
    let all = [
        Verdict::Holds,
        Verdict::DoesNotHold,
        Verdict::HoldsInPart,
        Verdict::Undecided,
    ];
    for (i, pair) in figures.chunks(3).enumerate() {
        let id = format!("c{}", i + 1);
        page.section(
            &id,
            &format!("C{}: does the error fall in proportion to N?", i + 1),
            |s| {
                s.question(
                    "Robustness to noise grows in proportion to the number of samples N. Is the \
                    slope of log RMSE over log N -1/2?",
                );
                s.answer(
                    all[i],
                    "the slope is -0.497(3) for LS and -0.51(2) for IV(4), where the \
                    noise is `1/A(q)`; with white noise LS is biased and levels off.",
                );
                for (_, svg, caption) in pair {
                    s.figure(svg, caption);
                }
                s.heading("Numbers");
                s.table(&verdicts());
                s.files(&[("rates.csv", "tables/rates.csv"), ("rates.svg", "figures/rates.svg")]);
                s.heading("To run it again");
                s.code(
                    "asobench run experiments/rates.json --seed 2023 --trials 10000 --out \
                    results/rates --threads 8 --checkpoint\nasobench report results/rates",
                );
                s.details("Settings", |s| {
                    s.settings(&[
                        ("noise", "1/A(q), level 10 % of the window"),
                        ("lengths", "50, 98, 218, 400, 800, 1600, 3200"),
                    ]);
                });
                s.details("45 failures", |s| s.table(&long_table()));
            },
        );
    }
    page
}

#[test]
fn a_page_of_everything_is_well_formed_and_always_the_same() {
    let html = page().html();
    assert_eq!(html, page().html());
    let body = html.split("<body>").nth(1).unwrap();
    let names = elements(body.split("<script>").next().unwrap()).unwrap();
    // The nested viewports for the references and for each series are svg elements too.
    assert_eq!(names.iter().filter(|name| *name == "figure").count(), 8);
    assert!(!html.contains("NaN") && html.len() < 1_000_000);
    let Some(folder) = std::env::var_os("ASOBENCH_DEMO") else {
        return;
    };
    let folder = std::path::PathBuf::from(folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("demo.html"), html).unwrap();
    for (name, svg, _) in figures() {
        std::fs::write(folder.join(name).with_extension("svg"), svg.wide.svg()).unwrap();
    }
}
