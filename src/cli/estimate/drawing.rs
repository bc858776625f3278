//! The pictures that `--plot` asks for.

use super::pictures;
use super::report::{Estimate, Report};
use crate::cli::files::picture_path;
use crate::names::named_enum;
use crate::report::plot::Picture;
use std::path::PathBuf;
use std::str::FromStr;

named_enum! {
    /// A picture of a record and its models.
    Kind, "picture" {
        /// Measured and simulated output, and prediction errors; of a range of orders the criteria.
        Output = "output",
        /// Magnitude and phase over the frequency.
        Bode = "bode",
        /// The step response.
        Step = "step",
        /// Poles and zeros.
        Poles = "poles",
        /// Correlations of the residuals.
        Residuals = "residuals",
    }
}

/// Other names of pictures.
const ELSEWHERE: &[(&str, Kind)] = &[
    ("compare", Kind::Output),
    ("fit", Kind::Output),
    ("order", Kind::Output),
    ("orders", Kind::Output),
    ("criteria", Kind::Output),
    ("freqresp", Kind::Bode),
    ("pzmap", Kind::Poles),
    ("zeros", Kind::Poles),
    ("resid", Kind::Residuals),
    ("correlations", Kind::Residuals),
];

impl Kind {
    fn named(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let elsewhere = || ELSEWHERE.iter().find(|(other, _)| *other == name);
        name.parse().ok().or_else(|| elsewhere().map(|(_, kind)| *kind))
    }

    /// The picture's content in words.
    pub(super) const fn about(self) -> &'static str {
        match self {
            Self::Output => "measured and simulated output, and prediction errors",
            Self::Bode => "magnitude and phase, with 95 % bands",
            Self::Step => "step response, with 95 % bands",
            Self::Poles => "poles and zeros, with 95 % regions",
            Self::Residuals => "correlations of the residuals, with the 99 % bounds of a single lag",
        }
    }
}

/// A picture and its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Drawing {
    pub(super) kind: Kind,
    pub(super) path: PathBuf,
}

impl FromStr for Drawing {
    type Err = String;

    /// Reads `bode=FILE`, `bode` for `bode.svg`, or a file: of the picture that it is named after, else of the output.
    fn from_str(text: &str) -> Result<Self, String> {
        let named = text
            .split_once('=')
            .and_then(|(name, path)| Some((Kind::named(name)?, path)));
        // A word before '=' names a picture, not a part of a file's name.
        let is_word = |name: &str| !name.is_empty() && name.chars().all(char::is_alphabetic);
        let of_unknown = text.split_once('=').is_some_and(|(name, _)| is_word(name));
        let (kind, path) = match (named, Kind::named(text)) {
            (Some((_, "")), _) => return Err("expected a file behind '='".to_owned()),
            (Some((kind, path)), _) => (kind, PathBuf::from(path)),
            (None, Some(kind)) => (kind, PathBuf::from(format!("{kind}.svg"))),
            (None, None) if text.contains('.') && !of_unknown => {
                let path = PathBuf::from(text);
                let stem = path.file_stem().and_then(|stem| stem.to_str());
                (stem.and_then(Kind::named).unwrap_or_default(), path)
            }
            (None, None) => {
                let kinds: Vec<&str> = Kind::ALL.iter().map(|kind| kind.name()).collect();
                if text.split(',').all(|part| Kind::named(part).is_some()) {
                    return Err("expected one picture; --plot may be repeated".to_owned());
                }
                return Err(format!(
                    "expected FILE.svg, FILE.pdf, or one of {}, such as bode=FILE.svg",
                    kinds.join(", ")
                ));
            }
        };
        let path = picture_path(path)?;
        Ok(Self { kind, path })
    }
}

/// Draws a picture of the models, and says of which: of poles and residuals there is one, that of the last estimator.
pub(super) fn picture(kind: Kind, report: &Report) -> Result<(Picture, String), String> {
    let about = kind.about();
    let of_last = |picture: fn(&Estimate) -> Option<Picture>| {
        let last = report.estimates.last().ok_or("there is no estimate")?;
        let drawn = picture(last).ok_or_else(|| format!("{} has none", last.name))?;
        Ok((drawn, format!("{about}, of {}", last.name)))
    };
    match kind {
        Kind::Output => Ok((pictures::outputs(report), about.to_owned())),
        Kind::Bode => Ok((pictures::bode(report), about.to_owned())),
        Kind::Step => Ok((pictures::steps(report), about.to_owned())),
        Kind::Poles => of_last(|last| last.last().precision.as_ref().map(pictures::plane)),
        Kind::Residuals => of_last(|last| {
            let residuals = last.last().residuals.as_ref();
            residuals.map(|residuals| pictures::correlations(1, residuals))
        }),
    }
}
