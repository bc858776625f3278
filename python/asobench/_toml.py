"""Experiment files: dicts as TOML and back."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


def read(path: Path) -> dict[str, Any]:
    """A file as a dict."""
    reader: Any = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")
    keys: dict[str, Any] = reader.loads(path.read_text())
    return keys


def toml(keys: Mapping[str, Any]) -> str:
    """A dict as TOML: tables and lists inline, which TOML allows below the first level."""
    return "".join(f"{_string(key)} = {_inline(str(key), value)}\n" for key, value in keys.items())


def _string(text: str) -> str:
    return json.dumps(str(text), ensure_ascii=False).replace("\x7f", "\\u007f")


def _inline(where: str, value: Any) -> str:
    """A value; `where` it is, for an error."""
    if isinstance(value, Mapping):
        items = [
            f"{_string(key)} = {_inline(f'{where}.{key}', item)}" for key, item in value.items() if item is not None
        ]
        return "{ " + ", ".join(items) + " }"
    if isinstance(value, (list, tuple, range, np.ndarray)):
        return "[" + ", ".join(_inline(f"{where}[{i}]", item) for i, item in enumerate(value)) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return _string(value)
    raise TypeError(f"{where}: {value!r}; expected text, numbers, booleans, lists or dicts of these")
