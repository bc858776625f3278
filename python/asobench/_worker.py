"""docs/protocol.md in one decorator."""

import json
import os

import numpy as np

PARTS = {"A": "na", "B": "nb", "C": "nc", "D": "nd", "F": "nf"}


class Declined(Exception):
    """A record that is not one for the method."""


def worker(function=None, *, name=None, version="0", returns="polynomials", deterministic=True, single=False):
    """Makes a worker of ``function(u, y, r, setting)``.

    ``u``, ``y`` and ``r`` have m rows of N samples (with ``single`` one record of N samples). ``setting`` is what
    ``hello`` says, with ``trials`` and ``seeds`` of the batch (with ``single`` ``trial`` and ``seed``). It returns a dict
    of the free coefficients "A", "B", "C", "D", "F" (m rows each, B from the delay on), "nk", "noise_variance" and
    "covariance"; or with ``returns="matrices"`` of "A", "b", "c" and, where they are there, "d" and "x0". A ``single``
    function may raise: ``Declined``, or any other exception, whose name is the reason.
    """
    if function is None:
        return lambda function: worker(
            function, name=name, version=version, returns=returns, deterministic=deterministic, single=single
        )
    ready = {"frame": "ready", "protocol": 1, "name": name or function.__name__, "version": str(version),
             "returns": returns, "deterministic": deterministic}
    function.serve = lambda: _serve(function, ready, single)
    return function


def _serve(function, ready, single):
    """Answers until the requests end."""
    with open(os.environ["ASOBENCH_REQUESTS"], "rb") as requests, open(os.environ["ASOBENCH_REPLIES"], "wb") as replies:

        def answer(header, blocks=None):
            replies.write(json.dumps(header).encode() + b"\n")
            if blocks is not None:
                replies.write(b"".join(np.ascontiguousarray(block, "<f8").tobytes() for block in blocks) + b"\n")
            replies.flush()

        while line := requests.readline():
            head = json.loads(line)
            if head["frame"] == "hello":
                hello = head
                answer(ready)
                continue
            m, n = head["trials"], head["samples"]
            numbers = np.frombuffer(requests.read(head["bytes"]), "<f8")
            trials, seeds = (block.astype(np.int64) for block in numbers[: 2 * m].reshape(2, m))
            signals = numbers[2 * m :].reshape(3, m, n)
            status, reasons = np.zeros(m), []
            if single:
                model = _each(function, hello, trials, seeds, signals, status, reasons)
            else:
                model = function(*signals, {**hello, "trials": trials, "seeds": seeds})
            form = _matrices if ready["returns"] == "matrices" else _polynomials
            header, blocks = form(model, m, hello)
            blocks = [status, np.full(m, np.nan), *blocks]
            size = 8 * sum(block.size for block in blocks)
            answer({"frame": "reply", "number": head["number"], "trials": m, "reasons": reasons, "bytes": size, **header},
                   blocks)


def _each(function, hello, trials, seeds, signals, status, reasons):
    """The models of a function of one record, stacked; of a record without a model they are zeros."""
    models = []
    for i in range(len(trials)):
        setting = {**hello, "trial": int(trials[i]), "seed": int(seeds[i])}
        try:
            models.append(function(*signals[:, i], setting))
        except Declined:
            status[i] = 1
        except Exception as error:
            reason = type(error).__name__
            if reason not in reasons:
                reasons.append(reason)
            status[i] = 2 + reasons.index(reason)
        if status[i]:
            models.append(None)
    known = next((model for model in models if model is not None), None)
    if known is None:
        # No model is looked at: of any form.
        return {key: np.zeros((len(trials), 1)) for key in "ABbc"}
    blank = {key: np.zeros_like(np.asarray(value, float)) for key, value in known.items() if key != "nk"}
    stacked = {key: np.stack([np.asarray((model or blank)[key], float) for model in models]) for key in blank}
    return stacked | ({"nk": known["nk"]} if "nk" in known else {})


def _matrices(model, m, hello):
    """The header and the blocks of a reply's models."""
    n = np.asarray(model["b"]).reshape(m, -1).shape[1]
    shapes = {"A": n * n, "b": n, "c": n, "d": 1, "x0": n}
    missing = {"d": 0.0, "x0": np.nan}
    blocks = [np.asarray(model[key], float).reshape(m, width) if key in model else np.full((m, width), missing[key])
              for key, width in shapes.items()]
    return {"order": n}, blocks


def _polynomials(model, m, hello):
    """The header and the blocks of a reply's models."""
    parts = {key: np.asarray(model[key], float).reshape(m, -1) for key in PARTS if key in model}
    header = {PARTS[key]: part.shape[1] for key, part in parts.items()}
    # One row of parameters for each trial.
    blocks = [np.hstack(list(parts.values()))]
    for key in ("noise_variance", "covariance"):
        if key in model:
            header[key] = True
            blocks.append(np.asarray(model[key], float))
    return {**header, "nk": int(model.get("nk", hello["nk"]))}, blocks
