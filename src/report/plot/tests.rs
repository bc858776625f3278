use super::*;
use crate::report::markup::elements;

const NAN: f64 = f64::NAN;
const STYLES: [Style; 7] = [
    Style::Line,
    Style::Markers,
    Style::Band,
    Style::ErrorBars,
    Style::Steps,
    Style::Traces,
    Style::Boxes,
];

fn count(svg: &str, element: &str) -> usize {
    let elements = elements(svg).unwrap_or_else(|error| panic!("{error} in {svg}"));
    elements.iter().filter(|name| *name == element).count()
}

fn axes() -> [(Axis, Axis); 4] {
    [
        (Axis::linear("k"), Axis::linear("e")),
        (Axis::log("N"), Axis::log("e")),
        (Axis::categories("", &["LS", "IV(4)"]), Axis::log("e")),
        (Axis::log("e"), Axis::categories("", &["LS", "IV(4)"])),
    ]
}

#[test]
fn degenerate_series_of_every_style_are_well_formed_and_say_so() {
    let nothing: [Vec<Point>; 3] = [
        Vec::new(),
        vec![Point::quantiles(NAN, [NAN; 5]); 3],
        vec![Point::interval(
            1.0,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
        )],
    ];
    for (x, y) in axes() {
        for style in STYLES {
            for points in &nothing {
                let series = Series::new("a", style, points.clone());
                let svg = Plot::new("t", x.clone(), y.clone()).series(series).svg();
                assert!(count(&svg, "text") > 2);
                assert!(svg.contains("No defined value."), "{style:?}");
                assert!(!svg.contains("NaN") && !svg.contains("inf"));
            }
            let one = vec![Point::quantiles(1.0, [0.5, 0.8, 1.0, 1.2, 2.0])];
            let series = Series::new("a", style, one);
            let svg = Plot::new("t", x.clone(), y.clone()).series(series).svg();
            assert!(count(&svg, "g") >= 2 && !svg.contains("NaN"));
            assert!(!svg.contains("No defined value."));
        }
    }
    let empty = small_multiples("t", "", &[], 3, Sharing::default());
    assert_eq!(count(&empty, "title"), 1);
}

#[test]
fn figures_have_no_id_and_escape_every_text() {
    let hostile = "<b> & \"q\" 'a'";
    let plot = Plot::new(
        hostile,
        Axis::linear(hostile),
        Axis::categories(hostile, &[hostile]),
    )
    .describe(hostile)
    .series(Series::new(
        hostile,
        Style::Line,
        vec![Point::new(1.0, 0.0)],
    ))
    .reference(hostile, Course::Vertical(2.0));
    let sharing = Sharing { x: true, y: true };
    let heat = Heat {
        title: hostile.to_owned(),
        description: hostile.to_owned(),
        row_label: hostile.to_owned(),
        column_label: hostile.to_owned(),
        rows: vec![hostile.to_owned()],
        columns: vec![hostile.to_owned()],
        groups: vec![(hostile.to_owned(), 1)],
        cells: vec![vec![Some(HeatCell {
            value: 1.0,
            text: hostile.to_owned(),
        })]],
        shading: Shading::Linear,
    };
    let panels = [plot.clone(), plot.clone(), plot.clone()];
    for svg in [
        plot.svg(),
        small_multiples(hostile, hostile, &panels, 2, sharing),
        heat.svg(),
    ] {
        assert!(count(&svg, "text") > 4);
        assert!(!svg.contains(" id=") && !svg.contains("<b>"));
        assert!(svg.contains("&lt;b&gt;"));
    }
}

/// The numbers of the course of the first path of a class.
fn course_of(svg: &str, class: &str) -> Vec<f64> {
    let start = svg.find(&format!("<path class=\"{class}\"")).unwrap();
    let course = svg[start..].split(" d=\"").nth(1).unwrap();
    let course = course.split('"').next().unwrap();
    let numbers = course.split(['M', 'L', ' ', 'Z']);
    let numbers = numbers.filter(|number| !number.is_empty());
    numbers.map(|number| number.parse().unwrap()).collect()
}

