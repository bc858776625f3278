//! Commands and flags that other programs have, and what they are called here.

use clap::error::{ContextKind, ContextValue};

/// Subcommands.
const COMMANDS: [(&[&str], &str); 10] = [
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
        "asobench run STUDY.toml; asobench replay DIR 0:0 writes one record",
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
        "asobench estimate RECORD.csv --order 2 --report my.html has equations, poles, responses and residuals",
    ),
    (
        &["predict", "forecast", "validate-model", "goodness", "gof"],
        "asobench estimate RECORD.csv --order 2 --validate OTHER.csv, or --window N, simulates and predicts",
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
        &["init", "create", "template", "generate", "example"],
        "asobench new NAME.toml",
    ),
];

/// Flags.
const FLAGS: [(&[&str], &str); 22] = [
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
    (&["--json", "--output-format", "--as-json"], "--format json"),
    (
        &["--csv", "--save", "--export", "--tsv", "--xlsx"],
        "--format json prints all numbers of a model, --states FILE.csv its states; asobench report DIR \
         writes a table of each study as CSV",
    ),
    (
        &[
            "--train",
            "--split",
            "--test",
            "--train-size",
            "--test-size",
            "--estimation",
        ],
        "--window N leaves the samples after N for validation; --validate FILE is a second record",
    ),
    (
        &["--dry-run", "--check", "--estimate-only"],
        "asobench check STUDY.toml",
    ),
    (
        &["--confidence", "--alpha", "--level", "--ci", "--sd"],
        "intervals are of 95 %; --format json has the standard errors",
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
        "the file is the first argument: asobench estimate RECORD.csv",
    ),
    (
        &["-v", "--verbose", "-q", "--quiet", "--silent", "--debug"],
        "warnings and progress go to standard error: 2>/dev/null hides them",
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
        "--plot FILE.svg, or --report FILE.html with responses, residuals, poles and zeros",
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
        "--detrend mean subtracts the means over the window, --detrend linear straight lines",
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
        "--order 1:8 compares orders by AIC, AICc, BIC, FPE and FIT",
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
