//! Commands and flags that other programs have, and what they are called here: every unknown one of a command line in
//! one error, which ends with the line that was meant where the answers determine it.

mod commands;
mod table;
mod values;

use crate::text::shell_word;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use commands::{Answered, complete};
use std::ffi::OsString;
use std::path::Path;

/// A flag is suggested if it is as like as this to what was given: "--trails" is 0.75 like "--trials".
const ALIKE: f64 = 0.6;

/// The name of the program, the first word of a command line.
const PROGRAM: &str = "asobench";

/// Returns the lines of a usage error: one for each command or argument that is unknown, with what it is called here,
/// and the command line that was meant, where they determine one. `given` is the command line without the program's
/// name, `all` has every command, and `plain` tells other errors.
pub(super) fn lines(
    error: &clap::Error,
    given: &[OsString],
    all: &clap::Command,
    plain: fn(&str) -> String,
) -> Vec<String> {
    let words = given.iter().map(|word| word.to_str().map(str::to_owned));
    let Some(line) = words.collect::<Option<Vec<String>>>() else {
        return vec![plain(&error.render().to_string())];
    };
    let mut meant = Meant {
        line,
        added: Vec::new(),
        known: true,
        gap: None,
        lines: Vec::new(),
        all,
        plain,
    };
    meant.command();
    if !meant.known {
        return meant.lines;
    }
    // Every round takes an unknown word out, or ends.
    for _ in 0..given.len() + 8 {
        let Err(error) = meant.parsed() else { break };
        if !meant.answered(&error) {
            break;
        }
    }
    let mut told = meant.told();
    if told.is_empty() {
        told.push(plain(&error.render().to_string()));
    }
    told
}

/// A command line on its way to the one that was meant.
struct Meant<'a> {
    /// The line without the program's name.
    line: Vec<String>,
    /// Flags of an answer to a command, added at the end unless they were given.
    added: Vec<String>,
    /// Whether the answers so far determine the line.
    known: bool,
    /// Where a word stood that was taken out: what follows it may be its value.
    gap: Option<usize>,
    /// The lines of the error.
    lines: Vec<String>,
    all: &'a clap::Command,
    plain: fn(&str) -> String,
}

