//! The table of what other programs call commands and flags.

use std::sync::LazyLock;

/// The name of a word here.
pub(super) struct Answer {
    /// The words, with blanks between them.
    pub(super) names: &'static str,
    /// The flag that the command has instead, or its own name; or the place of the word.
    pub(super) of: &'static str,
    pub(super) words: &'static str,
    /// The template of what is typed instead, if the words determine it.
    pub(super) typed: Option<&'static str>,
}

pub(super) static ANSWERS: LazyLock<Vec<Answer>> = LazyLock::new(|| {
    let lines = include_str!("words.txt").lines();
    let mut names = "";
    let mut answers = Vec::new();
    for line in lines.filter(|line| !line.starts_with('#')) {
        let Some((of, answer)) = line.strip_prefix("  ").and_then(|of| of.split_once(": ")) else {
            names = line;
            continue;
        };
        let (words, typed) = match answer.split_once(" =>") {
            Some((words, typed)) => (words, Some(typed.trim_start())),
            None => (answer, None),
        };
        answers.push(Answer {
            names,
            of,
            words,
            typed,
        });
    }
    answers
});

/// Returns the answers to a word.
pub(super) fn answers(word: &str) -> impl Iterator<Item = &'static Answer> {
    let is = move |names: &str| names.split(' ').any(|name| name == word);
    ANSWERS.iter().filter(move |answer| is(answer.names))
}

/// Returns the answer to a word for one thing.
pub(super) fn answer(word: &str, of: &str) -> Option<&'static Answer> {
    answers(word).find(|answer| answer.of == of)
}
