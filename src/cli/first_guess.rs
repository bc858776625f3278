//! Commands and flags that other programs have, and what they are called here: every unknown one of a command line in
//! one error, which ends with the line that was meant where the answers determine it.

mod arguments;
mod commands;
mod values;

use crate::text::shell_word;
use arguments::{Answer, Typed};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use commands::Instead;
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
    let Some(words) = words.collect::<Option<Vec<String>>>() else {
        return vec![plain(&error.render().to_string())];
    };
    let mut meant = Meant {
        line: words,
        added: Vec::new(),
        known: true,
        gap: None,
        lines: Vec::new(),
    };
    meant.command();
    if !meant.known {
        return meant.lines;
    }
    // Every round takes an unknown word out, or ends.
    let rounds = given.len() + 8;
    for round in 0..rounds {
        // The line as it was typed is parsed already.
        let parsed = (round > 0 || !meant.lines.is_empty()).then(|| meant.parsed(all));
        let error = match &parsed {
            None => error,
            Some(Err(error)) => error,
            Some(Ok(())) => break,
        };
        match error.kind() {
            ErrorKind::UnknownArgument if meant.argument(error, all, plain) => {}
            ErrorKind::InvalidValue | ErrorKind::ValueValidation if meant.value_in_gap(error) => {}
            ErrorKind::ValueValidation
                if further_word(error).is_some() && meant.argument(error, all, plain) => {}
            ErrorKind::InvalidValue | ErrorKind::ValueValidation if meant.value(error, plain) => {}
            // A flag that was taken out is what is missing then.
            ErrorKind::MissingRequiredArgument | ErrorKind::MissingSubcommand
                if !meant.lines.is_empty() =>
            {
                meant.known = false;
                break;
            }
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => break,
            _ => {
                meant.lines.push(plain(&error.render().to_string()));
                meant.known = false;
                break;
            }
        }
    }
    meant.told(all)
}

/// Returns a word that clap takes for one more of many files, and that cannot be one.
fn further_word(error: &clap::Error) -> Option<String> {
    match (
        error.get(ContextKind::InvalidArg)?,
        error.get(ContextKind::InvalidValue)?,
    ) {
        (ContextValue::String(of), ContextValue::String(word))
            if of.starts_with("[MORE.csv]") && !word.contains(['.', '/']) =>
        {
            Some(word.clone())
        }
        _ => None,
    }
}

/// A command line on its way to the one that was meant.
struct Meant {
    /// The line without the program's name.
    line: Vec<String>,
    /// Flags of an answer to a command, added at the end unless they were given.
    added: Vec<[&'static str; 2]>,
    /// Whether the answers so far determine the line.
    known: bool,
    /// Where a word stood that was taken out: what follows it may be its value.
    gap: Option<usize>,
    /// The lines of the error.
    lines: Vec<String>,
}

impl Meant {
    fn parsed(&self, all: &clap::Command) -> Result<(), clap::Error> {
        let words = std::iter::once(PROGRAM).chain(self.line.iter().map(String::as_str));
        all.clone().try_get_matches_from(words).map(|_| ())
    }

    /// Answers a command of the table.
    fn command(&mut self) {
        let Some(answer) = commands::answer(&self.line) else {
            return;
        };
        let commands::Answer {
            given,
            words,
            instead,
        } = answer;
        self.lines
            .push(format!("unexpected command '{given}'; here: {words}"));
        match instead {
            Some(Instead { line, added }) => (self.line, self.added) = (line, added),
            None => self.known = false,
        }
    }

