//! Colour for verdicts, on a terminal that wants it.

use crate::claim::Verdict;
use std::io::IsTerminal as _;

/// Whether standard output shows colours. It does on a terminal, unless `NO_COLOR` is set (https://no-color.org) or the
/// terminal is dumb; with `CLICOLOR_FORCE` it always does.
fn is_wanted() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    !set("NO_COLOR") && (set("CLICOLOR_FORCE") || !dumb && std::io::stdout().is_terminal())
}

/// Colours the verdicts in lines that judge claims. Such a line begins with the claim's name, two blanks and the
/// verdict; indented lines continue the one before.
pub(super) fn verdicts(text: &str) -> String {
    if !is_wanted() {
        return text.to_owned();
    }
    text.split_inclusive('\n').map(coloured).collect()
}

fn coloured(line: &str) -> String {
    // The longest name first, because one verdict begins with another's name.
    let mut all = Verdict::ALL.to_vec();
    all.sort_by_key(|verdict| std::cmp::Reverse(verdict.name().len()));
    let parts = line.split_once("  ").filter(|(id, _)| !id.is_empty());
    let found = parts.and_then(|(id, rest)| {
        let verdict = all.iter().find(|verdict| rest.starts_with(verdict.name()))?;
        let (name, rest) = rest.split_at(verdict.name().len());
        let colour = match verdict {
            Verdict::Holds => 32,
            Verdict::DoesNotHold => 31,
            Verdict::Undecided | Verdict::HoldsInPart => 33,
        };
        Some(format!("{id}  \x1b[{colour}m{name}\x1b[0m{rest}"))
    });
    found.unwrap_or_else(|| line.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_alone_has_a_colour() {
        for (line, expected) in [
            ("C4  holds: in all\n", "C4  \x1b[32mholds\x1b[0m: in all\n"),
            ("C4  holds in part. It\n", "C4  \x1b[33mholds in part\x1b[0m. It\n"),
            ("C2-a  does not hold: in", "C2-a  \x1b[31mdoes not hold\x1b[0m: in"),
            ("    holds nothing\n", "    holds nothing\n"),
        ] {
            assert_eq!(coloured(line), expected);
        }
    }
}
