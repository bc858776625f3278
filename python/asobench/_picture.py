"""Pictures that the program draws."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ._model import Model
from ._program import call


def picture(model: Model) -> str:
    """The record of a model with its outputs, as SVG."""
    assert model._record is not None
    u, y = model._record
    options = dict(model._options)
    flags = [f"--{key.replace('_', '-')}={value}" for key, value in options.items()]
    if "orders" not in options:
        flags += [f"--order={len(model.A) - 1}", f"--delay={model.nk}"]
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = Path(folder, "record.csv"), Path(folder, "record.svg")
        lines = ["u,y", *(f"{a!r},{b!r}" for a, b in zip(np.asarray(u).tolist(), np.asarray(y).tolist()))]
        record.write_text("\n".join(lines) + "\n", encoding="utf-8")
        call("estimate", record, "--estimator", model.estimator, *flags, "--plot", drawing)
        return drawing.read_text(encoding="utf-8")
