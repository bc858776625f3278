"""Rows as frames."""

from __future__ import annotations

import importlib
from typing import Any


def frame(rows: list[dict[str, Any]], kind: str | None = None) -> Any:
    """A frame of rows: of `kind`, or of what is installed."""
    module = frames(kind)
    if module.__name__ == "polars":
        return module.DataFrame(rows, infer_schema_length=None)
    return module.DataFrame(rows)


def frames(kind: str | None) -> Any:
    """polars or pandas."""
    if kind not in (None, "polars", "pandas"):
        raise ValueError(f"kind: {kind!r}; expected 'polars' or 'pandas'")
    for name in ("polars", "pandas") if kind is None else (kind,):
        try:
            return importlib.import_module(name)
        except ImportError:
            continue
    extra = kind or "polars"
    raise ImportError(f'frames need {kind or "polars or pandas"}: pip install "asobench[{extra}]"')
