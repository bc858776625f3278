"""Results in a folder: as frames, verdicts, single trials and pictures."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._errors import StudyError
from ._frames import frame, frames
from ._method import Method, Relay, consent
from ._program import call

#: The figures of a measure, in the order of columns.
FIGURES = ("mean", "sd", "rmse", "trimmed", "q05", "q25", "q50", "q75", "q95")


class Verdict(NamedTuple):
    """The verdict on a claim."""

    id: str
    verdict: str
    """Such as "holds", "does not hold", "undecided"."""
    text: str
    """The claim."""
    line: str
    """The verdict with its numbers, in a sentence."""
    numbers: list[dict[str, str]]
    """Every number behind it, with the cells where it stands: the rows of the report's tables/claims.csv."""


class Replay:
    """A trial computed again.

    Attributes
    ----------
    u, y : ndarray
        The record, all samples.
    truth : dict
        The true values, as arrays.
    stages : list of dict
        Every stage of every method, with lists of numbers as arrays.
    """

    def __init__(self, raw: dict[str, Any]) -> None:
        self.raw, self.trial = raw, raw["trial"]
        self.stages = [_arrays(stage) for stage in raw["stages"]]
        data = self.stages[0]
        self.u, self.y = data["u"], data["y"]
        self.truth = {key: value for key, value in data.items() if key not in ("stage", "u", "y")}

    def __repr__(self) -> str:
        return f"Replay(trial {self.trial}, {len(self.y)} samples, {len(self.stages)} stages)"


