//! Why an estimate failed, for this crate's estimators and for programs that are methods.

use crate::data::DrawFailure;
use crate::names::UnknownName;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::str::FromStr;

/// Defines the failures of this crate's estimators and observers, and those of programs, each with the name that every
/// output uses and its meaning in a sentence.
macro_rules! failure_kinds {
    (
        own { $($(#[$of_own:meta])* $own:ident = $own_name:literal, $own_about:literal;)* }
        of programs { $($(#[$of_program:meta])* $program:ident = $name:literal, $about:literal;)* }
    ) => {
        /// Why a pass failed.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum FailureKind {
            $($(#[$of_own])* $own,)*
            $($(#[$of_program])* $program,)*
            /// A program failed for a reason of its own, "external: REASON".
            External(Reason),
        }

        impl FailureKind {
            /// The failures of this crate's own estimators and observers.
            pub const ALL: &[Self] = &[$(Self::$own,)*];

            /// The failures of programs, except those with a reason.
            pub const OF_PROGRAMS: &[Self] = &[$(Self::$program,)*];

            /// Returns the name that every output uses.
            pub fn name(&self) -> &str {
                match self {
                    $(Self::$own => $own_name,)*
                    $(Self::$program => $name,)*
                    Self::External(reason) => reason.name(),
                }
            }

            /// Returns what it means, in a sentence.
            pub const fn about(&self) -> &'static str {
                match self {
                    $(Self::$own => $own_about,)*
                    $(Self::$program => $about,)*
                    Self::External(_) => "A program failed for a reason of its own.",
                }
            }
        }
    };
}

failure_kinds! {
    own {
        /// A value is not finite.
        #[default]
        NonFinite = "non-finite", "A value is not finite.";
        /// A matrix is exactly singular: it has a zero row or column.
        Singular = "singular", "A matrix is exactly singular: it has a zero row or column.";
        /// A matrix is singular up to rounding, or a pivot is zero: [`crate::estimator::solver::rank::RANK_MULTIPLE`].
        RankDeficient = "rank-deficient", "A matrix is singular up to rounding, or a pivot is zero.";
        /// Continuous time: the error by step halving is above the study's limit.
        StepTooLong = "step-too-long", "Continuous time: the error by step halving is above the study's limit.";
        /// Continuous time: the disturbance of the trial makes the run too long.
        NotRun = "not-run", "Continuous time: the disturbance of the trial makes the run too long.";
        /// An iteration did not converge.
        NoConvergence = "no-convergence", "An iteration did not converge.";
        /// A search ended at the border of stability, or of a range that was given, where the criterion still falls;
        /// the best model so far is there.
        Boundary = "boundary",
            "A search ended at the border of stability, where the criterion still falls. The best model so far is \
             there; it is lost unless unfinished = \"counted\".";
        /// A search took all its iterations, or no step helped; the best model so far is there.
        IterationLimit = "iteration-limit",
            "A search took all its iterations, or no step helped. The best model so far is there; it is lost unless \
             unfinished = \"counted\".";
        /// A model that contradicts what its method assumes; it is there.
        Implausible = "implausible",
            "A model contradicts what its method assumes: a response that has not decayed at its last tap, a variance \
             of noise below 0. It is there, and lost unless unfinished = \"counted\".";
        /// As [`Self::Boundary`], in a study that counts such models.
        BoundaryCounted = "boundary-counted", "As boundary, in a study that counts such models.";
        /// As [`Self::IterationLimit`], in a study that counts such models.
        IterationLimitCounted = "iteration-limit-counted", "As iteration-limit, in a study that counts such models.";
        /// As [`Self::Implausible`], in a study that counts such models.
        ImplausibleCounted = "implausible-counted", "As implausible, in a study that counts such models.";
        /// The predictor of a model is not stable.
        UnstablePredictor = "unstable-predictor", "The predictor of a model is not stable.";
        /// The model whose output makes the instruments is unstable.
        UnstableInstruments = "unstable-instruments", "The model whose output makes the instruments is unstable.";
        /// The record does not distinguish the parameters: psi'psi is singular up to rounding.
        NotIdentifiable = "not-identifiable",
            "The record does not distinguish the parameters: their information is singular up to rounding.";
        /// No Kalman filter: its Riccati equation has no stabilising solution, or no noise has a finite likelihood.
        NoFilter = "no-filter",
            "No Kalman filter: its Riccati equation has no stabilising solution, or no noise has a finite likelihood.";
    }
    of programs {
        /// A program declined the record.
        Declined = "declined", "A program declined the record.";
        /// A program did not answer in time.
        Timeout = "timeout", "A program did not answer in time.";
        /// A program ended, or closed its output.
        Crashed = "crashed", "A program ended, or closed its output.";
        /// A program's reply violates the protocol.
        Malformed = "malformed", "A program's reply violates the protocol.";
    }
}

/// The name of a failure with a program's reason, "external: REASON".
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Reason {
    /// The name in ASCII, zeros after it.
    name: [u8; Self::ROOM],
}

impl Reason {
    /// The largest number of characters of a reason.
    pub const LONGEST: usize = 60;
    /// How its name begins.
    pub const PREFIX: &str = "external: ";
    const ROOM: usize = Self::PREFIX.len() + Self::LONGEST;

    /// Makes the reason from the text that a program gives. Only ASCII letters, digits, spaces and `-_.,()` are kept;
    /// other characters become `?`. A text longer than [`Self::LONGEST`] is cut.
    pub fn new(given: &str) -> Self {
        let plain = |c: char| c.is_ascii_alphanumeric() || " -_.,()".contains(c);
        let text = given.trim().chars().take(Self::LONGEST);
        let text: String = text.map(|c| if plain(c) { c } else { '?' }).collect();
        let mut name = [0; Self::ROOM];
        let bytes = Self::PREFIX.bytes().chain(text.trim_end().bytes());
        name.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
        Self { name }
    }

    /// The reason that stands for all that are too many to be counted one by one.
    pub fn others() -> Self {
        Self::new("(other reasons)")
    }

    fn name(&self) -> &str {
        let end = self.name.iter().position(|byte| *byte == 0);
        let bytes = &self.name[..end.unwrap_or(Self::ROOM)];
        std::str::from_utf8(bytes).unwrap_or(Self::PREFIX)
    }
}

impl std::fmt::Debug for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.name())
    }
}

impl FailureKind {
    /// Whether there is a model: the best that a search found, of which nothing but its being a minimum is missing, or
    /// one that contradicts what its method assumes.
    pub const fn leaves_a_model(self) -> bool {
        matches!(self, Self::Boundary | Self::IterationLimit | Self::Implausible)
    }

    /// Returns the kind of a trial whose model counts although the search came to no minimum; other kinds stay.
    #[must_use]
    pub const fn counted(self) -> Self {
        match self {
            Self::Boundary => Self::BoundaryCounted,
            Self::IterationLimit => Self::IterationLimitCounted,
            Self::Implausible => Self::ImplausibleCounted,
            other => other,
        }
    }

    /// Whether the trial's model counts.
    pub const fn is_counted(self) -> bool {
        matches!(
            self,
            Self::BoundaryCounted | Self::IterationLimitCounted | Self::ImplausibleCounted
        )
    }
}

impl std::fmt::Display for FailureKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for FailureKind {
    type Err = UnknownName;

    fn from_str(given: &str) -> Result<Self, UnknownName> {
        let known = || Self::ALL.iter().chain(Self::OF_PROGRAMS);
        if let Some(kind) = known().find(|kind| kind.name() == given) {
            return Ok(*kind);
        }
        if let Some(reason) = given.strip_prefix(Reason::PREFIX) {
            let reason = Reason::new(reason);
            // Accepts only a text that a program's reason can become.
            if reason.name() == given {
                return Ok(Self::External(reason));
            }
        }
        Err(UnknownName::new("failure", given, known().map(FailureKind::name)))
    }
}

impl Serialize for FailureKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for FailureKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        name.parse().map_err(serde::de::Error::custom)
    }
}

impl From<DrawFailure> for FailureKind {
    fn from(failure: DrawFailure) -> Self {
        match failure {
            DrawFailure::NonFinite => Self::NonFinite,
            DrawFailure::Singular => Self::Singular,
            DrawFailure::RankDeficient => Self::RankDeficient,
        }
    }
}

impl From<FailureKind> for DrawFailure {
    fn from(kind: FailureKind) -> Self {
        match kind {
            FailureKind::Singular => Self::Singular,
            FailureKind::RankDeficient => Self::RankDeficient,
            // Draws involve neither steps nor programs, and their controllers have observers by pole placement only.
            _ => Self::NonFinite,
        }
    }
}

/// Checks that all numbers are finite.
///
/// # Errors
/// [`FailureKind::NonFinite`].
pub(crate) fn all_finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Result<(), FailureKind> {
    let finite = numbers.into_iter().all(|number| number.is_finite());
    finite.then_some(()).ok_or(FailureKind::NonFinite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_failure_reads_back() {
        let reason = FailureKind::External(Reason::new("no minimum (3 starts)"));
        assert_eq!(reason.name(), "external: no minimum (3 starts)");
        let known = FailureKind::ALL.iter().chain(FailureKind::OF_PROGRAMS);
        for kind in known.chain([&reason]) {
            assert_eq!(kind.name().parse::<FailureKind>().unwrap(), *kind);
        }
        assert_eq!(
            Reason::new("no minimum (3 starts) "),
            Reason::new(" no minimum (3 starts)")
        );
        let long = Reason::new(&"\u{1b}[31m<".repeat(40));
        assert_eq!(long.name().len(), Reason::PREFIX.len() + Reason::LONGEST, "{long:?}");
        for wrong in ["external: \u{7}", "external:", "crash"] {
            assert!(wrong.parse::<FailureKind>().is_err(), "{wrong}");
        }
    }
}
