//! The look of a verdict on a page.

pub use crate::claim::Verdict;

impl Verdict {
    /// A sign that is recognised without colour.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Holds => "\u{2713}",
            Self::HoldsInPart => "\u{25d0}",
            Self::DoesNotHold => "\u{2717}",
            Self::Undecided => "?",
        }
    }

    const fn class(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsInPart => "partly",
            Self::DoesNotHold => "refuted",
            Self::Undecided => "open",
        }
    }

    /// The sign and the words in a frame.
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
            "<span class=\"sign {class}\" role=\"img\" aria-label=\"{name}\" \
            title=\"{name}\">{sign}</span>"
        )
    }
}