class Picture:
    """A picture that the program drew; a notebook shows it."""

    def __init__(self, svg: str) -> None:
        self.svg = svg

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the SVG."""
        Path(path).write_text(self.svg, encoding="utf-8")
        return Path(path)

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"Picture({len(self.svg)} bytes of SVG)"


class Results:
    """Results in a folder, as a run left them.

    Cells are chosen by their settings: ``results.frame(eta=10)``. Nothing is computed that is not asked for.

    Parameters
    ----------
    folder : path
    methods : list of Method
        The functions among the methods, which a replay calls.
    """

    def __init__(self, folder: str | os.PathLike[str], text: str = "", methods: Sequence[Method] = ()) -> None:
        self.folder, self.text, self.methods = Path(folder), text, list(methods)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """summary.json as it is."""
        text = self._read("summary.json")
        self._check()
        summary: dict[str, Any] = json.loads(text)
        return summary

    def _check(self) -> None:
        """Raises an error that names a file which is not what the program wrote."""
        call("check", self.folder)

    def _places(self, name: str) -> list[Path]:
        """Where a file may be: one that is on its way to replace another counts first."""
        return [self.folder / ".asobench-whole" / name, self.folder / name]

    def _read(self, name: str) -> str:
        for path in self._places(name):
            with contextlib.suppress(FileNotFoundError):
                return path.read_text(encoding="utf-8")
        try:
            # The program knows whether a run has begun.
            call("failures", self.folder)
        except StudyError as error:
            raise FileNotFoundError(str(error)) from None
        raise FileNotFoundError(f"{self.folder / name}: expected a file of the results")

    @cached_property
    def axes(self) -> list[str]:
        """The settings that differ between cells."""
        settings = [cell["settings"] for cell in self.summary["cells"]]
        return [key for key in settings[0] if any(of.get(key) != settings[0][key] for of in settings)]

    def cells(self, **settings: Any) -> list[int]:
        """The numbers of the cells with these settings."""
        cells = self.summary["cells"]
        for key, value in settings.items():
            there = {json.dumps(cell["settings"].get(key)) for cell in cells}
            if not any(key in cell["settings"] for cell in cells):
                raise KeyError(f"{key}: no setting; expected {', '.join(cells[0]['settings'])}")
            if not any(same(cell["settings"].get(key), value) for cell in cells):
                raise KeyError(f"{key}: {value!r}; expected one of {', '.join(sorted(there))}")
        return [
            number
            for number, cell in enumerate(cells)
            if all(same(cell["settings"].get(key), value) for key, value in settings.items())
        ]

    def _chosen(self, settings: Mapping[str, Any]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
        """The chosen cells, each with the columns that name it."""
        cells = [self.summary["cells"][number] for number in self.cells(**settings)]
        return [(cell, {"cell": cell["cell"], **{key: cell["settings"][key] for key in self.axes}}) for cell in cells]

    def rows(self, **settings: Any) -> list[dict[str, Any]]:
        """The summary: a dict for each cell, output and measure, with standard errors as ``mean_mcse``."""
        rows = []
        for cell, names in self._chosen(settings):
            for output in cell["outputs"]:
                counts = {"trials": output["outcomes"]["trials"], "failed": output["failed"]["count"]}
                for measure, figures in output["figures"].items():
                    rows.append(
                        {**names, "output": _label(output), "measure": measure, **counts, **_flat(figures, FIGURES)}
                    )
        return rows

    def frame(self, kind: str | None = None, **settings: Any) -> Any:
        """The summary as a frame of "polars" or "pandas": a row for each cell, output and measure."""
        return frame(self.rows(**settings), kind)

    def trials(self, kind: str | None = None) -> Any:
        """Every trial as a frame, of a study with ``store = "trials"``."""
        self._read("manifest.json")
        places = self._places("trials.parquet")
        found = [path for path in places if path.exists()]
        if not found:
            raise FileNotFoundError(f'{places[-1]}: only a study with store="trials" keeps its trials')
        self._check()
        return frames(kind).read_parquet(found[0])

    def comparisons(self, kind: str | None = None, **settings: Any) -> Any:
        """The comparisons of the study as a frame: a row for each cell, pair and measure."""
        rows = []
        for cell, names in self._chosen(settings):
            for pair in cell["comparisons"]:
                for measure, figures in pair["figures"].items():
                    both = {"first": pair["first"], "second": pair["second"], "measure": measure}
                    rows.append({**names, **both, **_flat(figures, tuple(figures))})
        return frame(rows, kind)

    def verdicts(self) -> list[Verdict]:
        """The verdicts on the claims of the study, as its report has them."""
        claims = json.loads(self._read("manifest.json"))["experiment"].get("claims", [])
        if not claims:
            return []
        with tempfile.TemporaryDirectory() as folder:
            call("report", self.folder, "--out", folder)
            lines = Path(folder, "claims.md").read_text(encoding="utf-8").splitlines()
            with Path(folder, "tables", "claims.csv").open(newline="", encoding="utf-8") as file:
                numbers = list(csv.DictReader(file))
        found = []
        for claim in claims:
            begin = f"{claim['id']}  "
            line = next((line[len(begin) :] for line in lines if line.startswith(begin)), "")
            own = [row for row in numbers if row["claim"] == claim["id"]]
            found.append(Verdict(claim["id"], line.partition(":")[0], claim["text"], line, own))
        return found

    def failed(self, method: str | None = None, **settings: Any) -> list[dict[str, Any]]:
        """The failures: a dict for each cell, output and kind, with the numbers of the first trials.

        Parameters
        ----------
        method : str, optional
            A label such as ``"iv(4)"``, or a method such as ``"iv"``.
        """
        rows = []
        outputs = [(names, output) for cell, names in self._chosen(settings) for output in cell["outputs"]]
        known = sorted({name for _, output in outputs for name in (_label(output), output["estimator"])})
        if method is not None and method not in known:
            raise KeyError(f"method: {method!r}; expected one of {', '.join(known)}")
        for names, output in outputs:
            if method in (None, _label(output), output["estimator"]):
                first = output["outcomes"]["failed_trials"]
                for kind, count in output["outcomes"]["failures"].items():
                    if count:
                        rows.append(
                            {
                                **names,
                                "output": _label(output),
                                "kind": kind,
                                "count": count,
                                "first": first.get(kind, []),
                            }
                        )
        return rows

    def replay(self, trial: int, cell: int | None = None, *, allow_commands: bool = False, **settings: Any) -> Replay:
        """A trial computed again, with every stage.

        Parameters
        ----------
        trial : int
        cell : int, optional
            The number of the cell; or its settings, such as ``eta=10``.
        allow_commands : bool
            Whether programs that are methods may be run, in the current folder. The functions of these results may.
        """
        chosen = [cell] if cell is not None else self.cells(**settings)
        if len(chosen) != 1:
            raise ValueError(f"{len(chosen)} cells; expected one: {', '.join(f'{key}=...' for key in self.axes)}")
        with Relay(self.methods) as environment:
            allow = ["--allow-commands"] if allow_commands else consent(self.methods)
            text = call(
                "replay", self.folder, f"cell={chosen[0]}:{trial}", "--format", "json", *allow, environment=environment
            )
        return Replay(json.loads(text))

    def plot(
        self,
        measure: str | None = None,
        x: str | None = None,
        *,
        statistic: str | None = None,
        methods: Sequence[str] = (),
        log: bool | None = None,
        ax: Any = None,
    ) -> Any:
        """A figure of the study: a measure over a setting.

        Parameters
        ----------
        measure, x, statistic : str, optional
            As ``asobench plot`` has them; what is left out follows from the study.
        methods : list of str
            Outputs or methods; all if left out.
        log : bool, optional
            Whether the y axis is logarithmic.
        ax : matplotlib axes, optional
            Draws medians there by matplotlib instead, with their standard errors.

        Returns
        -------
        Picture
            The program's SVG; with `ax` the axes.
        """
        if ax is not None:
            return _on_axes(self, measure, x, methods, log, ax)
        flags = [("--measure", measure), ("--over", x), ("--statistic", statistic), *(("--method", m) for m in methods)]
        given = [str(part) for pair in flags if pair[1] is not None for part in pair]
        given += [] if log is None else ["--log" if log else "--linear"]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "figure.svg")
            call("plot", self.folder, *given, "--out", path)
            return Picture(path.read_text(encoding="utf-8"))

    def report(self) -> Path:
        """Writes report.html; gives its path."""
        call("report", self.folder)
        return self.folder / "report.html"

    def __repr__(self) -> str:
        return self.text or f"Results({str(self.folder)!r})"


def same(one: Any, other: Any) -> bool:
    """Whether two settings are the same value; 10 is 10.0."""
    if isinstance(one, np.generic):
        one = one.item()
    if isinstance(other, np.generic):
        other = other.item()
    return bool(one == other) and isinstance(one, bool) == isinstance(other, bool)


def _label(output: Mapping[str, Any]) -> str:
    """An output as it is printed."""
    number = output["pass"]
    return f"{output['estimator']}({number})" if number else str(output["estimator"])


def _flat(figures: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Figures as columns."""
    row: dict[str, Any] = {}
    for name in ("count", *names, "min", "max"):
        value = figures.get(name)
        if isinstance(value, Mapping):
            row[name] = value.get("value", value.get("share"))
            row[f"{name}_mcse"] = value.get("mcse")
        elif name in figures:
            row[name] = value
    return row


