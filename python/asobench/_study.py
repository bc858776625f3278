"""Studies as objects, run by the program."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import whole
from ._errors import StudyError
from ._method import Method, Relay, command, consent
from ._program import call
from ._results import Results, same
from ._toml import read, toml

Path_ = str | os.PathLike[str]


class Study:
    """A study: what an experiment file says, by the same keys.

    Parameters
    ----------
    methods : list
        Names of estimators, dicts with the keys of a method, or functions (:func:`method`).
    **keys
        The other keys of an experiment file: ``settings``, ``plants``, ``measures``, ``compare``, ``claims``,
        ``trials``, ``seed`` and so on (docs/reference.md). Lists and NumPy arrays among the settings are axes.

    Examples
    --------
    >>> import asobench as ab, numpy as np
    >>> settings = {"eta": np.array([2.0, 10.0]), "window": 98}
    >>> study = ab.Study(settings=settings, methods=["arx", {"estimator": "oe", "starts": 2}])
    >>> print(study.to_toml(), end="")
    "settings" = { "eta" = [2.0, 10.0], "window" = 98 }
    "methods" = [{ "estimator" = "arx" }, { "estimator" = "oe", "starts" = 2 }]
    """

    def __init__(self, *, methods: list[Any] | None = None, **keys: Any) -> None:
        self.keys = {key: value for key, value in keys.items() if value is not None}
        self.functions = [entry for entry in methods or [] if isinstance(entry, Method)]
        names = [function.name for function in self.functions]
        if len(set(names)) < len(names):
            raise ValueError(f"methods: {', '.join(names)}; expected names that differ: having(name=...)")
        if methods is not None:
            if isinstance(methods, (str, dict, Method)):
                raise TypeError("methods: expected a list")
            self.keys["methods"] = [_entry(entry) for entry in methods]
        self.folder = Path(".")

    @classmethod
    def read(cls, path: Path_) -> Study:
        """The study of an experiment file, whose relative paths begin beside it."""
        keys = read(Path(path))
        methods = keys.pop("methods", None)
        study = cls(methods=methods, **keys)
        study.folder = Path(path).parent
        return study

    def to_toml(self) -> str:
        """The experiment file. Functions are in it as programs that this Python alone can run."""
        return toml(self.keys)

    def save(self, path: Path_) -> Path:
        """Writes the experiment file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")
        return Path(path)

    def check(self) -> str:
        """The forecast of ``asobench check``: the size of the grid, and what a run takes."""
        with self._file() as path:
            return call("check", path)

    def run(
        self,
        folder: Path_,
        *,
        trials: int | None = None,
        progress: bool | None = None,
        overwrite: bool = False,
        threads: int | None = None,
        allow_commands: bool = False,
    ) -> Results:
        """Runs the study; a run that was stopped goes on, and a larger number of trials extends it.

        Parameters
        ----------
        folder : path
            Where the results go.
        trials : int, optional
            In each cell, instead of the study's.
        progress : bool, optional
            Whether a bar is shown; if left out, on a terminal and in a notebook.
        overwrite : bool
            Whether the program replaces results of another study, or of more trials, in the folder. They stay until the
            new ones are whole. Other files stay; a folder without results of the program is refused.
        threads : int, optional
            One for each processor if left out.
        allow_commands : bool
            Whether programs that are methods may be run. The functions among the methods may, and no other command.

        Raises
        ------
        StudyError
            With the program's line.
        KeyboardInterrupt
            Ctrl-C stops the run; the same call continues it.
        """
        folder = Path(folder)
        arguments: list[Any] = ["--out", folder]
        arguments += [] if trials is None else ["--trials", whole("trials", trials, 1)]
        arguments += [] if threads is None else ["--threads", whole("threads", threads, 1)]
        arguments += ["--overwrite"] if overwrite else []
        arguments += ["--allow-commands"] if allow_commands else consent(self.functions)
        if progress is None:
            progress = sys.stderr.isatty() or "ipykernel" in sys.modules
        with self._file() as path, Relay(self.functions) as environment:
            text = call("run", path, *arguments, show=progress, environment=environment)
        return Results(folder, text, methods=self.functions)

    def simulate(self, trials: int = 100, cell: int | None = None, **settings: Any) -> dict[str, NDArray[np.float64]]:
        """The records of a cell, as methods see them.

        Parameters
        ----------
        trials : int
            From trial 0 on.
        cell : int, optional
            The number of the cell.
        **settings
            Instead: the values of the settings that have several, such as ``eta=10``.

        Returns
        -------
        dict
            "trial", the numbers of the trials, (m,), and "u", "y" and "r", (m, N). A trial whose record cannot be drawn
            is not among them.
        """
        return simulate_cell(self, trials, cell, settings)

    @contextlib.contextmanager
    def _file(self) -> Iterator[Path]:
        """An experiment file, in the folder where its paths begin."""
        with _written({"title": "a study", **self.keys}, self.folder) as path:
            yield path

    def __repr__(self) -> str:
        methods = [entry.get("name", entry.get("estimator")) for entry in self.keys.get("methods", [])]
        keys = {**self.keys, "methods": methods}
        return f"Study({', '.join(f'{key}={value!r}' for key, value in keys.items())})"


