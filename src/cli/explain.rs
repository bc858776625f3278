//! `asobench explain`: what a key, measure, method, failure or word means, from where the pages have it.

use super::error::Error;
use super::groups;
use super::methods::{described, filled};
use super::output::print;
use crate::claim::Verdict;
use crate::estimator::{EstimatorName, FailureKind};
use crate::metric::Statistic;
use crate::names::{UnknownName, here};
use crate::study::Measure;
use crate::study::file::{Key, schema};
use crate::text::folded;
use serde_json::Value;

/// Explain words: a key of experiment files, a setting, a measure, a method, a failure, a flag or a word of
/// the glossary
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The words, such as eta, e_a, oe, boundary or "noise colour"
    #[arg(required = true, value_name = "WORD")]
    words: Vec<String>,
}

pub(super) fn run(arguments: &Arguments, commands: &clap::Command) -> Result<(), Error> {
    let mut all = entries();
    all.extend(flags(commands));
    let mut texts: Vec<String> = Vec::new();
    for word in &arguments.words {
        let words: Vec<&str> = all.iter().map(|entry| entry.word.as_str()).collect();
        let meanings = |is: &dyn Fn(&str) -> bool| -> Vec<String> {
            let found = all.iter().filter(|entry| is(&entry.word));
            found.map(|entry| entry.text.clone()).collect()
        };
        let of_elsewhere = || here(word, &words).map(|here| meanings(&|other| other == here));
        let kind_left_out = || {
            let (first, kind) = word.rsplit_once([' ', '-'])?;
            ["model", "method", "estimator", "criterion"]
                .contains(&kind)
                .then(|| meanings(&|other| loose(other) == loose(first)))
        };
        let ways: [&dyn Fn() -> Option<Vec<String>>; 5] = [
            &|| Some(meanings(&|other| folded(other) == folded(word))),
            &of_elsewhere,
            &|| numbered(word).map(|text| vec![text]),
            &|| Some(meanings(&|other| loose(other) == loose(word))),
            &kind_left_out,
        ];
        let found = ways.iter().find_map(|way| way().filter(|found| !found.is_empty()));
        texts.extend(found.ok_or_else(|| Error::Input(unknown(word, &all)))?);
    }
    print(&texts.join("\n"))
}

/// A word without case, blanks, hyphens and the end of a plural: "dead beat" is "Dead-Beat".
fn loose(word: &str) -> String {
    let joined: String = folded(word).chars().filter(|c| c.is_alphanumeric()).collect();
    match joined.strip_suffix('s') {
        Some(one) if one.len() > 2 => one.to_owned(),
        _ => joined,
    }
}

/// The meaning of a letter with a number: `a_3`.
fn numbered(word: &str) -> Option<String> {
    let (letter, number) = word.split_once('_')?;
    let number: usize = number.parse().ok()?;
    let polynomial = |name: &str, lag: &str| format!("the coefficient of q^-{number} in {name}, {lag}");
    let monic = format!("the one of lag {number}");
    let state = |what: &str| format!("; in studies and claims element {number} of {what}");
    let about = match letter.to_lowercase().as_str() {
        "a" => polynomial("A(q) = 1 + a_1 q^-1 + ...", &monic) + &state("a, the last row of A: a_i = -alpha_(n+1-i)"),
        "b" => polynomial("B(q) = b_nk q^-nk + ...", &monic) + &state("b, the input vector"),
        "c" => polynomial("C(q) = 1 + c_1 q^-1 + ... of the noise C/D e", &monic),
        "d" => polynomial("D(q) = 1 + d_1 q^-1 + ... of the noise C/D e", &monic),
        "f" => polynomial("F(q) = 1 + f_1 q^-1 + ... of the plant B/F", &monic),
        "h" => format!("element {number} of h, the coefficients of B(q) after its delay"),
        "x" => format!("state {number}; x_1 is the output"),
        "alpha" => polynomial("A(q) = 1 + alpha_1 q^-1 + ...", &monic),
        "beta" => format!("element {number} of beta, the coefficients of B(q)"),
        _ => return None,
    };
    Some(filled(
        &format!("{word} (symbol): "),
        &format!("{about} (docs/conventions.md)"),
        2,
    ))
}

/// One meaning of a word.
struct Entry {
    word: String,
    text: String,
}

impl Entry {
    fn new(word: &str, kind: &str, about: &str) -> Self {
        Self {
            word: word.to_owned(),
            text: filled(&format!("{word} ({kind}): "), about, 2),
        }
    }
}

