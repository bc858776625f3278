#!/usr/bin/env python3
"""How fast `asobench throughput` computes workload W98, beside the programs that one would write instead.

Every round runs each tool once, in turn, so that what else the machine does falls on all of them; a first round warms
up and finds how many trials a peer does in the time of a round. The medians of the errors prove that the tools do the
same work: one that deviates from asobench's by more than Monte-Carlo error allows ends the comparison with exit code 1.
Exit code 2 means bad input. Needs Python's standard library only; what the peers need is installed by --setup.
"""

import argparse
import importlib.util
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import textwrap
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGET = HERE.parent.parent / "target"
VENV = TARGET / "peers-venv"
PACKAGES = ["numpy", "numba", "jax"]

# The figures that prove the same work.
FIGURES = {"e_a": "e_a", "e_b": "e_b", "e_x_max": "max e_x"}
# Allowed deviation, in standard errors of the difference: with 12 comparisons (four peers, three figures) a false alarm
# comes once in more than a thousand times.
ALLOWED = 4.0
# Columns of the table.
WIDTH = 80
# A peer whose round takes longer hangs.
TIME_LIMIT = 900


class Failed(Exception):
    """A tool that did not do its work: one line, exit code 1."""


class BadInput(Exception):
    """What was asked for cannot be done: one line, exit code 2."""


@dataclass
class Row:
    """A tool's results over the rounds."""

    name: str
    threads: int
    version: str = ""
    trials: int = 0
    failed: int = 0
    rates: list = field(default_factory=list)
    medians: dict = field(default_factory=lambda: {figure: [] for figure in FIGURES})
    errors: dict = field(default_factory=lambda: {figure: [] for figure in FIGURES})

    def rate(self):
        return statistics.median(self.rates)

    def median(self, figure):
        """The mean of the rounds' medians."""
        return statistics.fmean(self.medians[figure])

    def spread(self, figure):
        """The standard error of the median of one trial, were there one: sqrt(trials) times that of all of them."""
        error = math.hypot(*self.errors[figure]) / len(self.rates)
        return error * math.sqrt(self.trials)


class Asobench:
    """Our own program: `asobench throughput`, a row for each engine. It draws the same trials in every round."""

    def __init__(self, program, threads, trials):
        self.name = "asobench"
        self.command = [str(program), "throughput", "--format", "json", "--threads", str(threads)]
        if trials is not None:
            self.command += ["--trials", str(trials)]
        self.rows = {}

    def warm_up(self):
        self.output()

    def output(self):
        return run(self.name, self.command, None)

    def round(self, _number):
        try:
            for engine in json.loads(self.output())["engines"]:
                key = (engine["engine"], engine["threads"])
                row = self.rows.setdefault(key, Row(f"asobench {key[0]}", key[1]))
                row.trials = int(engine["trials"])
                row.rates.append(float(engine["trials_per_second"]))
                for figure in FIGURES:
                    row.medians[figure].append(float(engine[figure]))
        except (KeyError, TypeError, ValueError) as error:
            raise Failed(f"asobench's JSON is not as expected: {error!r}") from error

    def results(self):
        if not self.rows:
            raise Failed("asobench reports no engine")
        return list(self.rows.values())


class Peer:
    """A program of this folder. Its rounds have seeds, so trials, of their own."""

    def __init__(self, name, command, options, pilot, seconds):
        self.name = name
        self.command = [*command, *options]
        self.trials = pilot
        self.seconds = seconds
        self.row = None

    def line(self, seed):
        command = [*self.command, "--trials", str(self.trials), "--seed", str(seed)]
        return last_line(self.name, run(self.name, command, TIME_LIMIT))

    def warm_up(self):
        rate = self.line(0)["trials_per_second"]
        self.trials = max(self.trials, round(rate * self.seconds))

    def round(self, number):
        line = self.line(number)
        if self.row is None:
            self.row = Row(line["tool"], line["threads"], line["version"])
        self.row.trials += line["trials"]
        self.row.failed += line["failed"]
        self.row.rates.append(line["trials_per_second"])
        for figure in FIGURES:
            self.row.medians[figure].append(line[figure])
            self.row.errors[figure].append(line[f"{figure}_se"])

    def results(self):
        return [self.row]