impl Meant<'_> {
    fn parsed(&self) -> Result<(), clap::Error> {
        let words = std::iter::once(PROGRAM).chain(self.line.iter().map(String::as_str));
        self.all.clone().try_get_matches_from(words).map(|_| ())
    }

    /// Answers a command of the table.
    fn command(&mut self) {
        let Some(Answered { given, words, instead }) = commands::answer(&self.line) else {
            return;
        };
        let line = format!("unexpected command '{given}'; here: {words}");
        self.lines.push(line);
        match instead {
            Some([line, added]) => (self.line, self.added) = (line, added),
            None => self.known = false,
        }
    }

    /// Answers an error of the line, and replaces the wrong word by the right one. Returns whether there may
    /// be more.
    fn answered(&mut self, error: &clap::Error) -> bool {
        let value = text(error, ContextKind::InvalidValue);
        let argument = text(error, ContextKind::InvalidArg);
        let is_answered = match (error.kind(), argument, value) {
            (ErrorKind::UnknownArgument, Some(argument), _) => self.argument(&argument, error),
            (ErrorKind::InvalidValue | ErrorKind::ValueValidation, Some(flag), Some(value)) => {
                self.value_in_gap(&value)
                    || is_no_file(&flag, &value) && self.argument(&value, error)
                    || self.value(&flag, &value, error)
            }
            // A flag that was taken out is what is missing then.
            (ErrorKind::MissingRequiredArgument | ErrorKind::MissingSubcommand, ..) if !self.lines.is_empty() => {
                self.known = false;
                return false;
            }
            (ErrorKind::DisplayHelp | ErrorKind::DisplayVersion, ..) => return false,
            _ => false,
        };
        if !is_answered {
            self.say(error);
            self.known = false;
        }
        is_answered
    }

    /// The line of clap's own error.
    fn say(&mut self, error: &clap::Error) {
        self.lines.push((self.plain)(&error.render().to_string()));
    }

    /// Answers an unknown argument, and puts what was meant in its place. Returns whether it was found.
    fn argument(&mut self, argument: &str, error: &clap::Error) -> bool {
        let is = |word: &String| {
            word.strip_prefix(argument).is_some_and(|rest| {
                let is_short = argument.starts_with('-') && !argument.starts_with("--");
                rest.is_empty() || is_short || argument.starts_with('-') && rest.starts_with('=')
            })
        };
        // The first word is the command.
        let found = self.line.iter().skip(1).position(is);
        let Some(at) = found.map(|at| at + 1) else {
            return false;
        };
        if self.gap == Some(at) && !argument.starts_with('-') {
            self.line.remove(at);
            return true;
        }
        let Some(command) = self.all.find_subcommand(&self.line[0]) else {
            return false;
        };
        if has(command, "--orders") && self.orders(at, argument) {
            return true;
        }
        let is_list = argument.starts_with('[') && argument.ends_with(']');
        let numbers = |list: &str| {
            list.split([' ', ',', ';'])
                .all(|n| n.is_empty() || n.parse::<usize>().is_ok())
        };
        let word = if is_list && numbers(&argument[1..argument.len() - 1]) {
            "[]"
        } else {
            argument
        };
        let mut answers = table::answers(word);
        let near = text(error, ContextKind::SuggestedArg)
            .filter(|flag| strsim::normalized_damerau_levenshtein(argument, flag) > ALIKE);
        if let Some(answer) = answers.find(|answer| has(command, answer.of)) {
            let words = answer.words;
            self.lines
                .push(format!("unexpected argument '{argument}'; here: {words}"));
            self.put(at, argument, answer.typed);
        } else if let Some(near) = near {
            self.say(error);
            self.line[at] = self.line[at].replacen(argument, &near, 1);
        } else {
            let line = elsewhere(argument, command, self.all);
            self.lines.push(line);
            self.put(at, argument, None);
        }
        true
    }

    /// Puts whole numbers that stand alone around a place, `2 2 1`, behind `--orders`, or one behind `--order`; that of
    /// `--order` is among them. Returns whether there are any.
    fn orders(&mut self, at: usize, argument: &str) -> bool {
        let is = |at: &usize| self.line.get(*at).is_some_and(|word| word.parse::<u16>().is_ok());
        let first = (0..=at).rev().take_while(is).last();
        let last = (at..self.line.len()).take_while(is).last();
        let (Some(first), Some(last)) = (first, last) else {
            return false;
        };
        let list = self.line[first..=last].join(",");
        self.lines.push(format!(
            "unexpected argument '{argument}'; here: --order n, or --orders {list}, in the order of the estimator's \
             letters: na nb nc nd nf nk"
        ));
        let own = ["--order", "--orders", "-n"].contains(&self.line[first - 1].as_str());
        let flag = if first < last { "--orders" } else { "--order" };
        self.line
            .splice(first - usize::from(own)..=last, [flag.to_owned(), list]);
        self.gap = None;
        true
    }

    /// Takes out a wrong value that follows a flag which was taken out: it was the flag's. Returns whether there is
    /// one.
    fn value_in_gap(&mut self, value: &String) -> bool {
        let in_gap = self.gap.filter(|at| self.line.get(*at) == Some(value));
        in_gap.map(|at| self.line.remove(at)).is_some()
    }

    /// Answers a wrong value of a flag, and puts what was meant in its place. Returns whether it was found.
    fn value(&mut self, flag: &str, value: &str, error: &clap::Error) -> bool {
        let flag = flag.split(' ').next().unwrap_or_default();
        let joined = format!("{flag}={value}");
        let place = match self.line.iter().position(|word| *word == joined) {
            Some(at) => Some(at..=at),
            // Behind the flag, or one of its other names.
            None => (1..self.line.len())
                .find(|at| self.line[at - 1].starts_with('-') && self.line[*at] == value)
                .map(|at| at - 1..=at),
        };
        let (Some(meant), Some(place)) = (values::meant(flag, value), place) else {
            return false;
        };
        self.say(error);
        self.line.splice(place, meant);
        true
    }

    /// Replaces an unknown argument by its counterpart here.
    fn put(&mut self, at: usize, argument: &str, typed: Option<&str>) {
        let is_value = |word: &&String| !word.starts_with('-') || word.parse::<f64>().is_ok();
        let next = self.line.get(at + 1).filter(is_value).cloned();
        // A word that is no flag is its own value.
        let own = match self.line[at].strip_prefix(argument).unwrap_or_default() {
            "" if argument.starts_with('-') => None,
            "" => Some(argument.to_owned()),
            rest => Some(rest.trim_start_matches('=').to_owned()),
        };
        let reads = typed.is_some_and(|typed| typed.contains('{'));
        let taken = usize::from(reads && own.is_none() && next.is_some());
        let has_own = own.is_some() && argument.starts_with('-');
        let value = own.or(next).unwrap_or_default();
        let instead = match typed.map(|typed| (typed, typed.strip_suffix(" *"))) {
            Some((_, Some(command))) => {
                command.clone_into(&mut self.line[0]);
                Some(Vec::new())
            }
            Some((typed, None)) => values::typed(typed, argument, &value),
            None => None,
        };
        self.known &= instead.is_some();
        let mut instead = instead.unwrap_or_default();
        // A word that is there already need not be typed twice.
        if !instead.is_empty() && self.line.windows(instead.len()).any(|there| there == instead) {
            instead.clear();
        }
        // A flag that took its value leaves none behind.
        let gap = at + instead.len();
        self.gap = (taken == 0 && !has_own).then_some(gap);
        self.line.splice(at..=at + taken, instead);
        // Where clap takes many files it takes the value for one.
        let is_left = |word: &String| !word.starts_with('-') && !Path::new(word).exists();
        if self.line[0] == "estimate" && self.line.get(gap).is_some_and(is_left) {
            self.gap.take().map(|at| self.line.remove(at));
        }
    }

    /// Returns the lines, with the command line that was meant as the last one, if it is known and right.
    fn told(mut self) -> Vec<String> {
        // Every model needs an order.
        if self.line.first().is_some_and(|word| word == "estimate") {
            self.added.extend(["--order", "2"].map(str::to_owned));
        }
        complete(&mut self.line, &self.added);
        // A study's command with a record parses, and fails.
        let fits = commands::answer(&self.line).is_none();
        if self.known && fits && self.parsed().is_ok() {
            let words: Vec<String> = self.line.iter().map(shell_word).collect();
            self.lines.push(format!("try: {PROGRAM} {}", words.join(" ")));
        }
        self.lines
    }
}

