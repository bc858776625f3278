//! Commands and flags that other programs have, and what they are called here.

use clap::error::{ContextKind, ContextValue};

/// Subcommands.
const COMMANDS: [(&[&str], &str); 4] = [
    (
        &["fit", "identify", "train", "est"],
        "asobench estimate RECORD.csv --order 2",
    ),
    (
        &[
            "arx", "oe", "armax", "bj", "iv4", "n4sid", "tfest", "ssest", "pem", "iv", "ls", "riv",
            "sriv",
        ],
        "asobench estimate RECORD.csv --estimator NAME; asobench methods prints the names",
    ),
    (
        &["simulate", "sim", "mc", "montecarlo", "bench", "start"],
        "asobench run STUDY.toml; asobench replay DIR 0:0 writes one record",
    ),
    (
        &["diff", "show", "view", "open", "results"],
        "asobench report DIR --open, or asobench compare DIR DIR",
    ),
];

/// Flags.
const FLAGS: [(&[&str], &str); 12] = [
    (&["-n", "--n", "--nx", "-o", "--model-order"], "--order N"),
    (
        &[
            "--na", "--nb", "--nc", "--nd", "--nf", "--nk", "--poles", "--zeros",
        ],
        "--orders na=2,nb=2,nk=1, with nc, nd and nf where a method has them",
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
        ],
        "--estimator NAME",
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
        "--threads N",
    ),
    (
        &[
            "-M",
            "--runs",
            "--repeats",
            "--mc",
            "--monte-carlo",
            "--nsim",
            "--samples",
            "--iterations",
        ],
        "--trials N",
    ),
    (
        &["--metric", "--metrics", "--figure", "--measures"],
        "--measure NAME",
    ),
    (
        &["--dt", "--Ts", "--sampling-time", "--fs", "--sample-time"],
        "--ts SECONDS",
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
        "not needed: separators, decimal commas and headers are recognised, and --input, --output and --time choose columns",
    ),
    (
        &["-u", "--u", "--in", "--input-column", "--u-col"],
        "--input NAME, by name or number",
    ),
    (
        &["-y", "--y", "--output-column", "--y-col"],
        "--output NAME, by name or number",
    ),
    (
        &["--dir", "--outdir", "--output-dir", "-d", "--folder"],
        "--out DIR",
    ),
    (
        &["--force", "--overwrite", "-f", "--restart"],
        "remove the folder of results, or --out another",
    ),
];

/// Returns what a command or a flag that is unknown is called here, as one line.
pub(super) fn line(error: &clap::Error) -> Option<String> {
    let given = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(given)) => Some(given.as_str()),
        _ => None,
    };
    let (what, given, all): (_, _, &[(&[&str], &str)]) = match given(ContextKind::InvalidSubcommand)
    {
        Some(command) => ("command", command, &COMMANDS),
        None => ("argument", given(ContextKind::InvalidArg)?, &FLAGS),
    };
    let (_, here) = all.iter().find(|(names, _)| names.contains(&given))?;
    Some(format!("unexpected {what} '{given}'; here: {here}"))
}
