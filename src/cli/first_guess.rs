//! Commands and flags that other programs have, and what they are called here.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Subcommands.
const COMMANDS: &[(&[&str], &str)] = &[
    (
        &["fit", "identify", "train", "est"],
        "asobench estimate RECORD.csv --order 2",
    ),
    (
        &[
            "arx", "oe", "armax", "bj", "iv4", "n4sid", "tfest", "ssest", "pem", "iv", "ls", "riv",
            "sriv", "moesp", "subspace", "ident", "sysid",
        ],
        "asobench estimate RECORD.csv --estimator NAME; asobench methods prints the names",
    ),
    (
        &[
            "simulate",
            "sim",
            "mc",
            "montecarlo",
            "monte-carlo",
            "bench",
            "benchmark",
            "start",
            "execute",
        ],
        "asobench run STUDY.toml; of its results asobench replay DIR 0:0 --data FILE.csv writes one record",
    ),
    (
        &[
            "diff", "show", "view", "open", "results", "summary", "table", "tables",
        ],
        "asobench report DIR --open, or asobench compare DIR DIR",
    ),
    (
        &[
            "bode",
            "step",
            "impulse",
            "pzmap",
            "resid",
            "residuals",
            "nyquist",
            "freqresp",
            "poles",
            "pole",
            "zpk",
            "damp",
            "tf",
            "ss",
            "autocorr",
            "acf",
        ],
        "asobench estimate RECORD.csv --order 2 --report my.html has equations, poles, responses in time and frequency \
         and residuals; no model is read from a file",
    ),
    (
        &["predict", "forecast", "validate-model", "goodness", "gof"],
        "asobench estimate RECORD.csv --order 2 --validate OTHER.csv, or --window N: FIT of the simulation and one step \
         ahead, no other horizon",
    ),
    (
        &["order", "select", "selstruc", "arxstruc", "aic", "bic"],
        "asobench estimate RECORD.csv --estimator arx --order 1:8",
    ),
    (
        &[
            "list",
            "estimators",
            "algorithms",
            "ls-methods",
            "measures",
            "models",
        ],
        "asobench methods prints the estimators, asobench explain WORD anything else",
    ),
    (
        &["validate", "lint", "verify", "dry-run", "plan-only", "info"],
        "asobench check STUDY.toml",
    ),
    (
        &["export", "latex", "tex", "to-latex", "csv", "convert"],
        "asobench report DIR writes every table of its page as tables/NAME.csv and tables/NAME.tex",
    ),
    (
        &["init", "create", "template", "generate", "example"],
        "asobench new NAME.toml",
    ),
];

/// What an argument is called here: the names, and the answers. An answer is given to a command that has the flag before
/// it, the first one if there are several.
type Answer = (
    &'static [&'static str],
    &'static [(&'static str, &'static str)],
);

