//! `asobench plot`: one figure of a study, as it is asked for.

use super::error::{Error, bad_input};
use super::files::{drawn, picture_path};
use super::output::{print, wrapped};
use crate::files::{self, Kind};
use crate::metric::Statistic;
use crate::names::{UnknownName, here};
use crate::report::plot::Drawing;
use crate::report::{Chosen, FigureKind, Mark, Study, chosen_figure, held};
use crate::study::Measure;
use crate::study::file::Key;
use crate::text::shell_word;
use clap::builder::{PathBufValueParser, TypedValueParser as _};
use std::path::PathBuf;

/// Draw one figure of a study as SVG or PDF: a measure over a setting, for some outputs
///
/// As the report draws it, with bounds and theory where they are known.
#[derive(clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(super) struct Arguments {
    /// Results folder, such as results/window
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The measure [default: the one with which the report begins]
    #[arg(long, alias = "y", value_name = "NAME", value_parser = measure)]
    measure: Option<Measure>,
    /// mean, sd, mse, rmse, trimmed, q05, q25, q50, q75 or q95 [default: medians with the spread of
    /// the trials]
    #[arg(long, value_name = "NAME")]
    statistic: Option<Statistic>,
    /// Bands or boxes that hold the middle 90 % of the trials [default: for few outputs]
    #[arg(long, conflicts_with_all = ["no_spread", "statistic"])]
    spread: bool,
    /// Medians with their intervals alone
    #[arg(long)]
    no_spread: bool,
    /// The setting along x, such as window [default: the one with the most values]
    #[arg(long, alias = "x", value_name = "SETTING", value_parser = setting)]
    over: Option<Key>,
    /// Only cells with this value of a setting, such as noise=white; may be repeated
    #[arg(long = "where", value_name = "SETTING=VALUE", value_parser = held)]
    at: Vec<(Key, String)>,
    /// Only this output or method, such as oe or iv(4); may be repeated
    #[arg(long, aliases = ["methods", "estimator"], value_name = "NAME")]
    method: Vec<String>,
    /// A value from elsewhere, such as "as printed: window=98, noise=ar: 0.033"; may be repeated
    #[arg(long, value_name = "NAME: SETTING=VALUE, ...: NUMBER")]
    mark: Vec<Mark>,
    /// Leaves out a line by its name in the legend, such as "slope -1/2"; may be repeated
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// A nested-loop plot: every cell as a step, and below which settings it has
    #[arg(long, conflicts_with_all = ["zip", "over", "at", "mark", "statistic", "spread"])]
    nested_loop: bool,
    /// A zip plot: the 95 % intervals of single trials, sorted; for studies with `coverage = true` and
    /// `store = "trials"`
    #[arg(long, conflicts_with_all = ["measure", "over", "mark", "statistic", "spread", "log", "linear"])]
    zip: bool,
    /// The coefficient of a zip plot, such as a_1 [default: that with the worst coverage]
    #[arg(long, value_name = "NAME", requires = "zip")]
    coefficient: Option<String>,
    /// The title
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// The width in print, where labels have 8 points: 88mm for one column, 180mm for two; or in
    /// units of a screen, where labels have 15: 900, and 440 for a narrow one
    #[arg(long, value_name = "WIDTH", value_parser = width)]
    width: Option<Width>,
    /// A logarithmic y axis [default: as the measure is]
    #[arg(long, conflicts_with = "linear")]
    log: bool,
    /// A linear y axis
    #[arg(long)]
    linear: bool,
    /// The file, .svg or .pdf [default: STUDY-MEASURE.svg here]
    #[arg(
        long, alias = "output", short_alias = 'o', value_name = "FILE",
        value_parser = PathBufValueParser::new().try_map(picture_path)
    )]
    out: Option<PathBuf>,
}

/// A setting, also by its name elsewhere: N is the window.
fn setting(given: &str) -> Result<Key, UnknownName> {
    let known: Vec<&str> = Key::ALL.iter().map(|key| key.name()).collect();
    here(given, &known).unwrap_or(given).parse()
}

/// A width in units of which a label has 15, and whether it is for print.
type Width = (f64, bool);

/// 300 to 3000 units, or as many millimetres as these are in print.
fn width(given: &str) -> Result<Width, String> {
    let millimetres = given.strip_suffix("mm");
    let number = millimetres.unwrap_or(given).trim().parse::<f64>().ok();
    let units = match millimetres {
        Some(_) => number.map(Drawing::units_of_print),
        None => number,
    };
    let units = units.filter(|units| (300.0..=3000.0).contains(units));
    let width = units.map(|units| (units, millimetres.is_some()));
    width.ok_or_else(|| "expected 57mm to 564mm, or 300 to 3000 units".to_owned())
}

/// A measure; a statistic of one is named as such.
fn measure(given: &str) -> Result<Measure, String> {
    given
        .parse()
        .map_err(|error: UnknownName| match given.to_lowercase().parse::<Statistic>() {
            Ok(statistic) => {
                format!("{given} is a statistic; expected a measure, such as e_a, and --statistic {statistic}")
            }
            Err(_) => error.to_string(),
        })
}

pub(super) fn run(arguments: Arguments) -> Result<(), Error> {
    if arguments.folder.is_file() {
        return Err(Error::Input(format!(
            "{}: a file; expected a folder of results. Of a record: asobench estimate {} --order 2 --plot bode",
            arguments.folder.display(),
            shell_word(arguments.folder.display())
        )));
    }
    let study = Study::read(&arguments.folder).map_err(bad_input)?;
    let chosen = Chosen {
        kind: match (arguments.zip, arguments.nested_loop) {
            (true, _) => FigureKind::Zip,
            (_, true) => FigureKind::NestedLoop,
            _ => FigureKind::Over,
        },
        measure: arguments.measure,
        statistic: arguments.statistic,
        spread: (arguments.spread || arguments.no_spread).then_some(arguments.spread),
        over: arguments.over,
        held: arguments.at,
        marks: arguments.mark,
        without: arguments.without,
        coefficient: arguments.coefficient,
        width: arguments.width.map(|(units, _)| units),
        outputs: arguments.method,
        title: arguments.title,
        logarithmic: (arguments.log || arguments.linear).then_some(arguments.log),
    };
    let (name, picture, caption) = chosen_figure(&study, &chosen).map_err(Error::Input)?;
    let picture = match arguments.width {
        Some((_, true)) => picture.for_print(),
        _ => picture,
    };
    let path = arguments.out.unwrap_or_else(|| format!("{name}.svg").into());
    let content = drawn("--out", &path, &picture)?;
    files::replace(&path, Kind::Figure, &content).map_err(bad_input)?;
    print(&format!("{}\n{}\n", path.display(), wrapped(&caption, "").trim_end()))
}