    /// Answers an unknown argument, and puts what was meant in its place. Returns whether it was found.
    fn argument(
        &mut self,
        error: &clap::Error,
        all: &clap::Command,
        plain: fn(&str) -> String,
    ) -> bool {
        let text = |kind: ContextKind| match error.get(kind) {
            Some(ContextValue::String(text)) => Some(text.clone()),
            _ => None,
        };
        let Some(argument) = further_word(error).or_else(|| text(ContextKind::InvalidArg)) else {
            return false;
        };
        let is = |word: &String| {
            *word == argument
                || argument.starts_with('-')
                    && word
                        .strip_prefix(&argument)
                        .is_some_and(|rest| rest.starts_with('=') || !argument.starts_with("--"))
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
        let Some(command) = all.find_subcommand(&self.line[0]) else {
            return false;
        };
        if let Some(list) = self.numbers(at).filter(|_| has(command, "--orders")) {
            self.lines.push(format!(
                "unexpected argument '{argument}'; here: --order n, or --orders {list}, in the order of the \
                 estimator's letters: na nb nc nd nf nk"
            ));
            self.put_numbers(at, &list);
            return true;
        }
        let mut answers = arguments::answers(&argument).chain(list_of_orders(&argument));
        if let Some(Answer { words, typed, .. }) = answers.find(|answer| has(command, answer.of)) {
            self.lines
                .push(format!("unexpected argument '{argument}'; here: {words}"));
            self.put(at, &argument, typed);
            return true;
        }
        let near = text(ContextKind::SuggestedArg)
            .filter(|flag| strsim::normalized_damerau_levenshtein(&argument, flag) > ALIKE);
        if let Some(near) = near {
            self.lines.push(plain(&error.render().to_string()));
            self.line[at] = self.line[at].replacen(&argument, &near, 1);
            return true;
        }
        self.lines.push(elsewhere(&argument, command, all));
        self.put(at, &argument, &Typed::Open);
        true
    }

    /// Returns the whole numbers that stand alone around a place, `2 2 1`, as a list; those of `--order` among them.
    fn numbers(&self, at: usize) -> Option<String> {
        let (first, last) = self.run(at)?;
        Some(self.line[first..=last].join(","))
    }

    /// The first and the last place of whole numbers around a place.
    fn run(&self, at: usize) -> Option<(usize, usize)> {
        let is = |at: &usize| {
            self.line
                .get(*at)
                .is_some_and(|word| word.parse::<u16>().is_ok())
        };
        let first = (0..=at).rev().take_while(is).last()?;
        let last = (at..self.line.len()).take_while(is).last()?;
        Some((first, last))
    }

    /// Replaces numbers by a list of orders, or one number by the order.
    fn put_numbers(&mut self, at: usize, list: &str) {
        let Some((first, last)) = self.run(at) else {
            return;
        };
        let flag = if list.contains(',') {
            "--orders"
        } else {
            "--order"
        };
        let before = first
            .checked_sub(1)
            .and_then(|before| self.line.get(before));
        let own = before.is_some_and(|word| ["--order", "--orders", "-n"].contains(&word.as_str()));
        let first = first - usize::from(own);
        let words = [flag.to_owned(), list.to_owned()];
        self.line.splice(first..=last, words);
        self.gap = None;
    }

    /// Takes out a wrong value that follows a flag which was taken out: it was the flag's. Returns whether there is
    /// one.
    fn value_in_gap(&mut self, error: &clap::Error) -> bool {
        let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue) else {
            return false;
        };
        let in_gap = self.gap.filter(|at| self.line.get(*at) == Some(value));
        in_gap.map(|at| self.line.remove(at)).is_some()
    }

    /// Answers a wrong value of a flag, and puts what was meant in its place. Returns whether it was found.
    fn value(&mut self, error: &clap::Error, plain: fn(&str) -> String) -> bool {
        let text = |kind: ContextKind| match error.get(kind) {
            Some(ContextValue::String(text)) => Some(text.clone()),
            _ => None,
        };
        let (Some(flag), Some(value)) = (
            text(ContextKind::InvalidArg),
            text(ContextKind::InvalidValue),
        ) else {
            return false;
        };
        let flag = flag.split(' ').next().unwrap_or_default();
        let Some(meant) = values::meant(flag, &value) else {
            return false;
        };
        let joined = format!("{flag}={value}");
        let is_joined = |word: &String| *word == joined;
        // Behind the flag, or one of its other names.
        let stands = |pair: &[String]| pair[0].starts_with('-') && pair[1] == value;
        let apart = self.line.windows(2).position(stands);
        let place = match self.line.iter().position(is_joined) {
            Some(at) => Some(at..=at),
            None => apart.map(|at| at..=at + 1),
        };
        let Some(place) = place else {
            return false;
        };
        self.lines.push(plain(&error.render().to_string()));
        self.line.splice(place, meant.split(' ').map(str::to_owned));
        true
    }

