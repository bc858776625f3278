//! The specification of a plot: axes, series, reference lines.

/// The scale of an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic. Values that are not positive are not drawn, and the figure gives their number.
    Log,
    /// Names: value i is at the i-th name. On the y axis the first name is at the top.
    Categories(Vec<String>),
}

/// An axis of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotAxis {
    /// Quantity and unit.
    pub label: String,
    /// The scale.
    pub scale: Scale,
    /// The ends; if `None`, the axis holds every value drawn.
    pub range: Option<(f64, f64)>,
}

impl PlotAxis {
    pub(super) fn new(label: impl Into<String>, scale: Scale) -> Self {
        Self {
            label: label.into(),
            scale,
            range: None,
        }
    }

    /// A linear axis that holds every value.
    pub fn linear(label: impl Into<String>) -> Self {
        Self::new(label, Scale::Linear)
    }

    /// A logarithmic axis that holds every positive value.
    pub fn log(label: impl Into<String>) -> Self {
        Self::new(label, Scale::Log)
    }

    /// An axis of names.
    pub fn categories(label: impl Into<String>, names: &[impl AsRef<str>]) -> Self {
        let names = names.iter().map(|name| name.as_ref().to_owned()).collect();
        Self::new(label, Scale::Categories(names))
    }

    /// Whether it is an axis of names.
    pub(crate) fn has_names(&self) -> bool {
        matches!(self.scale, Scale::Categories(_))
    }

    /// Returns the axis with given ends.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }
}

/// A value with an interval. A number that is not finite is undefined; a line has a gap there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Place on the x axis.
    pub x: f64,
    /// Place on the y axis.
    pub y: f64,
    /// Lower end of the interval (in y; in x if the y axis has categories).
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// First and third quartile, for [`Style::Boxes`].
    pub quartiles: [f64; 2],
    /// The place of its words in [`Series::hints`].
    pub hint: Option<usize>,
}

impl Point {
    /// A value without an interval.
    pub fn new(x: f64, y: f64) -> Self {
        Self::interval(x, y, f64::NAN, f64::NAN)
    }

    /// A value with the interval from `low` to `high`.
    pub fn interval(x: f64, y: f64, low: f64, high: f64) -> Self {
        Self {
            x,
            y,
            low,
            high,
            quartiles: [f64::NAN; 2],
            hint: None,
        }
    }

    /// A value with its 95 % interval, 1.96 standard errors to either side.
    pub fn uncertain(x: f64, y: f64, standard_error: f64) -> Self {
        let half = 1.96 * standard_error;
        Self::interval(x, y, y - half, y + half)
    }

    /// The 5, 25, 50, 75 and 95 % quantiles at x.
    pub fn quantiles(x: f64, [q05, q25, q50, q75, q95]: [f64; 5]) -> Self {
        Self {
            quartiles: [q25, q75],
            ..Self::interval(x, q50, q05, q95)
        }
    }
}

/// How a series is drawn. Every line is thinned to the resolution of the figure; extremes are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line through the points.
    Line,
    /// Pairs of points at one height, each the two ends of a step; lines between steps are thin. Of steps at one place
    /// the series drawn first is the widest, so that those behind are seen too.
    Steps,
    /// A line through the points and the band of their intervals.
    Band,
    /// The area that the points enclose, or a line if there are two points; gaps separate areas. The points are not
    /// values, so those outside the axes are not reported.
    Region,
    /// Nothing but the notes of the points.
    Notes,
    /// Markers with bars, joined by a thin line unless an axis has categories. Bars of several series at one place are
    /// drawn side by side.
    ErrorBars,
    /// Markers with bars, not joined and not side by side.
    Marks,
    /// A thin horizontal line for each point, from one end of its interval to the other, which are values of x.
    Spans,
    /// Boxes between the quartiles with the median, whiskers over the interval. Boxes of several
    /// series at one place are drawn side by side.
    Boxes,
}

