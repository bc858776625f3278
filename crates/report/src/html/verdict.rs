//! The look of a verdict on a page.

pub use asobench_study::claim::Verdict;

/// How a verdict is shown.
pub(crate) trait Badge {
    /// A sign that is recognised without colour.
    fn sign(self) -> &'static str;

    /// The sign and the words in a frame.
    fn badge(self) -> String;

    /// The sign alone, for the table of contents.
    fn mark(self) -> String;
}

impl Badge for Verdict {
    fn sign(self) -> &'static str {
        match self {
            Self::Holds => "\u{2713}",
            Self::HoldsInPart => "\u{25d0}",
            Self::DoesNotHold => "\u{2717}",
            Self::Undecided => "?",
        }
    }

    fn badge(self) -> String {
        let (class, sign, name) = (class(self), self.sign(), self.name());
        format!("<span class=\"badge {class}\"><span aria-hidden=\"true\">{sign}</span> {name}</span>")
    }

    fn mark(self) -> String {
        let (class, sign, name) = (class(self), self.sign(), self.name());
        format!(
            "<span class=\"sign {class}\" role=\"img\" aria-label=\"{name}\" \
            title=\"{name}\">{sign}</span>"
        )
    }
}

const fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "holds",
        Verdict::HoldsInPart => "partly",
        Verdict::DoesNotHold => "refuted",
        Verdict::Undecided => "open",
    }
}