#[test]
fn a_power_law_is_straight_on_logarithmic_axes_and_parallel_to_its_reference() {
    let law = |n: f64| Point::new(n, 3.0 / n.sqrt());
    let points = [10.0, 100.0, 1000.0].map(law).to_vec();
    let through = (10.0, 6.0);
    let svg = Plot::new("t", Axis::log("N"), Axis::log("e"))
        .series(Series::new("a", Style::Line, points))
        .reference(
            "-1/2",
            Course::Sloped {
                slope: -0.5,
                through,
            },
        )
        .svg();
    let line = course_of(&svg, "line");
    assert!((line[2] - f64::midpoint(line[0], line[4])).abs() < 0.11);
    assert!((line[3] - f64::midpoint(line[1], line[5])).abs() < 0.11);
    let reference = svg.split("class=\"ref\"").last().unwrap();
    let at = |name: &str| -> f64 {
        let value = reference.split(&format!(" {name}=\"")).nth(1).unwrap();
        value.split('"').next().unwrap().parse().unwrap()
    };
    let slope = (line[5] - line[1]) / (line[4] - line[0]);
    let other = (at("y2") - at("y1")) / (at("x2") - at("x1"));
    assert!((slope - other).abs() < 1e-3 && slope > 0.0);
}

#[test]
fn ten_thousand_points_are_thinned_and_gaps_stay() {
    let wave = |k: usize| Point::new(k as f64, (k as f64 * 0.37).sin());
    let mut points: Vec<Point> = (0..100_000).map(wave).collect();
    points[50_000].y = NAN;
    let plot = Plot::new("t", Axis::linear("k"), Axis::linear("e")).series(Series::new(
        "a",
        Style::Line,
        points,
    ));
    let svg = plot.svg();
    assert!(svg.len() < 60_000, "{}", svg.len());
    assert_eq!(svg.matches("<path class=\"line\"").count(), 2);
    assert_eq!(svg, plot.svg());
}

#[test]
fn what_is_not_drawn_is_counted() {
    let points = [1.0, 0.0, -1.0, NAN, 50.0].map(|y| Point::new(1.0, y));
    let svg = Plot::new("t", Axis::linear("k"), Axis::log("e").range(0.1, 10.0))
        .series(Series::new("a", Style::Markers, points.to_vec()))
        .svg();
    assert!(svg.contains("Not shown: 2 points not above 0"));
    assert!(svg.contains("Outside of the axes: 1 point."));
    // One marker in the legend and one in the plot.
    assert_eq!(svg.matches("<path class=\"dot\"").count(), 2);
}

#[test]
fn shades_of_a_grid_follow_the_values() {
    let cell = |value: f64| {
        Some(HeatCell {
            value,
            text: value.to_string(),
        })
    };
    let mut heat = Heat {
        title: "t".to_owned(),
        description: String::new(),
        row_label: String::new(),
        column_label: String::new(),
        rows: vec!["r".to_owned()],
        columns: ["a", "b", "c", "d", "e"].map(str::to_owned).to_vec(),
        groups: Vec::new(),
        cells: vec![vec![cell(0.01), cell(0.1), cell(1.0), None, cell(NAN)]],
        shading: Shading::Log,
    };
    let shades = |heat: &Heat| -> Vec<String> {
        let svg = heat.svg();
        let parts = svg.split("fill-opacity=\"").skip(1);
        let shades = parts.map(|part| part.split('"').next().unwrap().to_owned());
        shades.collect()
    };
    assert_eq!(shades(&heat), ["0.04", "0.29", "0.55"].map(str::to_owned));
    heat.shading = Shading::Ratio(0.1);
    assert_eq!(shades(&heat), ["0.55", "0.00", "0.55"].map(str::to_owned));
    let svg = heat.svg();
    assert_eq!(svg.matches("<g class=\"s0\">").count(), 1);
    assert_eq!(svg.matches("<g class=\"s1\">").count(), 2);
}