def run(name, command, limit):
    """What the command prints."""
    environment = os.environ | {
        "OPENBLAS_NUM_THREADS": "1",
        "NUMBA_CACHE_DIR": str(TARGET / "peers-cache/numba"),
        "JAX_COMPILATION_CACHE_DIR": str(TARGET / "peers-cache/jax"),
    }
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=limit, check=False)
    except OSError as error:
        raise BadInput(f"{name}: cannot run {command[0]}: {error.strerror}") from error
    except subprocess.TimeoutExpired as error:
        raise Failed(f"{name} did not end within {limit} s") from error
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or ["it printed no reason"]
        raise Failed(f"{name} failed with exit code {done.returncode}: {said[-1]}")
    return done.stdout


def last_line(name, printed):
    """The JSON of the last line that a tool printed."""
    try:
        return json.loads(printed.strip().splitlines()[-1])
    except (IndexError, ValueError) as error:
        raise Failed(f"{name} printed no line of JSON") from error


def peers(given):
    """The peers that can run, and a line for each that cannot, with what to install."""
    python = VENV / "bin/python"
    python = str(python if python.exists() else sys.executable)
    here = Path(__file__).name
    start = ["--start", given.start]
    parallel = [*start, "--threads", str(given.threads)]
    found, skipped = [], []
    for name, script, modules, pilot in (
        ("numpy", "numpy_batched.py", ["numpy"], 2000),
        ("numba", "numba_loops.py", ["numpy", "numba"], 4000),
        ("jax", "jax_vmap.py", ["numpy", "jax"], 2000),
    ):
        if name not in given.peers:
            continue
        missing = missing_modules(python, modules)
        if missing:
            wanted = " ".join(missing)
            skipped.append(f"{name} skipped: {python} has no {wanted} ({here} --setup, or pip install {wanted})")
        else:
            found.append(Peer(name, [python, str(HERE / script)], parallel, pilot, given.seconds))
    if "octave" in given.peers:
        octave = shutil.which("octave-cli") or shutil.which("octave")
        if octave is None:
            skipped.append("octave skipped: no octave-cli on the path (apt install octave)")
        else:
            found.append(Peer("octave", [octave, str(HERE / "octave_script.m")], start, 50, given.seconds))
    return found, skipped


def missing_modules(python, modules):
    """Which of the modules that Python lacks."""
    if python == sys.executable:
        return [module for module in modules if importlib.util.find_spec(module) is None]
    ask = "import importlib.util as i, sys; print(*[m for m in sys.argv[1:] if i.find_spec(m) is None])"
    return run("python", [python, "-c", ask, *modules], TIME_LIMIT).split()


def set_up():
    """A virtual environment under target/ with what the Python peers need."""
    made = (VENV / "bin/python").exists() or subprocess.run([sys.executable, "-m", "venv", str(VENV)]).returncode == 0
    if not made:
        raise Failed(f"no virtual environment could be made in {VENV} (Debian: apt install python3-venv)")
    if subprocess.run([str(VENV / "bin/pip"), "install", "--upgrade", *PACKAGES]).returncode != 0:
        raise Failed(f"pip could not install {' '.join(PACKAGES)} into {VENV}")
    print(f"{' '.join(PACKAGES)} are in {VENV}; Octave is not a Python package: apt install octave")


