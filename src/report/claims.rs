//! The bounds that the papers print, as hypotheses about a typical realisation.

use crate::study::Figure;

/// What a figure must stay below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// A printed number.
    Value(f64),
    /// "Zero", which in floating point is this multiple of eps times the condition number of the solve.
    Rounding(f64),
}

/// One printed bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The claim.
    pub claim: &'static str,
    /// The figure.
    pub figure: Figure,
    /// The figure's name in a table.
    pub label: &'static str,
    /// The bound.
    pub limit: Limit,
}

impl Bound {
    /// Whether a row's figure meets the bound; a figure that is undefined (NaN) does not.
    pub fn is_met(&self, value: f64, condition: f64) -> bool {
        match self.limit {
            Limit::Value(limit) => value < limit,
            Limit::Rounding(multiple) => value < multiple * f64::EPSILON * condition,
        }
    }

    /// The bound as a table shows it.
    pub fn text(&self) -> String {
        match self.limit {
            Limit::Value(limit) => format!("< {limit}"),
            Limit::Rounding(_) => "= 0".to_owned(),
        }
    }
}

const fn bound(claim: &'static str, figure: Figure, label: &'static str, limit: Limit) -> Bound {
    Bound {
        claim,
        figure,
        label,
        limit,
    }
}

/// The multiple of eps times condition within which C1's zeros are met.
const ROUNDING: f64 = 100.0;

/// The bounds of Nikolov et al. (2023), section 4: claims C1, C2, C3.
///
/// C3's "e_x(k) = 0.01 for 218 < k < 400" is taken as a bound of the root mean square over these k.
pub const NIKOLOV2023: &[Bound] = &[
    bound("C1", Figure::Ea, "e_a", Limit::Rounding(ROUNDING)),
    bound("C1", Figure::Eb, "e_b", Limit::Rounding(ROUNDING)),
    bound("C1", Figure::ExMax, "max e_x", Limit::Rounding(ROUNDING)),
    bound("C2", Figure::Ea, "e_a", Limit::Value(0.033)),
    bound("C2", Figure::Eb, "e_b", Limit::Value(0.01)),
    bound("C2", Figure::ExMax, "max e_x", Limit::Value(0.065)),
    bound("C3", Figure::Ea, "e_a", Limit::Value(0.017)),
    bound("C3", Figure::Eb, "e_b", Limit::Value(0.0057)),
    bound("C3", Figure::ExMax, "max e_x", Limit::Value(0.024)),
    bound("C3", Figure::ExRms, "rms e_x", Limit::Value(0.01)),
];
