//! `asobench plot`: one figure of a study, as it is asked for.

use super::error::Error;
use super::output::print;
use crate::files::{self, Kind};
use crate::metric::Statistic;
use crate::report::{Chosen, Study, chosen_figure};
use crate::study::Measure;
use crate::study::file::Key;
use std::path::PathBuf;
use std::process::ExitCode;

/// Draw one figure of a study as SVG: a measure over a setting, for some outputs
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Results folder, such as results/window
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The measure [default: the one with which the report begins]
    #[arg(long, value_name = "NAME")]
    measure: Option<Measure>,
    /// mean, sd, mse, rmse, trimmed, q05, q25, q50, q75 or q95 [default: medians with the spread of
    /// the trials]
    #[arg(long, value_name = "NAME")]
    statistic: Option<Statistic>,
    /// The setting along x, such as window [default: the one with the most values]
    #[arg(long, value_name = "SETTING")]
    over: Option<Key>,
    /// Only this output or method, such as oe or iv(4); may be repeated
    #[arg(long, value_name = "NAME")]
    method: Vec<String>,
    /// The title
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// A logarithmic y axis [default: as the measure is]
    #[arg(long, conflicts_with = "linear")]
    log: bool,
    /// A linear y axis
    #[arg(long)]
    linear: bool,
    /// The SVG file [default: STUDY-MEASURE.svg here]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: Arguments) -> Result<ExitCode, Error> {
    let study = Study::read(&arguments.folder).map_err(|error| Error::Input(error.to_string()))?;
    let chosen = Chosen {
        measure: arguments.measure,
        statistic: arguments.statistic,
        over: arguments.over,
        outputs: arguments.method,
        title: arguments.title,
        logarithmic: (arguments.log || arguments.linear).then_some(arguments.log),
    };
    let [name, svg, caption] = chosen_figure(&study, &chosen).map_err(Error::Input)?;
    let path = arguments
        .out
        .unwrap_or_else(|| format!("{name}.svg").into());
    files::replace(&path, Kind::Figure, svg.as_bytes())
        .map_err(|error| Error::Input(error.to_string()))?;
    print(&format!(
        "{}\n{}\n",
        path.display(),
        crate::text::wrap(&caption, 80, "").trim_end()
    ))?;
    Ok(ExitCode::SUCCESS)
}