class Comparison:
    """All tools against the reference: asobench's fastest engine."""

    def __init__(self, own, others):
        self.reference = max(own, key=Row.rate)
        self.rows = [*sorted(own, key=Row.rate, reverse=True), *sorted(others, key=Row.rate, reverse=True)]
        # sqrt(trials) times a median's standard error is 1 / (2 f(median)), a constant of the workload, whoever
        # computes it. Every peer estimates it; the median of them is not misled by one that does other work.
        self.spreads = {figure: statistics.median(row.spread(figure) for row in others) for figure in FIGURES}

    def ratio(self, row):
        return self.reference.rate() / row.rate()

    def error(self, row, figure):
        """The standard error of the row's median."""
        return self.spreads[figure] / math.sqrt(row.trials)

    def deviation(self, row, figure):
        """The row's median less the reference's, in standard errors of the difference of independent samples."""
        difference = row.median(figure) - self.reference.median(figure)
        return difference / math.hypot(self.error(row, figure), self.error(self.reference, figure))

    def complaint(self):
        """One line about the medians that deviate, or None. A median that is not a number deviates."""
        worst = [
            (abs(deviation), row, figure)
            for row in self.rows
            if row is not self.reference
            for figure in FIGURES
            for deviation in [self.deviation(row, figure)]
            if not abs(deviation) <= ALLOWED
        ]
        if not worst:
            return None
        size, row, figure = max(worst, key=lambda entry: math.inf if math.isnan(entry[0]) else entry[0])
        return (
            f"{row.name} (threads: {row.threads}) does other work than {self.reference.name}: the medians "
            f"{self.figure(row, figure)} and {self.figure(self.reference, figure)} of {FIGURES[figure]} differ by "
            f"{size:.1f} standard errors, {ALLOWED:g} are allowed"
            + (f" ({len(worst) - 1} other medians deviate too)" if len(worst) > 1 else "")
        )

    def figure(self, row, figure):
        return with_error(row.median(figure), self.error(row, figure))


