use super::metrics::width;
use super::*;
use crate::tests::xml::elements;

const NAN: f64 = f64::NAN;
const STYLES: [Style; 4] = [Style::Line, Style::Band, Style::ErrorBars, Style::Boxes];

fn count(svg: &str, element: &str) -> usize {
    let elements = elements(svg).unwrap_or_else(|error| panic!("{error} in {svg}"));
    elements.iter().filter(|name| *name == element).count()
}

/// The value of an attribute of the element at the beginning of `tag`.
fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let value = tag.split('>').next().unwrap().split(&format!(" {name}=\"")).nth(1);
    value.and_then(|value| value.split('"').next()).unwrap_or("")
}

fn number(tag: &str, name: &str) -> f64 {
    attribute(tag, name).parse().unwrap()
}

/// Every upright text with the left, top, right and bottom of its letters.
fn texts(svg: &str) -> Vec<([f64; 4], &str)> {
    let all = svg.split("<text").skip(1);
    let upright = all.filter(|tag| attribute(tag, "transform").is_empty());
    let place = |tag: &str, text: &str| {
        let [x, y, size] = ["x", "y", "font-size"].map(|name| number(tag, name));
        let wide = width(text, size);
        let before = match attribute(tag, "text-anchor") {
            "end" => wide,
            "middle" => wide / 2.0,
            _ => 0.0,
        };
        [x - before, y - 0.72 * size, x - before + wide, y + 0.2 * size]
    };
    let texts = upright.map(|tag| (tag, &tag[tag.find('>').unwrap() + 1..tag.find("</").unwrap()]));
    texts.map(|(tag, text)| (place(tag, text), text)).collect()
}

fn axes() -> [(PlotAxis, PlotAxis); 4] {
    [
        (PlotAxis::linear("k"), PlotAxis::linear("e")),
        (PlotAxis::log("N"), PlotAxis::log("e")),
        (PlotAxis::categories("", &["LS", "IV(4)"]), PlotAxis::log("e")),
        (PlotAxis::log("e"), PlotAxis::categories("", &["LS", "IV(4)"])),
    ]
}

fn quantiles(level: f64) -> [f64; 5] {
    [0.3, 0.6, 1.0, 1.7, 4.0].map(|factor| factor * level)
}

#[test]
fn degenerate_series_of_every_style_are_well_formed_and_say_so() {
    let infinite = [1.0, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY];
    let [x, y, low, high] = infinite;
    let nothing: [Vec<Point>; 3] = [
        Vec::new(),
        vec![Point::quantiles(NAN, [NAN; 5]); 3],
        vec![Point::interval(x, y, low, high)],
    ];
    for (x, y) in axes() {
        for style in STYLES {
            let svg = |points: Vec<Point>| {
                let series = Series::new("a", style, points);
                Plot::new("t", x.clone(), y.clone()).series(series).svg()
            };
            for points in &nothing {
                let svg = svg(points.clone());
                assert!(count(&svg, "text") > 2);
                assert!(svg.contains("No defined value."), "{style:?}");
                assert!(!svg.contains("NaN") && !svg.contains("inf"));
            }
            let svg = svg(vec![Point::quantiles(1.0, quantiles(1.0))]);
            assert!(count(&svg, "svg") > 1 && !svg.contains("NaN"));
            assert!(!svg.contains("No defined value."));
        }
    }
    let empty = small_multiples("t", "", &[], 3, Sharing::default()).wide.svg();
    assert_eq!(count(&empty, "title"), 1);
}