/// Every meaning of every word: what files can say, then the failures, then the glossary.
fn entries() -> Vec<Entry> {
    let mut all: Vec<Entry> = EstimatorName::ALL
        .iter()
        .map(|name| Entry {
            word: name.name().to_owned(),
            text: described(*name),
        })
        .collect();
    let mut add = |word: &str, kind: &str, about: &str| all.push(Entry::new(word, kind, about));
    for key in Key::ALL {
        let default = key.default().map(|value| format!(" Default: {value}."));
        let about = key.about().trim_end_matches('.');
        add(
            key.name(),
            "setting",
            &format!("{about}.{}", default.unwrap_or_default()),
        );
    }
    for measure in Measure::ALL {
        let kind = match measure.entry().unit {
            "" => "measure".to_owned(),
            unit => format!("measure, in {unit}"),
        };
        add(measure.name(), &kind, measure.about());
    }
    for statistic in Statistic::ALL {
        add(
            statistic.name(),
            "statistic of a measure over trials",
            statistic.about(),
        );
    }
    for estimator in EstimatorName::ALL {
        for option in estimator.options() {
            add(&option.key, &format!("option of {estimator}"), &option.about);
        }
    }
    let schema = schema();
    all.extend(keys(&schema["properties"], "key of an experiment file"));
    for (table, of) in schema["$defs"].as_object().into_iter().flatten() {
        // A table that a user does not write has no description of its own.
        let table = table.trim_end_matches("Table").to_lowercase();
        all.extend(keys(&of["properties"], &format!("key of a table of kind '{table}'")));
    }
    for kind in FailureKind::ALL.iter().chain(FailureKind::OF_PROGRAMS) {
        all.push(Entry::new(kind.name(), "failure or status", kind.about()));
    }
    all.extend(glossary());
    let verdict = all.iter().find(|entry| entry.word == "verdict");
    let about = verdict.map_or_else(String::new, |entry| entry.text.clone());
    let verdicts = Verdict::ALL.iter().map(|verdict| Entry {
        word: verdict.name().to_owned(),
        text: about.clone(),
    });
    all.extend(verdicts.collect::<Vec<_>>());
    all
}

/// The flags of all commands; those with the same meaning as one.
fn flags(commands: &clap::Command) -> Vec<Entry> {
    let mut all: Vec<((&str, String), Vec<&str>)> = Vec::new();
    for command in commands.get_subcommands() {
        for argument in command.get_arguments() {
            let about = argument.get_long_help().or(argument.get_help());
            let (Some(flag), Some(about)) = (argument.get_long(), about) else {
                continue;
            };
            let about = about.to_string().replace("\n\n", ". ");
            groups::add(&mut all, (flag, about), command.get_name());
        }
    }
    let entries = all.iter().filter(|((flag, _), _)| *flag != "help");
    entries
        .map(|((flag, about), commands)| Entry::new(flag, &format!("flag of {}", commands.join(", ")), about))
        .collect()
}

fn keys(properties: &Value, kind: &str) -> Vec<Entry> {
    let keys = properties.as_object().into_iter().flatten();
    let about = |of: &Value| of["description"].as_str().unwrap_or_default().to_owned();
    keys.map(|(key, of)| Entry::new(key, kind, &about(of)))
        .filter(|entry| !entry.text.trim_end().ends_with(':'))
        .collect()
}

/// The words of docs/glossary.md. A line has one or several, which share a meaning: "**e_a, e_b**: ...".
fn glossary() -> Vec<Entry> {
    let lines = include_str!("../../docs/glossary.md").lines();
    let lines = lines.filter_map(|line| line.strip_prefix("- ")?.split_once("**")?.1.split_once("**: "));
    let entries = lines.flat_map(|(words, meaning)| {
        let meaning = without_links(meaning);
        let entry = move |word: &str| Entry::new(word.trim(), "glossary", &meaning);
        words.split(',').map(entry).collect::<Vec<_>>()
    });
    entries.collect()
}

/// Turns `[text](target)` into its text.
fn without_links(markdown: &str) -> String {
    let mut plain = String::new();
    let mut rest = markdown;
    while let Some((before, link)) = rest.split_once('[') {
        plain.push_str(before);
        let parts = link
            .split_once(']')
            .and_then(|(text, after)| Some((text, after.strip_prefix('(')?.split_once(')')?.1)));
        let (text, after) = parts.unwrap_or(("[", link));
        plain.push_str(text);
        rest = after;
    }
    plain + rest
}

/// The error for a word without a meaning here: the words whose meaning has it, or the nearest one.
fn unknown(word: &str, all: &[Entry]) -> String {
    let mut having: Vec<&str> = Vec::new();
    for entry in all {
        let text = folded(&entry.text);
        if word.len() > 3 && text.contains(&folded(word)) && !having.contains(&entry.word.as_str()) {
            having.push(&entry.word);
        }
    }
    if !having.is_empty() {
        let listed = having[..having.len().min(5)].join("', '");
        return format!("unknown word '{word}'; the texts of these have it: '{listed}'");
    }
    let error = UnknownName::new("word", word, all.iter().map(|entry| &entry.word)).to_string();
    let nearest = error.split("; expected").next().unwrap_or_default();
    format!("{nearest}; expected a key, a measure, a method, a failure, a flag or a word of docs/glossary.md")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_become_their_text() {
        assert_eq!(
            without_links("a [cell](#cell) of [x] and ([m.md](m.md))."),
            "a cell of [x] and (m.md)."
        );
    }

    #[test]
    fn spelling_does_not_matter() {
        for [written, other] in [
            ["dead beat", "Dead-Beat"],
            ["instrumental variable", "instrumental variables"],
            ["PRBS", "prbs"],
            ["Monte Carlo", "monte-carlo"],
        ] {
            assert_eq!(loose(written), loose(other));
        }
        assert_ne!(loose("a"), loose("as"));
    }

    #[test]
    fn every_word_has_a_meaning() {
        for entry in entries() {
            assert!(entry.text.len() > entry.word.len() + 10, "{}", entry.text);
            assert!(!entry.text.contains("]("), "{}", entry.text);
        }
    }
}
