"""A worker that keeps the records of the one cell of a study; its arguments are a file and the number of trials."""

import sys
from collections import defaultdict
from typing import Any

import numpy as np

from ._worker import worker

kept: dict[str, list[Any]] = defaultdict(list)


@worker(name="records", version="1", deterministic=True)  # type: ignore[untyped-decorator]
def capture(u: Any, y: Any, r: Any, setting: Any) -> dict[str, Any]:
    """Keeps the records; the models are of no interest."""
    wanted = setting["trials"] < int(sys.argv[2])
    for name, rows in {"trial": setting["trials"], "u": u, "y": y, "r": r}.items():
        kept[name].append(rows[wanted])
    if wanted.any():
        arrays: Any = {name: np.concatenate(parts) for name, parts in kept.items()}
        np.savez(sys.argv[1], **arrays)
    return {"A": np.zeros((len(u), setting["na"])), "B": np.zeros((len(u), setting["nb"]))}


capture.serve()