/// Arguments.
const ARGUMENTS: &[Answer] = &[
    (
        &["-n", "--n", "--nx", "--model-order", "--states-number"],
        &[
            ("--order", "--order N"),
            (
                "--set",
                "--trials M is the number of trials; --set window=N of samples, --set order=n the models'",
            ),
        ],
    ),
    (
        &[
            "-o",
            "--output",
            "--output-file",
            "--outfile",
            "--save",
            "--save-as",
            "--export",
            "--csv",
            "--tsv",
            "--xlsx",
            "--dir",
            "--outdir",
            "--output-dir",
            "-d",
            "--folder",
        ],
        &[
            (
                "--validate",
                "--format json > FILE.json has all numbers of a model; --states FILE.csv, --plot FILE.svg and --report FILE.html",
            ),
            ("--out", "--out NAME"),
            ("--data", "--data FILE.csv writes the record"),
        ],
    ),
    (
        &["--pdf", "--png", "--eps", "--svg"],
        &[
            ("--zip", "--out FILE.svg or FILE.pdf"),
            ("--plot", "--plot FILE.svg or FILE.pdf"),
        ],
    ),
    (
        &[
            "--na", "--nb", "--nc", "--nd", "--nf", "--nk", "--poles", "--zeros",
        ],
        &[
            (
                "--orders",
                "--orders na=2,nb=2,nk=1, with nc, nd and nf where a method has them",
            ),
            (
                "--set",
                "--set order=n, or orders = \"na=2,nb=2,nk=1\" of a method in the file",
            ),
        ],
    ),
    (
        &[
            "--model",
            "--method",
            "-m",
            "--methods",
            "--algorithm",
            "-e",
            "--estimators",
            "--estimator",
        ],
        &[
            ("--estimator", "--estimator NAME"),
            (
                "--method",
                "--method NAME, a method of the file; a program of your own is one with a name and command = [\"python3\", \"my.py\"]",
            ),
        ],
    ),
    (
        &[
            "--jobs",
            "-j",
            "--workers",
            "--cores",
            "--n-jobs",
            "--parallel",
            "-t",
        ],
        &[("--threads", "--threads N")],
    ),
    (
        &[
            "-M",
            "--runs",
            "--repeats",
            "--mc",
            "--monte-carlo",
            "--nsim",
            "--iterations",
        ],
        &[("--trials", "--trials N")],
    ),
    (
        &["--samples", "--length", "-N", "--N", "--window"],
        &[
            ("--window", "--window N"),
            ("--set", "--set window=N"),
            ("--over", "--over window"),
        ],
    ),
    (
        &[
            "--metric",
            "--metrics",
            "--figure",
            "--measures",
            "--measure",
        ],
        &[
            ("--measure", "--measure NAME"),
            ("--set", "--set 'measures=[\"e_a\", \"e_b\"]'"),
        ],
    ),
    (
        &["--x", "--xaxis", "--x-axis", "--along"],
        &[("--over", "--over SETTING")],
    ),
    (
        &["-y", "--y", "--yaxis", "--y-axis"],
        &[
            (
                "--over",
                "--measure NAME, and --statistic rmse for another one than medians",
            ),
            ("--output", "--output NAME, by name or number"),
        ],
    ),
    (
        &["--rmse", "--mean", "--median", "--stat", "--quantile"],
        &[("--statistic", "--statistic NAME")],
    ),
    (
        &[
            "--dt",
            "--Ts",
            "--tsample",
            "--sampling-time",
            "--fs",
            "--sample-time",
            "--sampling-rate",
            "--rate",
            "--freq",
        ],
        &[("--ts", "--ts SECONDS, one over the sampling rate")],
    ),
    (
        &[
            "--delimiter",
            "--sep",
            "--separator",
            "--decimal",
            "--header",
            "--encoding",
            "--format-in",
            "--no-header",
        ],
        &[(
            "--input",
            "not needed: separators, decimal commas and headers are recognised, and --input, --output and --time choose columns",
        )],
    ),
    (
        &["-u", "--u", "--in", "--input-column", "--u-col"],
        &[("--input", "--input NAME, by name or number")],
    ),
    (
        &["--output-column", "--y-col"],
        &[("--output", "--output NAME, by name or number")],
    ),
    (
        &["--json", "--output-format", "--as-json"],
        &[("--format", "--format json")],
    ),
    (
        &[
            "--train",
            "--split",
            "--test",
            "--train-size",
            "--test-size",
            "--estimation",
            "--test-data",
        ],
        &[(
            "--validate",
            "--window N leaves the samples after N for validation; --validate FILE is a second record",
        )],
    ),
    (
        &["--horizon", "--ahead", "--steps", "--predict", "-k"],
        &[(
            "--validate",
            "--validate FILE, or --window N: FIT of the simulation and one step ahead, no other horizon",
        )],
    ),
    (
        &["--time-unit", "--unit", "--units", "--tunit"],
        &[(
            "--time",
            "the unit of times stands in the column's name, 'Time [ms]' or t_ms; or --time none --ts SECONDS",
        )],
    ),
    (
        &[
            "--resample",
            "--interpolation",
            "--decimate",
            "--resampling",
        ],
        &[(
            "--time",
            "nothing is resampled; --time none --ts SECONDS if samples were equally spaced and the column is not exact",
        )],
    ),
    (
        &["--lags", "--lag", "--maxlag", "--max-lag", "--nlags"],
        &[(
            "--validate",
            "the tests of residuals over 25 lags are always printed; --report FILE.html draws the correlations",
        )],
    ),
    (
        &[
            "--spa",
            "--etfe",
            "--frequency-response",
            "--freqresp",
            "--spectrum",
        ],
        &[(
            "--validate",
            "--report FILE.html has the frequency response of the model with intervals; there is no estimate without a model",
        )],
    ),
    (
        &[
            "--save-trials",
            "--keep-trials",
            "--save-all",
            "--raw",
            "--keep",
        ],
        &[("--store", "--store trials keeps a row for every trial")],
    ),
    (
        &["--trial", "--cell", "--index", "--case"],
        &[(
            "--data",
            "asobench replay DIR CELL:TRIAL, such as 10:17; asobench failures DIR lists trials that failed",
        )],
    ),
    (
        &["--save-states", "--state", "--observer-states"],
        &[("--states", "--states FILE.csv")],
    ),
    (
        &["--dry-run", "--check", "--estimate-only"],
        &[("--set", "asobench check STUDY.toml")],
    ),
    (
        &["--confidence", "--alpha", "--level", "--ci", "--sd"],
        &[(
            "--validate",
            "intervals are of 95 %; --format json has the standard errors",
        )],
    ),
    (
        &[
            "--file",
            "--data",
            "--record",
            "-i",
            "--csv-file",
            "--filename",
        ],
        &[
            (
                "--input",
                "the file is the first argument: asobench estimate RECORD.csv",
            ),
            (
                "--set",
                "the file is the first argument: asobench run STUDY.toml",
            ),
        ],
    ),
    (
        &[
            "--noise",
            "--snr",
            "--sigma",
            "--eta",
            "--noise-level",
            "--noise_level",
            "--std",
        ],
        &[(
            "--set",
            "--set eta=10, the noise in per cent of the output (an SNR of 20 dB), and --set noise=white, its colour; asobench explain \
             eta",
        )],
    ),
    (
        &[
            "--plant",
            "--system",
            "--systems",
            "--input",
            "--order",
            "--delay",
            "--amplitude",
            "--window",
        ],
        &[("--quick", "--set KEY=VALUE, such as --set order=2")],
    ),
    (
        &["--resume", "--continue", "--restart-from"],
        &[(
            "--quick",
            "nothing more: the same command goes on where it was stopped",
        )],
    ),
    (
        &["--quick", "--fast", "--small", "--smoke"],
        &[
            ("--paper", "--paper nikolov --trials 100"),
            ("--trials", "--trials N"),
        ],
    ),
    (
        &["paper", "nikolov", "bobtsov", "nikolov2023", "bobtsov2023"],
        &[("--paper", "--paper nikolov, bobtsov or all")],
    ),
    (
        &["-v", "--verbose", "-q", "--quiet", "--silent", "--debug"],
        &[(
            "--help",
            "warnings and progress go to standard error: 2>/dev/null hides them",
        )],
    ),
    (
        &[
            "--bode",
            "--step",
            "--impulse",
            "--residuals",
            "--resid",
            "--pzmap",
            "--poles-zeros",
            "--figures",
            "--html",
            "--show",
        ],
        &[(
            "--validate",
            "--report FILE.html with responses in time and frequency, residuals, poles and zeros; --plot FILE.svg",
        )],
    ),
    (
        &[
            "--offset",
            "--intercept",
            "--constant",
            "--const",
            "--trend",
            "--demean",
            "--center",
        ],
        &[(
            "--detrend",
            "--detrend mean subtracts the means over the window, --detrend linear straight lines",
        )],
    ),
    (
        &["--interpolate", "--fill", "--fillna", "--dropna", "--nan"],
        &[(
            "--missing",
            "--missing longest-run takes the longest part without a gap; nothing is interpolated",
        )],
    ),
    (
        &[
            "--max-order",
            "--orders-range",
            "--scan",
            "--select",
            "--criterion",
            "--aic",
            "--bic",
        ],
        &[(
            "--estimator",
            "--order 1:8 compares orders by AIC, AICc, BIC, FPE and FIT",
        )],
    ),
    (
        &["--force", "--overwrite", "-f", "--restart"],
        &[("--set", "remove the folder of results, or --out another")],
    ),
];

