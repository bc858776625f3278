//! What an experiment says about a claim.

/// What an experiment says about a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Holds,
    /// It holds in some cells, of a claim that is not about all of them.
    HoldsInPart,
    /// It holds under a condition that the claim does not state.
    HoldsOnlyIf,
    /// It does not hold.
    DoesNotHold,
    /// The experiment does not decide.
    Undecided,
}

impl Verdict {
    /// The verdict in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsInPart => "holds in part",
            Self::HoldsOnlyIf => "holds only if",
            Self::DoesNotHold => "does not hold",
            Self::Undecided => "undecided",
        }
    }

    /// A sign that differs without colour.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Holds => "\u{2713}",
            Self::HoldsInPart | Self::HoldsOnlyIf => "\u{25d0}",
            Self::DoesNotHold => "\u{2717}",
            Self::Undecided => "?",
        }
    }

    const fn class(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsInPart | Self::HoldsOnlyIf => "partly",
            Self::DoesNotHold => "refuted",
            Self::Undecided => "open",
        }
    }

    /// Sign and words in a frame of their own.
    pub(super) fn badge(self) -> String {
        let (class, sign, name) = (self.class(), self.sign(), self.name());
        format!(
            "<span class=\"badge {class}\"><span aria-hidden=\"true\">{sign}</span> {name}</span>"
        )
    }

    /// The sign alone, for the table of contents.
    pub(super) fn mark(self) -> String {
        let (class, sign, name) = (self.class(), self.sign(), self.name());
        format!(
            "<span class=\"sign {class}\" role=\"img\" aria-label=\"{name}\" title=\"{name}\">{sign}</span>"
        )
    }
}
