//! The look of a verdict on a page.

pub use asobench_study::claim::Verdict;

/// The class of a verdict, and its sign, which is recognised without colour.
pub(super) const fn look(verdict: Verdict) -> [&'static str; 2] {
    match verdict {
        Verdict::Holds => ["holds", "\u{2713}"],
        Verdict::HoldsInPart => ["partly", "\u{25d0}"],
        Verdict::DoesNotHold => ["refuted", "\u{2717}"],
        Verdict::Undecided => ["open", "?"],
    }
}

/// The sign and the words in a frame.
pub(super) fn badge(verdict: Verdict) -> String {
    let ([class, sign], name) = (look(verdict), verdict.name());
    format!("<span class=\"badge {class}\"><span aria-hidden=\"true\">{sign}</span> {name}</span>")
}

/// The sign alone, for the table of contents.
pub(super) fn mark(verdict: Verdict) -> String {
    let ([class, sign], name) = (look(verdict), verdict.name());
    format!("<span class=\"sign {class}\" role=\"img\" aria-label=\"{name}\" title=\"{name}\">{sign}</span>")
}