/// A flag is suggested if it is as like as this to what was given: "--trails" is 0.75 like "--trials".
const ALIKE: f64 = 0.6;

/// Returns what a command or an argument that is unknown is called here, as one line. `all` has every command.
pub(super) fn line(error: &clap::Error, all: &clap::Command) -> Option<String> {
    let given = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(given)) => Some(given.as_str()),
        _ => None,
    };
    if let Some(command) = given(ContextKind::InvalidSubcommand) {
        let (_, here) = COMMANDS
            .iter()
            .find(|(names, _)| names.contains(&command))?;
        return Some(format!("unexpected command '{command}'; here: {here}"));
    }
    if error.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    let argument = given(ContextKind::InvalidArg)?;
    let usage = error.render().to_string();
    let (_, usage) = usage.split_once("Usage: asobench ")?;
    let command = all.find_subcommand(usage.split_whitespace().next()?)?;
    let answers = ARGUMENTS
        .iter()
        .filter(|(names, _)| names.contains(&argument));
    let mut answers = answers.flat_map(|(_, answers)| *answers);
    if let Some((_, here)) = answers.find(|(flag, _)| has(command, flag)) {
        return Some(format!("unexpected argument '{argument}'; here: {here}"));
    }
    let others = all.get_subcommands().filter(|other| has(other, argument));
    let others: Vec<&str> = others.map(clap::Command::get_name).collect();
    let suggested = given(ContextKind::SuggestedArg);
    if suggested.is_some_and(|flag| strsim::normalized_damerau_levenshtein(argument, flag) > ALIKE)
    {
        return None;
    }
    if others.is_empty() {
        let command = command.get_name();
        return Some(format!(
            "unexpected argument '{argument}'; asobench {command} --help lists what there is"
        ));
    }
    Some(format!(
        "unexpected argument '{argument}': {} does not have it; of asobench {}",
        command.get_name(),
        others.join(", ")
    ))
}

/// Whether a command or one below it has a flag.
fn has(command: &clap::Command, flag: &str) -> bool {
    let long = |argument: &clap::Arg| argument.get_long() == flag.strip_prefix("--");
    command.get_arguments().any(long) || command.get_subcommands().any(|below| has(below, flag))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Every command with every word of the table: an answer names no flag that the command does not have.
    pub(in crate::cli) fn answers_fit(all: &clap::Command) {
        let mut seen = 0;
        for (names, answers) in ARGUMENTS {
            for (flag, _) in *answers {
                assert!(all.get_subcommands().any(|of| has(of, flag)), "{flag}");
            }
            for (command, name) in all
                .get_subcommands()
                .flat_map(|of| names.iter().map(move |name| (of, name)))
            {
                let arguments = ["asobench", command.get_name(), name, "1"];
                let Err(error) = all.clone().try_get_matches_from(arguments) else {
                    continue;
                };
                let Some(line) = line(&error, all) else {
                    continue;
                };
                let Some((_, here)) = line.split_once("here: --") else {
                    continue;
                };
                let flag = here.split([' ', ',', ';']).next().unwrap_or_default();
                assert!(has(command, &format!("--{flag}")), "{arguments:?}: {line}");
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}