fn text(error: &clap::Error, kind: ContextKind) -> Option<String> {
    match error.get(kind)? {
        ContextValue::String(text) => Some(text.clone()),
        _ => None,
    }
}

/// Whether clap takes a word for one more of many files, which cannot be one.
fn is_no_file(of: &str, word: &str) -> bool {
    of.starts_with("[MORE.csv]") && !word.contains(['.', '/'])
}

/// The line of an argument that is not called anything here: the commands that have it.
fn elsewhere(argument: &str, command: &clap::Command, all: &clap::Command) -> String {
    let others = all.get_subcommands().filter(|other| has(other, argument));
    let others: Vec<&str> = others.map(clap::Command::get_name).collect();
    let own = command.get_name();
    if others.is_empty() {
        return format!("unexpected argument '{argument}'; {PROGRAM} {own} --help lists all arguments");
    }
    format!(
        "unexpected argument '{argument}': {own} does not have it; of {PROGRAM} {}",
        others.join(", ")
    )
}

/// Whether a command or one below it has a flag, or is named so itself.
fn has(command: &clap::Command, what: &str) -> bool {
    let Some(flag) = what.strip_prefix("--") else {
        return command.get_name() == what;
    };
    let long = |argument: &clap::Arg| argument.get_long() == Some(flag);
    command.get_arguments().any(long) || command.get_subcommands().any(|below| has(below, what))
}

#[cfg(test)]
pub(super) mod tests {
    use super::table::{ANSWERS, Answer};
    use super::*;

    /// Every command with every word of the table: an answer names no flag that the command does not have.
    pub(in crate::cli) fn answers_fit(all: &clap::Command) {
        // An indented line without ": " would be taken for one of words.
        let all_lines = include_str!("first_guess/words.txt").lines();
        assert_eq!(all_lines.filter(|line| line.starts_with(' ')).count(), ANSWERS.len());
        let mut seen = 0;
        let names = |answer: &'static Answer| answer.names.split(' ').map(move |name| (name, answer));
        let arguments = ANSWERS.iter().filter(|answer| !answer.of.contains("WORD"));
        for (name, answer) in arguments.flat_map(names) {
            assert!(all.get_subcommands().any(|of| has(of, answer.of)), "{}", answer.of);
            for command in all.get_subcommands() {
                let arguments = [command.get_name(), name, "1"].map(OsString::from);
                let line = [OsString::from(PROGRAM)].into_iter().chain(arguments.clone());
                let Err(error) = all.clone().try_get_matches_from(line) else {
                    continue;
                };
                let lines = lines(&error, &arguments, all, str::to_owned);
                let here = lines.first().and_then(|line| line.split_once("here: --"));
                let Some((_, here)) = here else {
                    continue;
                };
                let flag = here.split([' ', ',', ';']).next().unwrap_or_default();
                assert!(has(command, &format!("--{flag}")), "{arguments:?}: {lines:?}");
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}