/// Points that form a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The name in the legend; a series with an empty name is not in the legend.
    pub label: String,
    /// How it is drawn.
    pub style: Style,
    /// The points, joined in this order.
    pub points: Vec<Point>,
    /// The place in the palette, so that an estimator looks the same in every figure; if `None`, the first free one.
    pub slot: Option<usize>,
    /// A short text beside each point, drawn where there is room for it; empty where there is none.
    pub notes: Vec<String>,
    /// Words on points, which a page shows when a reader points at one.
    pub hints: Vec<String>,
}

impl Series {
    /// A series with the first free place in the palette.
    pub fn new(label: impl Into<String>, style: Style, points: Vec<Point>) -> Self {
        Self {
            label: label.into(),
            style,
            points,
            slot: None,
            notes: Vec::new(),
            hints: Vec::new(),
        }
    }

    /// Returns the series with a given place in the palette.
    #[must_use]
    pub fn slot(mut self, slot: usize) -> Self {
        self.slot = Some(slot);
        self
    }
}

/// The position of a reference line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// A constant y.
    Horizontal(f64),
    /// A constant x.
    Vertical(f64),
    /// A line in the coordinates of the axes, with logarithms in decades: on two logarithmic axes the slope -1/2 means
    /// y ~ x^(-1/2).
    Sloped {
        /// Rise over run.
        slope: f64,
        /// A point (x, y) of the line.
        through: (f64, f64),
    },
}

impl Course {
    /// The constant y, if it is one.
    pub(crate) fn level(self) -> Option<f64> {
        match self {
            Self::Horizontal(y) => Some(y),
            _ => None,
        }
    }
}

/// A line to compare with: a bound of the paper, a rate from theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The name in the legend.
    pub label: String,
    /// Its position.
    pub course: Course,
}

/// All points of some plots.
pub(crate) fn points(plots: &[Plot]) -> impl Iterator<Item = &Point> {
    let series = plots.iter().flat_map(|plot| &plot.series);
    series.flat_map(|series| &series.points)
}

/// The smallest and the largest of some numbers.
pub(crate) fn extent(numbers: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let numbers = numbers.into_iter();
    numbers.fold(none, |(low, high), x| (low.min(x), high.max(x)))
}

/// The items, each once, in the order of their first appearance.
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for item in items {
        if !found.contains(&item) {
            found.push(item);
        }
    }
    found
}

/// A plot of series over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// The title.
    pub title: String,
    /// A description in a sentence or two, for readers who cannot see the plot; if empty, the title is used.
    pub description: String,
    /// The horizontal axis.
    pub x: PlotAxis,
    /// The vertical axis.
    pub y: PlotAxis,
    /// The series; the last one is on top.
    pub series: Vec<Series>,
    /// Lines to compare with.
    pub references: Vec<Reference>,
    /// The ends of a shaded range of y, or of x if the y axis has categories.
    pub shaded: Option<[f64; 2]>,
    /// Whether a unit has the same length along x and y, so that circles are round; one range is then wider than
    /// needed.
    pub equal_units: bool,
}

impl Plot {
    /// A plot without series.
    pub fn new(title: impl Into<String>, x: PlotAxis, y: PlotAxis) -> Self {
        Self {
            title: title.into(),
            description: String::new(),
            x,
            y,
            series: Vec::new(),
            references: Vec::new(),
            shaded: None,
            equal_units: false,
        }
    }

    /// Returns the plot with one more series.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Whether there is nothing that a line could be confused with, so that it needs no dashes.
    pub(super) fn has_one_line(&self) -> bool {
        let drawn = |series: &&Series| !series.points.is_empty() && series.style != Style::Region;
        self.series.iter().filter(drawn).count() == 1
    }

    /// Returns the plot with one more reference line.
    #[must_use]
    pub fn reference(mut self, label: impl Into<String>, course: Course) -> Self {
        let label = label.into();
        self.references.push(Reference { label, course });
        self
    }
}