def with_error(value, error):
    """A value with its standard error in units of the last digit, as 0.1190(8)."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return f"{value:.4g}"
    places = max(-math.floor(math.log10(error)), 0)
    if round(error * 10**places) == 10 and places > 0:
        places -= 1
    return f"{value:.{places}f}({round(error * 10**places)})"


def three_digits(number):
    """A positive number with three digits: 0.523, 41.2, 1.23k, 4.56M."""
    for unit, name in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= 0.9995 * unit:
            return three_digits(number / unit) + name
    return f"{number:.{max(2 - math.floor(math.log10(number) + 1e-3), 0)}f}"


def text(comparison, given):
    """The table, at most 80 columns wide."""
    head = ["tool", "thr", "trials/s", "min..max", "ratio", *FIGURES.values()]
    cells = [
        [
            row.name,
            str(row.threads),
            three_digits(row.rate()),
            f"{three_digits(min(row.rates))}..{three_digits(max(row.rates))}",
            three_digits(comparison.ratio(row)),
            *(comparison.figure(row, figure) for figure in FIGURES),
        ]
        for row in comparison.rows
    ]
    widths = [max(len(line[i]) for line in [head, *cells]) for i in range(len(head))]
    # Long names give way.
    widths[0] = max(min(widths[0], WIDTH - sum(widths[1:]) - len(widths[1:])), 8)

    def lay(line):
        numbers = (cell.rjust(width) for cell, width in zip(line[1:], widths[1:]))
        return " ".join([line[0][: widths[0]].ljust(widths[0]), *numbers])

    versions = ", ".join(f"{row.name} {row.version}" for row in comparison.rows if row.version)
    reference = comparison.reference.name
    return "\n".join(
        [
            f"W98: N = 98, K = 400, LS and 4 IV passes, dead-beat observer; rounds: {given.rounds}",
            textwrap.fill(f"{versions}; noise of the peers: {given.start}", WIDTH),
            "",
            lay(head),
            "-" * (sum(widths) + len(widths) - 1),
            *map(lay, cells),
            "",
            textwrap.fill(
                f"thr: threads or processes; trials/s: median of the rounds; ratio: {reference} over the tool. "
                "e_a, e_b, max e_x: medians over all trials, in parentheses the standard error of the last digit. "
                f"Allowed are {ALLOWED:g} standard errors of the difference from {reference}.",
                WIDTH,
            ),
        ]
    )


def as_json(comparison, given, skipped):
    """The same for programs."""

    def number(value):
        return value if math.isfinite(value) else None

    tools = [
        {
            "tool": row.name,
            "version": row.version or None,
            "threads": row.threads,
            "trials": row.trials,
            "failed": row.failed,
            "trials_per_second": row.rate(),
            "spread": [min(row.rates), max(row.rates)],
            "ratio": comparison.ratio(row),
            "figures": {
                figure: {
                    "median": number(row.median(figure)),
                    "standard_error": number(comparison.error(row, figure)),
                    "deviation": number(comparison.deviation(row, figure)),
                }
                for figure in FIGURES
            },
        }
        for row in comparison.rows
    ]
    whole = {
        "workload": "W98",
        "rounds": given.rounds,
        "start": given.start,
        "reference": comparison.reference.name,
        "allowed_deviation": ALLOWED,
        "same_work": comparison.complaint() is None,
        "tools": tools,
        "skipped": skipped,
    }
    return json.dumps(whole, indent=2)


def compare(given):
    """Runs the rounds and prints the comparison."""
    if shutil.which(given.asobench) is None:
        raise BadInput(f"no program {given.asobench}: build it with cargo build --release, or name one with --asobench")
    own = Asobench(given.asobench, given.threads, given.trials)
    others, skipped = peers(given)
    for line in skipped:
        print(line, file=sys.stderr)
    if not others:
        raise BadInput("none of the peers can run, so there is nothing to compare with")
    tools = [own, *others]
    for tool in tools:
        progress(f"warm-up: {tool.name}")
        tool.warm_up()
    for number in range(1, given.rounds + 1):
        for tool in tools:
            progress(f"round {number} of {given.rounds}: {tool.name}")
            tool.round(number)
    progress("")
    comparison = Comparison(own.results(), [row for peer in others for row in peer.results()])
    print(as_json(comparison, given, skipped) if given.format == "json" else text(comparison, given))
    complaint = comparison.complaint()
    if complaint is not None:
        raise Failed(complaint)


def progress(line):
    """A line that the next one overwrites, on a terminal only."""
    if sys.stderr.isatty():
        print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)


def command_line():
    cpus = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    names = ["numpy", "numba", "jax", "octave"]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--setup", action="store_true", help="only install the Python peers' packages, into target/peers-venv")
    add("--asobench", default=str(TARGET / "release/asobench"), help="our program [target/release/asobench]")
    add("--threads", type=int, default=cpus, help="threads of each tool; Octave has one [all CPUs: %(default)s]")
    add("--trials", type=int, help="trials of asobench in a round [its own default]")
    add("--seconds", type=float, default=3.0, help="time of a peer's round [%(default)s]")
    add("--rounds", type=int, default=5, help="rounds that count [%(default)s]")
    add("--peers", type=lambda given: given.split(","), default=names, help="which, with commas [all]")
    add("--start", choices=["burn-in", "stationary"], default="burn-in", help="how the peers' noise "
        "begins: 200 samples that are thrown away, or an exact draw as asobench's [%(default)s]")
    add("--format", choices=["text", "json"], default="text")
    given = parser.parse_args()
    if not 1 <= given.threads <= cpus:
        parser.error(f"--threads must be between 1 and {cpus}, the CPUs of this process")
    if given.rounds < 1 or given.trials is not None and given.trials < 1 or not given.seconds > 0:
        parser.error("--rounds, --trials and --seconds must be positive")
    unknown = [name for name in given.peers if name not in names]
    if unknown:
        parser.error(f"--peers: no peer {unknown[0]!r}; there are {', '.join(names)}")
    return given


def main():
    given = command_line()
    try:
        if given.setup:
            set_up()
        else:
            compare(given)
    except (Failed, BadInput) as error:
        progress("")
        print(f"compare.py: {error}", file=sys.stderr)
        return 1 if isinstance(error, Failed) else 2
    except KeyboardInterrupt:
        progress("")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