/// Figures with every kind of axis, and with labels that are long, many, tiny or huge.
fn crowded() -> Vec<String> {
    let names: Vec<String> = (0..14).map(|i| format!("estimator number {i}")).collect();
    let words = ["1/A(q)", "white", "burst of outliers at random times"];
    let long = "share of trials that meet the bound on the relative error";
    let axes = [
        (PlotAxis::categories("noise", &names), PlotAxis::log(long)),
        (PlotAxis::categories("noise", &words), PlotAxis::linear("e")),
        (PlotAxis::linear(long), PlotAxis::categories("", &names)),
        (PlotAxis::log("N"), PlotAxis::log("e")),
        (PlotAxis::linear("t"), PlotAxis::linear("e")),
    ];
    let levels = [(1e-17, 2.0), (3.0, 1.01), (4e8, 1e3), (0.001, 2.7)];
    let all = axes.iter().flat_map(|axes| levels.map(|level| (axes, level)));
    let all = all.flat_map(|all| [Style::Boxes, Style::Line, Style::ErrorBars].map(|style| (all, style)));
    let figures = all.flat_map(|(((x, y), (least, factor)), style)| {
        let value = |i: usize| least * f64::powi(factor, i as i32);
        let points = (0..14).map(|i| match &y.scale {
            Scale::Categories(_) => Point::new(value(i), i as f64),
            _ => Point::quantiles(i as f64, quantiles(value(i))),
        });
        let points: Vec<Point> = points.collect();
        let series = |name| Series::new(name, style, points.clone());
        let mut plot = Plot::new(names.concat(), x.clone(), y.clone());
        plot.series = names[..8].iter().map(series).collect();
        let panels = vec![plot.clone(); 5];
        let panels = |sharing| small_multiples(long, "", &panels, 3, sharing);
        let shared = Sharing { x: true, y: true };
        let pictures = [plot.picture(), panels(Sharing::default()), panels(shared)];
        pictures.map(|of| [of.wide.svg(), of.narrow.expect("it is drawn").svg()])
    });
    figures.flatten().collect()
}

#[test]
fn no_texts_overlap_or_leave_the_figure() {
    for svg in crowded().into_iter().chain([grid().drawing().svg()]) {
        let (right, bottom) = (number(&svg, "width"), number(&svg, "height"));
        let texts = texts(&svg);
        assert!(texts.len() > 8);
        for (i, (a, text)) in texts.iter().enumerate() {
            assert!(
                a[0] >= 0.0 && a[1] >= 0.0 && a[2] <= right && a[3] <= bottom,
                "{text} {a:?}"
            );
            for (b, other) in &texts[..i] {
                let apart = a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3];
                assert!(apart, "'{text}' {a:?} on '{other}' {b:?}");
            }
        }
    }
}

/// A screen of 400 px has 376 px for a figure, so a letter of a tick is 12 px high in the narrow one.
#[test]
fn on_a_narrow_screen_letters_are_as_large() {
    for picture in [bands().picture(), panels_of(1), panels_of(3), panels_of(12)] {
        let narrow = picture.narrow.expect("it is drawn").svg();
        let scale = 376.0 / number(&narrow, "width");
        let sizes = narrow.split("font-size=\"").skip(1);
        let sizes = sizes.filter_map(|part| part.split('"').next()?.parse().ok());
        let least = sizes.fold(f64::INFINITY, f64::min);
        assert!(least * scale >= 11.5, "{}", least * scale);
    }
}

fn panels_of(count: usize) -> Picture {
    small_multiples("t", "", &vec![bands(); count], 3, Sharing { x: true, y: true })
}

fn bands() -> Plot {
    let point = |i| Point::interval(f64::from(i), f64::from(i), f64::from(i) - 1.0, f64::from(i) + 1.0);
    let series = |name| Series::new(name, Style::Band, (1..9).map(point).collect());
    let mut plot = Plot::new("t", PlotAxis::linear("N, samples"), PlotAxis::linear("e"));
    plot.series = ["a", "b"].map(series).to_vec();
    plot
}

