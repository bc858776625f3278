"""docs/protocol.md in one decorator."""

from __future__ import annotations

import json
import os
import traceback
from collections.abc import Callable, Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ._arrays import Vector, real
from ._errors import Declined

PARTS = {"A": "na", "B": "nb", "C": "nc", "D": "nd", "F": "nf"}
Blocks = list[NDArray[np.float64]]
#: Makes the header and the blocks of what a function returned.
Form = Callable[[Any, int, Mapping[str, Any]], tuple[dict[str, Any], Blocks]]
#: Of an exception: the number of the trial.
OnError = Callable[[int], None]


def worker(
    function: Any = None,
    *,
    name: str | None = None,
    version: str = "0",
    returns: str = "polynomials",
    deterministic: bool = True,
    single: bool = False,
) -> Any:
    """Makes a worker of ``function(u, y, r, setting)``.

    ``u``, ``y`` and ``r`` have m rows of N samples (with ``single`` one record of N samples). ``setting`` is what
    ``hello`` says, with ``trials`` and ``seeds`` of the batch (with ``single`` ``trial`` and ``seed``). It returns a
    dict of the free coefficients "A", "B", "C", "D", "F" (m rows each, B from the delay on), "nk" (one number for all),
    "noise_variance" (m) and "covariance" (m, p, p); or with ``returns="matrices"`` of "A" (m, n, n), "b" and "c" (m, n)
    and, where they are there, "d" (m) and "x0" (m, n). With ``single`` the first length m is left out.

    A ``single`` function may raise: ``Declined``, or any other exception, whose name and message are the reason. The
    models of a message have the same keys, orders and nk: fill up with zeros. Another value, such as None,
    complex numbers or another key, is an error: with ``single`` the reason of that record, else of the whole worker.
    """
    if function is None:
        return lambda function: worker(
            function, name=name, version=version, returns=returns, deterministic=deterministic, single=single
        )
    ready = {
        "frame": "ready",
        "protocol": 1,
        "name": name or function.__name__,
        "version": str(version),
        "returns": returns,
        "deterministic": deterministic,
    }
    function.serve = lambda: _serve(function, ready, single)
    return function


def _serve(function: Any, ready: Mapping[str, Any], single: bool) -> None:
    """Answers the program that started this process, until the requests end."""
    with open(os.environ["ASOBENCH_REQUESTS"], "rb") as requests, open(os.environ["ASOBENCH_REPLIES"], "wb") as replies:
        shown = Shown()
        answer(function, ready, single, requests, replies, shown)


class Shown:
    """Prints the traceback of the first exceptions."""

    def __init__(self) -> None:
        self.left = SHOWN

    def __call__(self, trial: int) -> None:
        if self.left:
            traceback.print_exc()
        self.left = max(0, self.left - 1)


# Of how many exceptions the traceback is printed.
SHOWN = 3


def answer(
    function: Any, ready: Mapping[str, Any], single: bool, requests: BinaryIO, replies: BinaryIO, on_error: OnError
) -> None:
    """Answers until the requests end."""
    form: Form = _matrices if ready["returns"] == "matrices" else _polynomials

    def send(header: Mapping[str, Any], blocks: Blocks | None = None) -> None:
        replies.write(json.dumps(header).encode() + b"\n")
        if blocks is not None:
            replies.write(b"".join(np.ascontiguousarray(block, "<f8").tobytes() for block in blocks) + b"\n")
        replies.flush()

    while line := requests.readline():
        head = json.loads(line)
        if head["frame"] == "hello":
            hello = head
            send(ready)
            continue
        m, n = head["trials"], head["samples"]
        numbers = np.frombuffer(requests.read(head["bytes"]), "<f8")
        trials, seeds = (block.astype(np.int64) for block in numbers[: 2 * m].reshape(2, m))
        signals = numbers[2 * m :].reshape(3, m, n)
        status = np.zeros(m)
        reasons: list[str] = []
        if single:
            header, blocks = _each(function, form, hello, (trials, seeds), signals, status, reasons, on_error)
        else:
            header, blocks = form(function(*signals, {**hello, "trials": trials, "seeds": seeds}), m, hello)
        blocks = [status, np.full(m, np.nan), *blocks]
        size = 8 * sum(block.size for block in blocks)
        send(
            {"frame": "reply", "number": head["number"], "trials": m, "reasons": reasons, "bytes": size, **header},
            blocks,
        )


