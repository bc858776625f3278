//! Flags of other programs, and of other commands of this one.

use super::values::{
    coefficients, noise, noise_of_snr, of_first_cell, paper, period, range, residuals, training,
    window, written,
};
use Typed::{Command, Nothing, Of, Open, Setting, Words};

/// What is typed instead of a flag.
pub(super) enum Typed {
    /// The words do not determine it.
    Open,
    /// These words; `{}` is the value.
    Words(&'static str),
    /// Nothing instead of the flag and its value.
    Nothing,
    /// What follows from the value.
    Of(fn(&str) -> Option<String>),
    /// `--set KEY=VALUE` with the flag's name as the key.
    Setting,
    /// Another command, without the flag.
    Command(&'static str),
}

/// What an argument is called here: the names, and the answers. An answer is given to a command that has the flag
/// before it, or that is named before it; the first one if there are several.
type Entry = (&'static str, &'static [(&'static str, &'static str, Typed)]);

/// Arguments.
const ARGUMENTS: &[Entry] = &[
    (
        "--failures --failed --fails --losses",
        &[
            ("report", "asobench failures DIR", Command("failures")),
            ("compare", "asobench failures DIR", Open),
            ("run", "asobench failures DIR, after the run", Open),
            ("replay", "asobench failures DIR", Open),
        ],
    ),
    (
        "--claim --claims --verdict --verdicts",
        &[
            (
                "check",
                "claims are judged from results: asobench run judges those of its file, asobench report DIR --claims \
                 FILE.toml others",
                Open,
            ),
            (
                "run",
                "claims are judged at the end of every run; asobench report DIR --claims FILE.toml judges others",
                Open,
            ),
            (
                "report",
                "--claims FILE.toml; without it those of the results are judged",
                Open,
            ),
        ],
    ),
    (
        "--system --systems --plant --plants --case --scenario",
        &[(
            "suite",
            "--only P01, by the name of a system, study or scenario; asobench suite list prints them",
            Words("--only {}"),
        )],
    ),
    (
        "--only --select",
        &[
            (
                "run",
                "--method NAME,NAME, by the names of the file's methods",
                Words("--method {}"),
            ),
            (
                "estimate",
                "--estimator NAME,NAME; asobench methods prints the names",
                Words("--estimator {}"),
            ),
        ],
    ),
    (
        "--trials --runs --records -M --repeats",
        &[(
            "suite",
            "--first R, the first trials of each scenario; --tier has 20, 50 or 1000 of them",
            Words("--first {}"),
        )],
    ),
    (
        "--quick --standard --full",
        &[("suite", "--tier quick, standard or full", Open)],
    ),
    (
        "--estimator --method --methods",
        &[(
            "suite",
            "asobench suite run --method NAME of a built-in estimator; a method of your own is an experiment file: \
             asobench suite FILE.toml",
            Open,
        )],
    ),
    (
        "--command --program",
        &[(
            "suite",
            "a file with [[methods]], a name and command = [\"python3\", \"my.py\"]: asobench suite FILE.toml",
            Open,
        )],
    ),
    (
        "--method --methods --estimator",
        &[(
            "replay",
            "all methods are printed, each under its name; asobench failures DIR --method NAME lists what failed",
            Nothing,
        )],
    ),
    (
        "--verbose -v --all --full --stages",
        &[(
            "replay",
            "--samples prints the samples of every stage too",
            Words("--samples"),
        )],
    ),
    (
        "-n --n --nx --model-order --states-number",
        &[
            ("--order", "--order N", Words("--order {}")),
            (
                "--set",
                "--trials M is the number of trials; --set window=N of samples, --set order=n the models'",
                Open,
            ),
        ],
    ),
    (
        "-o --out --output --output-file --outfile --save --save-as --export --csv --tsv --xlsx --dir --outdir \
         --output-dir -d --folder",
        &[
            (
                "--validate",
                "--format json > FILE.json has all numbers of a model; --states FILE.csv, --plot bode=FILE.svg and \
                 --report FILE.html",
                Of(written),
            ),
            ("--out", "--out NAME", Words("--out {}")),
            (
                "--data",
                "--data FILE.csv writes the record",
                Words("--data {}"),
            ),
        ],
    ),
    (
        "--pdf --png --eps --svg",
        &[
            ("--zip", "--out FILE.svg or FILE.pdf", Words("--out {}")),
            ("--plot", "--plot FILE.svg or FILE.pdf", Words("--plot {}")),
        ],
    ),
    (
        "--na --nb --nc --nd --nf --nk --poles --zeros",
        &[
            (
                "--orders",
                "--orders na=2,nb=2,nk=1, with nc, nd and nf where a method has them",
                Open,
            ),
            (
                "--set",
                "--set order=n, or orders = \"na=2,nb=2,nk=1\" of a method in the file",
                Open,
            ),
        ],
    ),
    (
        "--model --models --method -m --methods --algorithm -e --estimators --estimator",
        &[
            ("--estimator", "--estimator NAME", Words("--estimator {}")),
            (
                "--method",
                "--method NAME, a method of the file; a program of your own is one with a name and command = \
                 [\"python3\", \"my.py\"]",
                Words("--method {}"),
            ),
        ],
    ),
    (
        "--jobs -j --workers --cores --n-jobs --parallel -t",
        &[("--threads", "--threads N", Words("--threads {}"))],
    ),
    (
        "-M --runs --repeats --mc --monte-carlo --nsim --iterations",
        &[("--trials", "--trials N", Words("--trials {}"))],
    ),
    (
        "--samples --length -N --N --window",
        &[
            ("--window", "--window N", Words("--window {}")),
            ("--set", "--set window=N", Words("--set window={}")),
            ("--over", "--over window", Words("--over window")),
        ],
    ),
    (
        "--metric --metrics --figure --measures --measure",
        &[
            ("--measure", "--measure NAME", Words("--measure {}")),
            (
                "--set",
                "--set 'measures=[\"e_a\", \"e_b\"]'",
                Words("--set measures=[\"{}\"]"),
            ),
        ],
    ),
    (
        "--x --xaxis --x-axis --along",
        &[("--over", "--over SETTING", Words("--over {}"))],
    ),
    (
        "-y --y --yaxis --y-axis",
        &[
            (
                "--over",
                "--measure NAME, and --statistic rmse for another one than medians",
                Open,
            ),
            (
                "--output",
                "--output NAME, by name or number",
                Words("--output {}"),
            ),
        ],
    ),
    (
        "--rmse --mean --median --stat --quantile",
        &[("--statistic", "--statistic NAME", Open)],
    ),
    (
        "--dt --Ts --Te --tsample --sampling-time --sample-time --sampling-period",
        &[("--ts", "--ts SECONDS", Words("--ts {}"))],
    ),
    (
        "--fs --sampling-rate --sample-rate --rate --freq --sampling-frequency",
        &[(
            "--ts",
            "--ts SECONDS, one over the sampling rate",
            Of(period),
        )],
    ),
    (
        "--delimiter --sep --separator --decimal --header --encoding --format-in --no-header",
        &[(
            "--input",
            "not needed: separators, decimal commas and headers are recognised, and --input, --output and --time \
             choose columns",
            Nothing,
        )],
    ),
    (
        "-u --u --in --input-column --u-col",
        &[(
            "--input",
            "--input NAME, by name or number",
            Words("--input {}"),
        )],
    ),
    (
        "--output-column --y-col",
        &[(
            "--output",
            "--output NAME, by name or number",
            Words("--output {}"),
        )],
    ),
    (
        "--json --output-format --as-json",
        &[("--format", "--format json", Words("--format json"))],
    ),
    (
        "--test --test-size --test-data --validation-split --holdout",
        &[(
            "--validate",
            "--window 70% leaves the last 30 % of the samples for validation; --validate FILE is a second record",
            Of(window),
        )],
    ),
    (
        "--train --train-size --split --estimation",
        &[(
            "--validate",
            "--window 70% leaves the last 30 % of the samples for validation; --validate FILE is a second record",
            Of(training),
        )],
    ),
    (
        "--x0 --initial-conditions --initialcondition --InitialCondition --ic0",
        &[(
            "--initial",
            "--initial zero or estimate",
            Words("--initial {}"),
        )],
    ),
    (
        "--horizon --ahead --steps --predict -k",
        &[(
            "--validate",
            "--validate FILE, or --window N: FIT of the simulation and one step ahead, no other horizon",
            Open,
        )],
    ),
    (
        "--time-unit --unit --units --tunit",
        &[(
            "--time",
            "the unit of times stands in the column's name, 'Time [ms]' or t_ms; or --time none --ts SECONDS",
            Open,
        )],
    ),
    (
        "--resample --interpolation --decimate --resampling",
        &[(
            "--time",
            "nothing is resampled; --time none --ts SECONDS if samples were equally spaced and the column is not exact",
            Open,
        )],
    ),
    (
        "--lags --lag --nlags",
        &[(
            "--validate",
            "the tests of residuals over 25 lags are always printed; --report FILE.html draws the correlations",
            Nothing,
        )],
    ),
    (
        "--spa --etfe --frequency-response --freqresp --spectrum",
        &[(
            "--validate",
            "--report FILE.html has the frequency response of the model with intervals; there is no estimate without a \
             model",
            Open,
        )],
    ),
    (
        "--save-trials --keep-trials --save-all --raw --keep",
        &[(
            "--store",
            "--store trials keeps a row for every trial",
            Words("--store trials"),
        )],
    ),
    (
        "--trial",
        &[(
            "--data",
            "asobench replay DIR CELL:TRIAL, such as 10:17; asobench failures DIR lists trials that failed",
            Of(of_first_cell),
        )],
    ),
    (
        "--cell --index --case",
        &[(
            "--data",
            "asobench replay DIR CELL:TRIAL, such as 10:17; asobench failures DIR lists trials that failed",
            Open,
        )],
    ),
    (
        "--skip-rows --skiprows --header-lines --headerlines --skip-header",
        &[(
            "--skip",
            "not needed: names, a row of units below them and lines with # are recognised; --skip N leaves the first N \
             samples out",
            Nothing,
        )],
    ),
    (
        "--save-states --state --observer-states",
        &[("--states", "--states FILE.csv", Words("--states {}"))],
    ),
    (
        "--dry-run --check --estimate-only",
        &[("--set", "asobench check STUDY.toml", Command("check"))],
    ),
    (
        "--confidence --alpha --level --ci --sd",
        &[(
            "--validate",
            "intervals are of 95 %; --format json has the standard errors",
            Nothing,
        )],
    ),
    (
        "--file --data --record -i --csv-file --filename",
        &[
            (
                "--input",
                "the file is the first argument: asobench estimate RECORD.csv",
                Words("{}"),
            ),
            (
                "--set",
                "the file is the first argument: asobench run STUDY.toml",
                Words("{}"),
            ),
        ],
    ),
    (
        "--snr --snr-db --snr_db --SNR",
        &[(
            "--set",
            "--set eta=100/10^(s/20) of s dB, the noise in per cent of the output; asobench explain eta",
            Of(noise_of_snr),
        )],
    ),
    (
        "--eta --noise-level --noise_level",
        &[(
            "--set",
            "--set eta=10, the noise in per cent of the output (an SNR of 20 dB)",
            Words("--set eta={}"),
        )],
    ),
    (
        "--sigma --std --noise",
        &[(
            "--set",
            "--set eta=10, the noise in per cent of the output (an SNR of 20 dB), and --set noise=white, its colour; \
             asobench explain eta",
            Of(noise),
        )],
    ),
    (
        "--plant --system --systems",
        &[(
            "--quick",
            "--set KEY=VALUE, such as --set order=2",
            Words("--set plant={}"),
        )],
    ),
    (
        "--input --order --delay --amplitude --window --horizon",
        &[("--quick", "--set KEY=VALUE, such as --set order=2", Setting)],
    ),
    (
        "--resume --continue --restart-from",
        &[(
            "--quick",
            "nothing more: the same command goes on where it was stopped",
            Words(""),
        )],
    ),
    (
        "--quick --fast --small --smoke",
        &[
            (
                "--paper",
                "--paper nikolov --trials 100",
                Words("--paper nikolov --trials 100"),
            ),
            ("--trials", "--trials N", Open),
        ],
    ),
    (
        "paper nikolov bobtsov nikolov2023 bobtsov2023",
        &[("--paper", "--paper nikolov, bobtsov or all", Of(paper))],
    ),
    (
        "-v --verbose -q --quiet --silent --debug",
        &[(
            "--help",
            "warnings and progress go to standard error: 2>/dev/null hides them",
            Words(""),
        )],
    ),
    (
        "--bode --freqresp --nyquist",
        &[(
            "--validate",
            "--plot bode; --report FILE.html has responses, residuals, poles and zeros",
            Words("--plot bode"),
        )],
    ),
    (
        "--step --impulse",
        &[(
            "--validate",
            "--plot step; --report FILE.html has responses in time and frequency",
            Words("--plot step"),
        )],
    ),
    (
        "--residuals --resid --residual",
        &[(
            "--validate",
            "--plot residuals of the last estimator; the tests of residuals are always printed, --report FILE.html \
             draws the correlations; residuals are not written as numbers",
            Of(residuals),
        )],
    ),
    (
        "--pzmap --poles-zeros --pole-zero",
        &[(
            "--validate",
            "--plot poles of the last estimator; poles and zeros are always printed",
            Words("--plot poles"),
        )],
    ),
    (
        "--figures --html --show --page",
        &[(
            "--validate",
            "--report FILE.html with responses in time and frequency, residuals, poles and zeros; --plot FILE.svg",
            Words("--report page.html"),
        )],
    ),
    (
        "--compare",
        &[(
            "--validate",
            "FIT is always printed; --validate FILE.csv or --window N for that of samples which the models have not \
             seen",
            Words(""),
        )],
    ),
    (
        "--offset --intercept --constant --const --trend --demean --center",
        &[(
            "--detrend",
            "--detrend mean subtracts the means over the window, --detrend linear straight lines",
            Words("--detrend mean"),
        )],
    ),
    (
        "--interpolate --fill --fillna --dropna --nan",
        &[(
            "--missing",
            "--missing longest-run takes the longest part without a gap; nothing is interpolated",
            Words("--missing longest-run"),
        )],
    ),
    (
        "--max-order --maxorder --maxlag --max-lag --nmax --max-n --max",
        &[(
            "--estimator",
            "--order 1:8 compares orders by AIC, AICc, BIC, FPE and FIT",
            Words("--order 1:{}"),
        )],
    ),
    (
        "--orders-range --order-range --scan",
        &[(
            "--estimator",
            "--order 1:8 compares orders by AIC, AICc, BIC, FPE and FIT",
            Of(range),
        )],
    ),
    (
        "--select --criterion --ic --aic --bic",
        &[(
            "--estimator",
            "--order 1:8 compares orders by AIC, AICc, BIC, FPE and FIT",
            Nothing,
        )],
    ),
    (
        "--np --num-poles",
        &[("--nf", "--nf N, the number of poles", Words("--nf {}"))],
    ),
    (
        "--nz --num-zeros",
        &[(
            "--nf",
            "--nb N, one more than the number of zeros",
            Of(coefficients),
        )],
    ),
    (
        "--list --all",
        &[("methods", "without a flag all are printed", Words(""))],
    ),
    (
        "--maxdelay --max-delay",
        &[(
            "--delay",
            "--delay 1:3 beside --order 1:4",
            Words("--delay 1:{}"),
        )],
    ),
    (
        "--force --overwrite -f --restart",
        &[(
            "--set",
            "remove the folder of results, or --out another",
            Open,
        )],
    ),
];

/// An answer to an argument.
pub(super) struct Answer {
    /// What the command has instead: a flag, or its own name.
    pub(super) of: &'static str,
    pub(super) words: &'static str,
    pub(super) typed: &'static Typed,
}

/// Returns the answers to an argument, the first one that fits the command is meant.
pub(super) fn answers(argument: &str) -> impl Iterator<Item = Answer> {
    let is = move |names: &&'static str| names.split(' ').any(|name| name == argument);
    let entries = ARGUMENTS.iter().filter(move |(names, _)| is(names));
    entries.flat_map(|(_, answers)| {
        let answers = answers.iter();
        answers.map(|(of, words, typed)| Answer { of, words, typed })
    })
}

/// All names with their answers.
#[cfg(test)]
pub(super) fn all() -> impl Iterator<Item = (&'static str, Answer)> {
    let entries = ARGUMENTS.iter();
    entries.flat_map(|(names, _)| {
        names
            .split(' ')
            .flat_map(|name| answers(name).map(move |answer| (name, answer)))
    })
}