def _arrays(value: Any) -> Any:
    """Lists of numbers as arrays."""
    if isinstance(value, dict):
        return {key: _arrays(item) for key, item in value.items()}
    if isinstance(value, list):
        flat = value and all(isinstance(item, (int, float)) or item is None for item in value)
        return np.array(value, dtype=float) if flat else [_arrays(item) for item in value]
    return value


def _on_axes(
    results: Results, measure: str | None, x: str | None, methods: Sequence[str], log: bool | None, ax: Any
) -> Any:
    rows = results.rows()
    measure = measure or rows[0]["measure"]
    x = x or next(iter(results.axes), None)
    if x not in results.axes:
        raise ValueError(f"x: {x!r}; expected one of {', '.join(results.axes) or 'none: all cells are alike'}")
    rows = [row for row in rows if row["measure"] == measure]
    if not rows:
        raise ValueError(f"measure: {measure!r} is not in the results")
    others = [key for key in results.axes if key != x]
    series: dict[str, list[tuple[Any, float, float]]] = {}
    for row in rows:
        if not methods or row["output"] in methods or row["output"].split("(")[0] in methods:
            name = ", ".join([row["output"], *(f"{key} = {row[key]}" for key in others)])
            series.setdefault(name, []).append((row[x], row["q50"], row["q50_mcse"] or 0.0))
    for name, points in series.items():
        at, median, error = zip(*points)
        ax.errorbar(at, np.array(median, float), np.array(error, float), label=name, marker=".")
    ax.set(xlabel=x, ylabel=f"median {measure}", **({"yscale": "log"} if log else {}))
    ax.legend()
    return ax