def _each(
    function: Any,
    form: Form,
    hello: Mapping[str, Any],
    numbers: tuple[Any, Any],
    signals: Any,
    status: Vector,
    reasons: list[str],
    on_error: OnError,
) -> tuple[dict[str, Any], Blocks]:
    """The header and the blocks of a function of one record; of a record without a model the numbers are zeros."""
    models: list[Any] = [None] * len(numbers[0])
    first: int | None = None
    for i, (trial, seed) in enumerate(zip(*numbers)):
        setting = {**hello, "trial": int(trial), "seed": int(seed)}
        try:
            model = function(*signals[:, i], setting)
            if isinstance(model, dict):
                model = {key: value if key == "nk" else np.asarray(value)[None] for key, value in model.items()}
            models[i] = form(model, 1, hello)
        except Declined as error:
            status[i] = _status(reasons, f"declined, {error}") if str(error) else 1
        except Exception as error:
            status[i] = _status(reasons, f"{type(error).__name__}: {error}")
            on_error(int(trial))
        if models[i] is None:
            continue
        first = i if first is None else first
        if models[i][0] != models[first][0]:
            raise ValueError(
                f"the models of a message differ: {models[i][0]} for trial {trial}, {models[first][0]} for "
                f"trial {numbers[0][first]}; expected the same keys, orders and nk: fill up with zeros, or "
                "say batch = 1"
            )
    header, blocks = form(_blank(form), 1, hello) if first is None else models[first]
    zeros = [np.zeros_like(block) for block in blocks]
    rows = zip(*((model or (header, zeros))[1] for model in models))
    return header, [np.concatenate(row) for row in rows]


def _status(reasons: list[str], text: str) -> float:
    """The status of a reason, which is among the reasons then."""
    reason = text.strip(" :\n").split("\n")[0][:60].strip()
    if reason not in reasons:
        reasons.append(reason)
    return 2.0 + reasons.index(reason)


def _blank(form: Form) -> dict[str, Any]:
    """A model that nobody looks at."""
    return {key: np.zeros((1, 1)) for key in ("A" if form is _polynomials else "Abc")}


def _parts(model: Any, names: tuple[str, ...], required: Any) -> dict[str, Vector]:
    """The arrays that a function returned, checked."""
    if not isinstance(model, dict):
        raise TypeError(f"returned {type(model).__name__}; expected a dict of {', '.join(names)}")
    for key in model:
        if key not in names:
            raise TypeError(f"returned the key {key!r}; expected some of {', '.join(names)}")
    if not any(key in model for key in required):
        raise TypeError(f"returned no {' or '.join(required)}")
    return {key: real(key, value) for key, value in model.items() if key != "nk"}


def _shaped(key: str, value: Vector, *shapes: tuple[int, ...]) -> Vector:
    """A block of one of some shapes, in the first one."""
    if value.shape not in shapes:
        raise TypeError(f"{key}: shape {value.shape}; expected {shapes[0]}")
    return value.reshape(shapes[0])


def _matrices(model: Any, m: int, hello: Mapping[str, Any]) -> tuple[dict[str, Any], Blocks]:
    """The header and the blocks of a reply's models."""
    parts = _parts(model, ("A", "b", "c", "d", "x0"), ("A",))
    for key in "Abc":
        if key not in parts:
            raise TypeError(f"returned no {key}")
    n = parts["A"].shape[-1] if parts["A"].ndim else 1
    shapes: dict[str, list[tuple[int, ...]]] = {
        "A": [(m, n, n)],
        "b": [(m, n), (m, n, 1)],
        "c": [(m, n), (m, 1, n)],
        "d": [(m,), (m, 1), (m, 1, 1)],
        "x0": [(m, n), (m, n, 1)],
    }
    missing = {"d": 0.0, "x0": np.nan}
    blocks = [
        _shaped(key, parts[key], *of) if key in parts else np.full(of[0], missing[key]) for key, of in shapes.items()
    ]
    return {"order": n}, blocks


def _polynomials(model: Any, m: int, hello: Mapping[str, Any]) -> tuple[dict[str, Any], Blocks]:
    """The header and the blocks of a reply's models."""
    parts = _parts(model, (*PARTS, "nk", "noise_variance", "covariance"), PARTS)
    rows = {}
    for key in PARTS:
        if key in parts:
            width = parts[key].shape[1] if parts[key].ndim == 2 else 1
            rows[key] = _shaped(key, parts[key], (m, width), (m,))
    header = {PARTS[key]: part.shape[1] for key, part in rows.items()}
    # One row of parameters for each trial.
    blocks = [np.hstack(list(rows.values()))]
    p = blocks[0].shape[1]
    for key, shapes in (("noise_variance", [(m,), (m, 1)]), ("covariance", [(m, p, p)])):
        if key in parts:
            header[key] = True
            blocks.append(_shaped(key, parts[key], *shapes))
    nk = model.get("nk", hello["nk"])
    if not isinstance(nk, (int, np.integer)) or isinstance(nk, bool):
        raise TypeError(f"nk: {nk!r}; expected one whole number")
    return {**header, "nk": int(nk)}, blocks