@contextlib.contextmanager
def _written(keys: Mapping[str, Any], folder: Path) -> Iterator[Path]:
    text = toml(keys)
    with tempfile.NamedTemporaryFile("w", prefix=".asobench-", suffix=".toml", dir=folder, encoding="utf-8") as file:
        file.write(text)
        file.flush()
        yield Path(file.name)


def _entry(entry: Any) -> dict[str, Any]:
    """A method as a table of the file."""
    if isinstance(entry, Method):
        return entry.table()
    if isinstance(entry, str):
        return {"estimator": entry}
    if isinstance(entry, Mapping):
        return dict(entry)
    hint = "; decorate the function: @asobench.method" if callable(entry) else ""
    raise TypeError(f"methods: {entry!r}; expected a name, a dict or a method{hint}")


#: The keys of a study that its records follow from.
DATA = ("seed", "settings", "zip", "exclude", "plants", "noises", "feedbacks", "columns")
#: Bytes of the records in a message.
MESSAGE = 1 << 26


class Records:
    """A method that keeps the records of trials, and whose models are of no interest."""

    name: str = "records"
    processes: int | None = None
    single: bool = False

    def __init__(self) -> None:
        self.trials, self.samples = 0, 0
        self.kept: dict[str, list[Any]] = {name: [] for name in ("trial", "u", "y", "r")}

    def ready(self) -> dict[str, Any]:
        own = {"name": self.name, "version": "1", "returns": "polynomials", "deterministic": True}
        return {"frame": "ready", "protocol": 1, **own}

    def changes(self) -> list[str]:
        return []

    def say_changed(self, labels: Sequence[str]) -> None:
        pass

    def reply(self, u: Any, y: Any, r: Any, setting: Mapping[str, Any]) -> dict[str, Any]:
        wanted = setting["trials"] < self.trials
        self.samples = setting["samples"]
        for name, rows in {"trial": setting["trials"], "u": u, "y": y, "r": r}.items():
            self.kept[name].append(rows[wanted])
        return {"A": np.zeros((len(u), setting["na"])), "B": np.zeros((len(u), setting["nb"]))}

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """The records that were kept."""
        return {name: np.concatenate(parts or [np.zeros(0)]) for name, parts in self.kept.items()}


