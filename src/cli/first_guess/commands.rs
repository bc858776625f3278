//! Subcommands of other programs.

use crate::estimator::EstimatorName;
use crate::names::here;

/// Subcommands: their names, what they are called here in words, and what is typed instead (empty: the words do not
/// determine it). `*` is the rest of the command line, `{}` the estimator of that name; flags after `*` are added
/// unless they were given.
const COMMANDS: &[(&str, &str, &str)] = &[
    (
        "fit identify train est ident sysid regress",
        "asobench estimate RECORD.csv --order 2",
        "estimate * --order 2",
    ),
    (
        "arx oe armax bj iv4 n4sid tfest ssest pem iv ls riv sriv srivc rivc moesp subspace ivx procest",
        "asobench estimate RECORD.csv --estimator NAME; asobench methods prints the names",
        "estimate * --estimator {} --order 2",
    ),
    (
        "simulate sim mc montecarlo monte-carlo bench benchmark start execute",
        "asobench run STUDY.toml; of its results asobench replay DIR 0:0 --data FILE.csv writes one record",
        "run *",
    ),
    (
        "diff",
        "asobench compare DIR DIR, or asobench report DIR --open",
        "compare *",
    ),
    (
        "show view open results summary table tables",
        "asobench report DIR --open, or asobench compare DIR DIR",
        "report * --open",
    ),
    (
        "bode freqresp nyquist",
        "asobench estimate RECORD.csv --order 2 --plot bode; --report my.html has equations, poles, responses in time \
         and frequency and residuals; no model is read from a file",
        "estimate * --order 2 --plot bode",
    ),
    (
        "step impulse",
        "asobench estimate RECORD.csv --order 2 --plot step; --report my.html has the rest; no model is read from a \
         file",
        "estimate * --order 2 --plot step",
    ),
    (
        "resid residuals autocorr acf whiteness",
        "asobench estimate RECORD.csv --order 2 --report my.html, or --plot residuals; the tests are always printed",
        "estimate * --order 2 --plot residuals",
    ),
    (
        "pzmap poles pole zeros zpk damp",
        "asobench estimate RECORD.csv --order 2 prints poles and zeros, --plot poles draws them; no model is read from \
         a file",
        "estimate * --order 2 --plot poles",
    ),
    (
        "tf ss",
        "asobench estimate RECORD.csv --order 2 prints the equation and the state-space form; no model is read from a \
         file",
        "estimate * --order 2",
    ),
    (
        "predict forecast validate-model goodness gof",
        "asobench estimate RECORD.csv --order 2 --validate OTHER.csv, or --window N: FIT of the simulation and one \
         step ahead, no other horizon",
        "",
    ),
    (
        "order select selstruc arxstruc aic bic select-order order-selection orders",
        "asobench estimate RECORD.csv --estimator arx --order 1:8",
        "estimate * --order 1:8",
    ),
    (
        "list estimators algorithms ls-methods measures models list-methods list-estimators",
        "asobench methods prints the estimators, asobench explain WORD anything else",
        "methods",
    ),
    (
        "validate lint verify dry-run plan-only info",
        "asobench check STUDY.toml",
        "check *",
    ),
    (
        "export latex tex to-latex csv convert",
        "asobench report DIR writes every table of its page as tables/NAME.csv and tables/NAME.tex",
        "report * --out tables",
    ),
    (
        "claims claim verdict verdicts",
        "asobench report DIR prints the verdicts on the claims of its results, --claims FILE.toml on others",
        "report *",
    ),
    (
        "init create template generate example",
        "asobench new NAME.toml",
        "new *",
    ),
    ("version", "asobench --version", ""),
    (
        "help-method doc docs describe what define",
        "asobench explain WORD",
        "explain *",
    ),
];

/// Words that may stand before one of these: `plot bode`.
const BEFORE: &str = "plot show draw view";

/// Words of pictures of a record, and what is typed for them.
const PICTURES: &[(&str, &str)] = &[
    ("bode freqresp --bode", "estimate * --order 2 --plot bode"),
    ("step impulse --step", "estimate * --order 2 --plot step"),
    (
        "residuals resid --residuals --resid",
        "estimate * --order 2 --plot residuals",
    ),
    (
        "poles pzmap zeros --poles --pzmap",
        "estimate * --order 2 --plot poles",
    ),
];

/// Commands that take results or files of studies, not records.
const OF_STUDIES: &str = "compare plot report check run replay failures";

/// What a command is called here.
pub(super) struct Answer {
    /// What was typed.
    pub(super) given: String,
    pub(super) words: &'static str,
    /// The command line instead, where it is determined.
    pub(super) instead: Option<Instead>,
}

