//! Subcommands of other programs.

use super::table::{self, Answer};
use super::values;

/// Words that may stand before a command: `show bode`, and before a picture `plot bode`.
const BEFORE: [&str; 4] = ["plot", "show", "draw", "view"];

/// Flags that say the orders make `--order` superfluous.
const ORDERS: [&str; 8] = ["--orders", "-n", "--na", "--nb", "--nc", "--nd", "--nf", "--nk"];

/// A command, and what it is called here.
pub(super) struct Answered {
    pub(super) given: String,
    pub(super) words: &'static str,
    /// The line instead, and the flags that are added to it unless they are given, if they are determined.
    pub(super) instead: Option<[Vec<String>; 2]>,
}

/// Returns what the command at the beginning of a line is called here; `None` of commands that are not in the table.
pub(super) fn answer(line: &[String]) -> Option<Answered> {
    let first = line.first()?;
    let second = line.get(1).map_or("", String::as_str);
    let answered = |count: usize, words, typed: Option<&str>, rest| Answered {
        given: line[..count].join(" "),
        words,
        instead: typed.and_then(|typed| instead(typed, &line[count - 1], rest)),
    };
    let draws = |answer: &&Answer| answer.typed.is_some_and(|typed| typed.contains("--plot"));
    if second.to_lowercase().ends_with(".csv")
        && let Some(of_record) = table::answer(first, "WORD RECORD")
    {
        let picture = |word: &String| {
            let word = word.trim_start_matches('-').to_lowercase();
            table::answer(&word, "WORD").filter(draws)
        };
        let (typed, rest) = match line[2..].iter().find_map(picture) {
            Some(picture) => (picture.typed, &line[1..2]),
            None => (of_record.typed, &line[1..]),
        };
        return Some(answered(2, of_record.words, typed, rest));
    }
    let help = table::answer(first, "help WORD").filter(|_| line.len() == 2);
    let listed = table::answer(second, "list WORD").filter(|_| first == "list");
    let behind = table::answer(second, "WORD")
        .filter(|answer| BEFORE.contains(&first.as_str()) && (first != "plot" || draws(answer)));
    let own = table::answer(first, "WORD");
    let of_two = listed.or(behind).map(|answer| (2, 2, answer));
    let of_two = help.map(|answer| (2, 1, answer)).or(of_two);
    let (count, rest, answer) = of_two.or(own.map(|answer| (1, 1, answer)))?;
    Some(answered(count, answer.words, answer.typed, &line[rest..]))
}

/// Returns the line of a template, and what is added to it.
fn instead(template: &str, command: &str, rest: &[String]) -> Option<[Vec<String>; 2]> {
    let (before, after) = template.split_once(" *").unwrap_or((template, ""));
    let mut line: Vec<String> = before.split(' ').map(str::to_owned).collect();
    if template.contains('*') {
        line.extend_from_slice(rest);
    }
    // A file is not the folder that is written.
    let writes = line.iter().position(|word| word == "-o" || word == "--out");
    if let Some(at) = writes.filter(|_| after.contains("--out")) {
        line.drain(at..line.len().min(at + 2));
    }
    Some([line, values::typed(after, "", command)?])
}

/// Adds the flags that were not given.
pub(super) fn complete(line: &mut Vec<String>, added: &[String]) {
    for flag in added.chunk_by(|_, next| !next.starts_with("--")) {
        let says = |word: &String| {
            let word = word.split('=').next().unwrap_or_default();
            word == flag[0] || flag[0] == "--order" && ORDERS.contains(&word)
        };
        if !line.iter().any(says) {
            line.extend_from_slice(flag);
        }
    }
}