/// Notes stand beside their points, on no marker and on no other note; where there is no room there is none.
#[test]
fn notes_hide_nothing() {
    let points = |n: u32| (0..n).map(|i| Point::new(f64::from(i), f64::from(i % 3))).collect();
    let svg = |n: u32| {
        let mut series = Series::new("", Style::ErrorBars, points(n));
        series.notes = (0..n).map(|i| format!("note{i}")).collect();
        Plot::new("t", PlotAxis::linear("x"), PlotAxis::linear("y"))
            .series(series)
            .svg()
    };
    let few = svg(6);
    assert_eq!(few.matches(">note").count(), 6, "{few}");
    let many = svg(400);
    let notes: Vec<_> = texts(&many)
        .into_iter()
        .filter(|(_, text)| text.starts_with("note"))
        .collect();
    assert!(!notes.is_empty() && notes.len() < 400);
    for (i, (a, text)) in notes.iter().enumerate() {
        for (b, other) in &notes[..i] {
            let apart = a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3];
            assert!(apart, "'{text}' {a:?} on '{other}' {b:?}");
        }
    }
}

/// Lines are named at their ends where that fits: then no name is in a legend, and each stands to the right of the
/// axes, in the order of the ends.
#[test]
fn lines_are_named_at_their_ends() {
    let plot = |names: &[&str], end: f64| {
        let mut plot = Plot::new("t", PlotAxis::linear("x"), PlotAxis::linear("y").range(0.0, 10.0));
        let lines = (1..).zip(names).map(|(i, name)| {
            let points = vec![Point::new(0.0, 0.0), Point::new(end, f64::from(i))];
            Series::new(*name, Style::Line, points)
        });
        plot.series = lines.collect();
        plot.x.range = Some((0.0, 10.0));
        plot
    };
    let place = |svg: &str, name: &str| {
        let all = texts(svg);
        let found = all.iter().filter(|(_, text)| *text == name);
        let [(place, _)] = found.collect::<Vec<_>>()[..] else {
            panic!("one {name}")
        };
        *place
    };
    let names = ["low", "middle", "high"];
    let ended = plot(&names, 10.0).svg();
    let places = names.map(|name| place(&ended, name));
    assert!(places.iter().all(|at| at[0] > 800.0), "{places:?}");
    assert!(places.windows(2).all(|pair| pair[0][1] > pair[1][3]), "{places:?}");
    // Lines that end early, and long names, are in the legend above the axes.
    let early = plot(&names, 5.0).svg();
    let long = [
        "a name of more than two lines of text at this width of the picture",
        "b",
    ];
    let long = plot(&long, 10.0).svg();
    for (svg, name) in [(&early, "low"), (&early, "high"), (&long, "b")] {
        assert!(place(svg, name)[3] < 80.0, "{name}");
    }
    // Of a line that another panel has alone the legend tells.
    let panels = [plot(&["low", "other", "high"], 10.0), plot(&["low", "high"], 10.0)];
    let pair = small_multiples("t", "", &panels, 2, Sharing::default()).wide.svg();
    assert!(place(&pair, "other")[3] < 80.0 && place(&pair, "low")[0] > 780.0);
    // Thirty do not fit under each other.
    let many: Vec<String> = (0..30).map(|i| format!("line{i}")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    let mut crowd = plot(&many, 10.0);
    crowd.y.range = None;
    let crowd = crowd.svg();
    assert!(place(&crowd, "line0")[0] < 100.0);
}

/// A line that is alone in its panel has no dashes; beside another it has them.
#[test]
fn a_lone_line_is_solid() {
    let line = |slot| {
        let points = vec![Point::new(0.0, 0.0), Point::new(1.0, 1.0), Point::new(2.0, 0.0)];
        Series::new("e", Style::Line, points).slot(slot)
    };
    let plot = |series: &[Series]| {
        let mut plot = Plot::new("t", PlotAxis::linear("x"), PlotAxis::linear("y"));
        plot.series = series.to_vec();
        plot.svg()
    };
    assert!(!plot(&[line(1)]).contains("stroke-dasharray"));
    let mut other = line(0);
    other.label = "measured".to_owned();
    assert!(plot(&[other, line(1)]).contains("stroke-dasharray"));
}

#[test]
fn figures_have_no_id_and_escape_every_text() {
    let hostile = "<b> & \"q\" 'a'";
    let x = PlotAxis::linear(hostile);
    let plot = Plot::new(hostile, x, PlotAxis::categories(hostile, &[hostile]))
        .series(Series::new(hostile, Style::Line, vec![Point::new(1.0, 0.0)]))
        .reference(hostile, Course::Vertical(2.0));
    let sharing = Sharing { x: true, y: true };
    let cell = HeatCell {
        value: 1.0,
        text: hostile.to_owned(),
    };
    let heat = Heat {
        title: hostile.to_owned(),
        description: hostile.to_owned(),
        column_label: hostile.to_owned(),
        rows: vec![hostile.to_owned()],
        columns: vec![hostile.to_owned()],
        cells: vec![vec![Some(cell)]],
    };
    let panels = [plot.clone(), plot.clone(), plot.clone()];
    let sheet = small_multiples(hostile, hostile, &panels, 2, sharing).wide.svg();
    for svg in [plot.svg(), sheet, heat.drawing().svg()] {
        assert!(count(&svg, "text") > 4);
        assert!(!svg.contains(" id=") && !svg.contains("<b>"));
        assert!(svg.contains("&lt;b&gt;"));
    }
}

/// The corners of the first path that has an attribute.
fn course_of(svg: &str, attribute: &str) -> Vec<f64> {
    let path = svg.split("<path").find(|path| path.contains(attribute)).unwrap();
    let course = path.split(" d=\"").nth(1).unwrap().split('"').next().unwrap();
    let numbers = course.split(['M', 'L', ' ', 'Z']).filter(|number| !number.is_empty());
    numbers.map(|number| number.parse().unwrap()).collect()
}

#[test]
fn a_power_law_is_straight_on_logarithmic_axes_and_parallel_to_its_reference() {
    let law = |n: f64| Point::new(n, 3.0 / n.sqrt());
    let course = Course::Sloped {
        slope: -0.5,
        through: (10.0, 6.0),
    };
    let svg = Plot::new("t", PlotAxis::log("N"), PlotAxis::log("e"))
        .series(Series::new("", Style::Line, [10.0, 100.0, 1000.0].map(law).to_vec()))
        .reference("", course)
        .svg();
    let line = course_of(&svg, "class=\"l s0\"");
    assert!((line[2] - f64::midpoint(line[0], line[4])).abs() < 0.11);
    assert!((line[3] - f64::midpoint(line[1], line[5])).abs() < 0.11);
    let reference = course_of(&svg, "stroke-width=\"1.6\"");
    let slope = (line[5] - line[1]) / (line[4] - line[0]);
    let other = (reference[3] - reference[1]) / (reference[2] - reference[0]);
    assert!((slope - other).abs() < 1e-3 && slope > 0.0);
}

#[test]
fn ten_thousand_points_are_thinned_and_gaps_stay() {
    let wave = |k: usize| Point::new(k as f64, (k as f64 * 0.37).sin());
    let mut points: Vec<Point> = (0..100_000).map(wave).collect();
    points[50_000].y = NAN;
    let plot = Plot::new("t", PlotAxis::linear("k"), PlotAxis::linear("e"));
    let plot = plot.series(Series::new("", Style::Line, points));
    let svg = plot.svg();
    assert!(svg.len() < 60_000, "{}", svg.len());
    let line = svg.split("<path").find(|path| path.contains("class=\"l s0\"")).unwrap();
    assert_eq!(line.matches('M').count(), 2);
    assert_eq!(svg, plot.svg());
    let course = line.split(" d=\"").nth(1).unwrap().split('"').next().unwrap();
    let decimals = course
        .split('.')
        .skip(1)
        .map(|rest| rest.find(|c: char| !c.is_ascii_digit()));
    assert!(decimals.flatten().all(|digits| digits == 1));
}

#[test]
fn what_is_not_drawn_is_counted_and_markers_stay_inside() {
    let points = [1.0, 0.0, -1.0, NAN, 50.0, 10.0, 0.1].map(|y| Point::new(1.0, y));
    let svg = Plot::new("t", PlotAxis::linear("k"), PlotAxis::log("e").range(0.1, 10.0))
        .series(Series::new("", Style::ErrorBars, points.to_vec()))
        .svg();
    assert!(svg.contains("Not shown: 2 points not above 0"));
    assert!(svg.contains("Outside the axes: 1 point."));
    let markers = svg.split("<circle").filter(|tag| tag.contains("r=\"4.6\""));
    let places: Vec<[f64; 2]> = markers.map(|tag| ["cx", "cy"].map(|name| number(tag, name))).collect();
    assert_eq!(places.len(), 3);
    let cut = svg.split("<svg").nth(2).unwrap();
    let [left, top, width, height] = ["x", "y", "width", "height"].map(|name| number(cut, name));
    for [x, y] in places {
        assert!((left..left + width).contains(&x) && (top..top + height).contains(&y));
    }
}

fn grid() -> Heat {
    let cell = |value: f64| {
        Some(HeatCell {
            value,
            text: format!("{value}\n{value}"),
        })
    };
    Heat {
        title: "t".to_owned(),
        description: String::new(),
        column_label: "amplitude of the disturbance".to_owned(),
        rows: vec![
            "random walk, frequency 2 rad/s, level 0.1".to_owned(),
            "white".to_owned(),
        ],
        columns: (0..6).map(|i| format!("1e-{i}")).collect(),
        cells: vec![vec![cell(1.0), cell(2.0), None], vec![cell(3.0), cell(NAN)]],
    }
}

#[test]
fn shades_of_a_grid_follow_the_values() {
    let svg = grid().drawing().svg();
    let parts = svg.split("fill-opacity=\"").skip(1);
    let shades: Vec<&str> = parts.map(|part| part.split('"').next().unwrap()).collect();
    assert_eq!(shades, ["0.04", "0.295", "0.55"]);
}

/// The corners of a square are equally far apart. The part of a region outside the axes does not count as missing
/// values.
#[test]
fn equal_units_keep_a_square_a_square() {
    let corner = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Point::new(2.0 * cos, 2.0 * sin)
    };
    let corners = [20.0, 110.0, 200.0, 290.0].map(corner).to_vec();
    let axis = |low, high| PlotAxis::linear("").range(low, high);
    for [x, y] in [[axis(-1.0, 1.0), axis(-1.0, 1.0)], [axis(-9.0, 2.0), axis(0.0, 1.0)]] {
        let mut plot = Plot::new("t", x, y)
            .series(Series::new("", Style::Region, corners.clone()))
            .series(Series::new("", Style::Line, vec![Point::new(0.5, 0.5)]));
        plot.equal_units = true;
        let panels = [plot.clone(), plot.clone()];
        let pair = small_multiples("t", "", &panels, 2, Sharing::default()).wide.svg();
        for svg in [plot.svg(), pair] {
            let places = course_of(&svg, "fill-opacity=\"0.16\"");
            let next = places[2..].iter().chain(&places[..2]);
            let sides: Vec<f64> = places.iter().zip(next).map(|(a, b)| b - a).collect();
            let lengths = sides.chunks(2).map(|side| side[0].hypot(side[1]));
            // Places are rounded to tenths.
            assert!(
                lengths
                    .clone()
                    .all(|length| (length - sides[0].hypot(sides[1])).abs() < 0.3)
            );
            assert_eq!(lengths.count(), 4);
            assert!(!svg.contains("Outside of the axes"));
        }
    }
}