/// A command line, and flags with values that are added to it unless they are given.
pub(super) struct Instead {
    pub(super) line: Vec<String>,
    pub(super) added: Vec<[&'static str; 2]>,
}

/// Returns what the command at the beginning of a line is called here; `None` of commands that are not in the table.
pub(super) fn answer(line: &[String]) -> Option<Answer> {
    let is = |names: &str, word: &String| names.split(' ').any(|name| name == word);
    let of = |word: &String| COMMANDS.iter().find(|(names, ..)| is(names, word));
    if let [command, record, rest @ ..] = line
        && OF_STUDIES.split(' ').any(|name| name == command)
        && record.to_lowercase().ends_with(".csv")
    {
        let named = |names: &str| rest.iter().any(|word| is(names, &word.to_lowercase()));
        let picture = PICTURES.iter().find(|(names, _)| named(names));
        let (template, rest) = match picture {
            Some((_, template)) => (*template, &line[1..2]),
            None => ("estimate * --order 2 --plot output", &line[1..]),
        };
        return Some(Answer {
            given: format!("{command} {record}"),
            words: "of a record: asobench estimate RECORD.csv --order 2 --plot output, or bode, step, poles, residuals",
            instead: instead(template, command, rest),
        });
    }
    if let [list, what, rest @ ..] = line
        && list == "list"
        && is(OF_STUDIES, what)
    {
        return Some(Answer {
            given: format!("{list} {what}"),
            words: "asobench failures DIR, asobench report DIR: a folder of results is named",
            instead: instead("failures *", what, rest).filter(|_| what == "failures"),
        });
    }
    if let [help, word] = line
        && help == "help"
    {
        return Some(Answer {
            given: format!("{help} {word}"),
            words: "asobench explain WORD, or asobench COMMAND --help",
            instead: instead("explain *", word, &line[1..]),
        });
    }
    let is_picture = |word: &String| PICTURES.iter().any(|(names, _)| is(names, word));
    let count = match line {
        [before, command, ..]
            if is(BEFORE, before)
                && of(command).is_some()
                && (before != "plot" || is_picture(command)) =>
        {
            2
        }
        [_, ..] => 1,
        [] => return None,
    };
    let command = &line[count - 1];
    let (_, words, template) = of(command)?;
    Some(Answer {
        given: line[..count].join(" "),
        words,
        instead: instead(template, command, &line[count..]),
    })
}

fn instead(template: &'static str, command: &str, rest: &[String]) -> Option<Instead> {
    let (before, after) = template.split_once(" *").unwrap_or((template, ""));
    if before.is_empty() {
        return None;
    }
    let names: Vec<&str> = EstimatorName::ALL.iter().map(|name| name.name()).collect();
    let known = names.iter().copied().find(|name| *name == command);
    let words: Vec<&'static str> = after.split_whitespace().collect();
    let mut added = Vec::new();
    let mut at = 0;
    while let Some(flag) = words.get(at) {
        let value = words.get(at + 1).filter(|word| !word.starts_with("--"));
        at += 1 + usize::from(value.is_some());
        match value {
            Some(&"{}") => added.push([*flag, known.or_else(|| here(command, &names))?]),
            value => added.push([*flag, value.copied().unwrap_or_default()]),
        }
    }
    let rest = if template.contains('*') { rest } else { &[] };
    // A file is not the folder that is written.
    let writes = rest.iter().position(|word| word == "-o" || word == "--out");
    let mut rest = rest.to_vec();
    if let Some(at) = writes.filter(|_| after.contains("--out")) {
        rest.drain(at..rest.len().min(at + 2));
    }
    let line = before.split(' ').map(str::to_owned).chain(rest);
    Some(Instead {
        line: line.collect(),
        added,
    })
}

impl Instead {
    /// Adds the flags that were not given.
    pub(super) fn complete(added: &[[&'static str; 2]], line: &mut Vec<String>) {
        // What says the orders makes --order superfluous.
        let orders = [
            "--orders", "-n", "--na", "--nb", "--nc", "--nd", "--nf", "--nk",
        ];
        for [flag, value] in added {
            let others: &[&str] = if *flag == "--order" { &orders } else { &[] };
            let says = |word: &String| {
                let word = word.split('=').next().unwrap_or_default();
                word == *flag || others.contains(&word)
            };
            if !line.iter().any(says) {
                line.push((*flag).to_owned());
                line.extend(Some((*value).to_owned()).filter(|value| !value.is_empty()));
            }
        }
    }
}
