"""Studies by the program, their results as frames, records as arrays."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
from pathlib import Path

import numpy as np


def _program():
    """The program beside this Python, or on the path."""
    beside = Path(sysconfig.get_path("scripts")) / "asobench"
    found = os.environ.get("ASOBENCH") or (str(beside) if beside.exists() else shutil.which("asobench"))
    if not found:
        raise FileNotFoundError("the program asobench: expected it on the path, or its name in ASOBENCH")
    return found


def _call(*arguments):
    done = subprocess.run([_program(), *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"exit {done.returncode}")
    return done.stdout


class Results:
    """Results in a folder."""

    def __init__(self, folder, text=""):
        self.folder = Path(folder)
        self.text = text

    @property
    def summary(self):
        """summary.json as it is."""
        return json.loads((self.folder / "summary.json").read_text())

    def frame(self):
        """The summary as a polars frame: a row for each cell, output and measure."""
        return _polars().read_parquet(self.folder / "summary.parquet")

    def trials(self):
        """Every trial as a polars frame, of a study with store = "trials"."""
        return _polars().read_parquet(self.folder / "trials.parquet")

    def report(self):
        """Writes report.html; gives its path."""
        _call("report", self.folder)
        return self.folder / "report.html"

    def __repr__(self):
        return self.text or f"Results({str(self.folder)!r})"


def _polars():
    try:
        import polars
    except ImportError as error:
        raise ImportError('results as frames need polars: pip install "asobench[frames]"') from error
    return polars


@contextlib.contextmanager
def _file(study, folder="."):
    """The path of a study: of a dict a file in a folder, where its programs run and relative paths begin."""
    if isinstance(study, (str, os.PathLike)):
        yield Path(study)
        return
    with tempfile.NamedTemporaryFile("w", prefix=".asobench-", suffix=".toml", dir=folder) as file:
        file.write(toml(study))
        file.flush()
        yield Path(file.name)


def run(study, folder=None, *, trials=None, threads=None, allow_commands=False):
    """Runs a study: an experiment file, or a dict of the same keys, whose results need a folder. Programs that are its
    methods run only with ``allow_commands``."""
    if folder is None and isinstance(study, dict):
        raise TypeError("folder: expected where the results of a dict go")
    with _file(study) as path:
        folder = folder or Path("results") / path.stem
        arguments = ["run", path, "--out", folder]
        arguments += [] if trials is None else ["--trials", trials]
        arguments += [] if threads is None else ["--threads", threads]
        arguments += ["--allow-commands"] if allow_commands else []
        text = _call(*arguments)
    return Results(folder, text)


# What of a study its records follow from.
DATA = ("seed", "settings", "zip", "exclude", "plants", "noises", "feedbacks", "columns")


def simulate(study, cell=0, trials=100):
    """The records of a cell as methods see them: a dict of "trial", the numbers of the trials, and of "u", "y" and "r", a
    row of N samples for each of these. A trial whose record cannot be drawn is not among them."""
    folder = "."
    if not isinstance(study, dict):
        folder = Path(study).parent
        study = tomllib.loads(Path(study).read_text())
    data = {key: study[key] for key in DATA if key in study}
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)

        def results(data, method, trials):
            out = place / f"results-{method['name']}"
            with _file({**data, "measures": ["e_a"], "methods": [method]}, folder) as path:
                return run(path, out, trials=trials, threads=1, allow_commands=True)

        # The cells of the grid, as the program numbers them; then the one that is asked for, alone.
        cells = results(data, {"name": "cells", "estimator": "ls"}, 1).summary["cells"]
        if not 0 <= cell < len(cells):
            raise IndexError(f"cell {cell}: expected 0 to {len(cells) - 1}")
        known = cells[cell]["settings"]
        settings = {key: known[key] if isinstance(value, (list, tuple, np.ndarray)) else value
                    for key, value in data.get("settings", {}).items()}
        alone = {key: data[key] for key in data if key not in ("zip", "exclude")} | {"settings": settings}
        records = place / "records.npz"
        package = str(Path(__file__).parent.parent)
        start = f"import sys; sys.path.insert(0, {package!r}); import asobench._capture"
        command = [sys.executable, "-c", start, str(records), str(trials)]
        results(alone, {"name": "records", "command": command, "batch": max(1, min(trials, 65536))}, trials)
        if not records.exists():
            raise ValueError(f"cell {cell}: no record of its first {trials} trials can be drawn")
        return dict(np.load(records))


def toml(value):
    """A dict as TOML: tables and lists inline, which TOML allows below the first level."""
    return "".join(f"{_key(key)} = {_inline(item)}\n" for key, item in value.items())


def _key(key):
    return json.dumps(str(key))


def _inline(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_inline(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, np.generic):
        return repr(value.item())
    return json.dumps(value, ensure_ascii=False)


def main():
    """``python -m asobench``: the program itself."""
    os.execv(_program(), [_program(), *sys.argv[1:]])