def simulate_cell(
    study: Study, trials: int, cell: int | None, settings: Mapping[str, Any]
) -> dict[str, NDArray[np.float64]]:
    """The records of a cell: a method keeps them. Nothing is estimated."""
    whole("trials", trials, 1)
    data = {key: study.keys[key] for key in DATA if key in study.keys}
    toml(data)
    known = dict(data.get("settings", {}))
    axes = [key for key, value in known.items() if isinstance(value, (list, tuple, range, np.ndarray))]
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        if cell is None:
            for key in settings:
                if key not in axes:
                    raise ValueError(f"{key}: no setting with several values; expected {', '.join(axes) or 'none'}")
            chosen = {key: _choose(key, known[key], settings) for key in axes}
        else:
            chosen = _of_cell(data, study.folder, place, whole("cell", cell, 0), axes)
        alone = {key: data[key] for key in data if key not in ("zip", "exclude")} | {"settings": known | chosen}
        records = Records()
        # The first trial says how long a record is.
        for count, out in ((0, "first"), (trials, "results")):
            size = 24 * records.samples
            if size * count > _memory() / 2:
                raise ValueError(
                    f"trials: {trials} records of {records.samples} samples take {size * count / 2**30:.3g} GiB; "
                    f"expected at most half of the memory, {_memory() / 2**31:.3g} GiB"
                )
            records.trials, records.kept = count, {name: [] for name in records.kept}
            batch = max(1, min(count, 65536, MESSAGE // max(size, 1)))
            method = {"name": records.name, "command": command(records.name), "batch": batch}
            run = _run_data(alone, study.folder, place / out, method, max(count, 1), [records])
            for row in run.failed():
                if row["kind"] in ("crashed", "timeout", "malformed"):
                    raise StudyError(f"records of {row['count']} trials were not kept: {row['kind']}")
        arrays = records.arrays()
    if not len(arrays["trial"]):
        raise ValueError(f"no record of the first {trials} trials can be drawn")
    return arrays


def _memory() -> float:
    """The bytes of this machine's memory."""
    return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")


def _choose(key: str, values: Any, settings: Mapping[str, Any]) -> Any:
    """The value of an axis."""
    if len(values) == 1:
        return values[0]
    if key not in settings:
        raise ValueError(f"{key}: has {len(values)} values; expected {key}=... or the number of a cell")
    found = [value for value in values if same(value, settings[key])]
    if not found:
        raise ValueError(f"{key}: {settings[key]!r}; expected one of {', '.join(map(str, values))}")
    return found[0]


def _of_cell(data: Mapping[str, Any], folder: Path, place: Path, cell: int, axes: list[str]) -> dict[str, Any]:
    """The settings of a cell, as the program numbers them."""
    if not axes and cell == 0:
        return {}
    cells = _run_data(data, folder, place / "cells", {"name": "cells", "estimator": "ls"}, 1).summary["cells"]
    if cell >= len(cells):
        raise IndexError(f"cell {cell}: expected 0 to {len(cells) - 1}")
    return {key: cells[cell]["settings"][key] for key in axes}


def _run_data(
    data: Mapping[str, Any],
    folder: Path,
    out: Path,
    method: Mapping[str, Any],
    trials: int,
    asked: Sequence[Records] = (),
) -> Results:
    with _written({**data, "measures": ["e_a"], "methods": [method]}, folder) as path, Relay(asked) as environment:
        flags = ["--out", out, "--trials", trials, "--threads", 1, *consent(asked)]
        text = call("run", path, *flags, environment=environment)
    return Results(out, text)


def run(
    study: Path_ | Mapping[str, Any] | Study,
    folder: Path_ | None = None,
    *,
    trials: int | None = None,
    threads: int | None = None,
    allow_commands: bool = False,
) -> Results:
    """Runs an experiment file, a dict of the same keys, or a :class:`Study`; the last two need a folder."""
    if isinstance(study, (str, os.PathLike)):
        folder = Path(folder or Path("results") / Path(study).stem)
        arguments: list[Any] = ["run", study, "--out", folder]
        arguments += [] if trials is None else ["--trials", trials]
        arguments += [] if threads is None else ["--threads", threads]
        return Results(folder, call(*arguments, *(["--allow-commands"] if allow_commands else [])))
    if folder is None:
        raise TypeError("folder: expected where the results of a study go")
    of = study if isinstance(study, Study) else Study(**study)
    return of.run(folder, trials=trials, threads=threads, allow_commands=allow_commands)


def simulate(
    study: Path_ | Mapping[str, Any] | Study, cell: int | None = None, trials: int = 100, **settings: Any
) -> dict[str, NDArray[np.float64]]:
    """The records of a cell of a file, a dict or a study: :meth:`Study.simulate`."""
    if isinstance(study, (str, os.PathLike)):
        study = Study.read(study)
    of = study if isinstance(study, Study) else Study(**study)
    return of.simulate(trials, cell, **settings)