    /// Puts what is typed instead of an argument in its place.
    fn put(&mut self, at: usize, argument: &str, typed: &Typed) {
        let own = self.line[at]
            .strip_prefix(argument)
            .map(|rest| rest.trim_start_matches('='));
        let own = own.filter(|own| !own.is_empty()).map(str::to_owned);
        let is_value = |word: &&String| !word.starts_with('-') || word.parse::<f64>().is_ok();
        let next = self.line.get(at + 1).filter(is_value).cloned();
        let has_own = own.is_some();
        // A word that is no flag is its own value.
        let own = own.or_else(|| (!argument.starts_with('-')).then(|| argument.to_owned()));
        let takes = usize::from(own.is_none() && next.is_some());
        let value = own.or(next);
        let words = |template: &str, value: &str| -> Vec<String> {
            let words = template.split_whitespace();
            words.map(|word| word.replace("{}", value)).collect()
        };
        let (taken, instead) = match (typed, value) {
            (Typed::Words(template), value) if !template.contains("{}") => (
                0,
                Some(words(template, value.as_deref().unwrap_or_default())),
            ),
            (Typed::Words(template), Some(value)) => (takes, Some(words(template, &value))),
            (Typed::Of(of), Some(value)) => (
                takes,
                of(&value).map(|text| text.split(' ').map(str::to_owned).collect()),
            ),
            (Typed::Of(of), None) => {
                let text = of("");
                (
                    0,
                    text.map(|text| text.split(' ').map(str::to_owned).collect()),
                )
            }
            (Typed::Setting, Some(value)) => {
                let key = argument.trim_start_matches('-');
                (
                    takes,
                    Some(vec!["--set".to_owned(), format!("{key}={value}")]),
                )
            }
            (Typed::Nothing, _) => (takes, Some(Vec::new())),
            (Typed::Command(name), _) => {
                (*name).clone_into(&mut self.line[0]);
                (0, Some(Vec::new()))
            }
            _ => (0, None),
        };
        // What is there already need not be typed twice.
        let is_there = |words: &Vec<String>| {
            !words.is_empty() && self.line.windows(words.len()).any(|there| there == words)
        };
        let instead = instead.map(|words| if is_there(&words) { Vec::new() } else { words });
        let instead = instead.unwrap_or_else(|| {
            self.known = false;
            Vec::new()
        });
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
    fn told(mut self, all: &clap::Command) -> Vec<String> {
        // Every model needs an order.
        if self.line.first().is_some_and(|word| word == "estimate") {
            self.added.push(["--order", "2"]);
        }
        Instead::complete(&self.added, &mut self.line);
        // A study's command with a record parses, and fails.
        let fits = commands::answer(&self.line).is_none();
        if self.known && fits && self.parsed(all).is_ok() {
            let words = self.line.iter().map(shell_word);
            let words: Vec<String> = words.collect();
            self.lines
                .push(format!("try: {PROGRAM} {}", words.join(" ")));
        }
        self.lines
    }
}

/// The answer to a list of numbers that stands alone: orders in brackets.
fn list_of_orders(argument: &str) -> Option<Answer> {
    let list = argument.strip_prefix('[')?.strip_suffix(']')?;
    let mut numbers = list.split([' ', ',', ';']).filter(|word| !word.is_empty());
    numbers.all(|word| word.parse::<usize>().is_ok()).then_some(Answer {
        of: "--orders",
        words: "--orders \"[2 2 1]\", in the order of the estimator's letters: na nb nc nd nf nk",
        typed: &Typed::Words("--orders {}"),
    })
}

/// The line of an argument that is not called anything here: the commands that have it.
fn elsewhere(argument: &str, command: &clap::Command, all: &clap::Command) -> String {
    let others = all.get_subcommands().filter(|other| has(other, argument));
    let others: Vec<&str> = others.map(clap::Command::get_name).collect();
    let own = command.get_name();
    if others.is_empty() {
        return format!(
            "unexpected argument '{argument}'; {PROGRAM} {own} --help lists what there is"
        );
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
    use super::*;

    /// Every command with every word of the table: an answer names no flag that the command does not have.
    pub(in crate::cli) fn answers_fit(all: &clap::Command) {
        let mut seen = 0;
        for (name, answer) in arguments::all() {
            assert!(
                all.get_subcommands().any(|of| has(of, answer.of)),
                "{}",
                answer.of
            );
            for command in all.get_subcommands() {
                let arguments = [command.get_name(), name, "1"].map(OsString::from);
                let line = [OsString::from(PROGRAM)]
                    .into_iter()
                    .chain(arguments.clone());
                let Err(error) = all.clone().try_get_matches_from(line) else {
                    continue;
                };
                let lines = lines(&error, &arguments, all, str::to_owned);
                let here = lines.first().and_then(|line| line.split_once("here: --"));
                let Some((_, here)) = here else {
                    continue;
                };
                let flag = here.split([' ', ',', ';']).next().unwrap_or_default();
                assert!(
                    has(command, &format!("--{flag}")),
                    "{arguments:?}: {lines:?}"
                );
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}
