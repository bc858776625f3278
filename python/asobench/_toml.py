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
    keys: dict[str, Any] = reader.loads(path.read_text(encoding="utf-8"))
    return keys


#: The largest text of an experiment file, and the most values of a list.
LARGEST_TEXT = 1 << 26
MOST_VALUES = 1_000_000


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
    if isinstance(value, np.ndarray) and not value.ndim:
        value = value.item()
    if isinstance(value, (list, tuple, range, np.ndarray)):
        if len(value[MOST_VALUES : MOST_VALUES + 1]):
            raise ValueError(f"{where}: more than {MOST_VALUES} values")
        parts: list[str] = []
        size = 0
        for i, item in enumerate(value):
            parts.append(_inline(f"{where}[{i}]", item))
            size += len(parts[-1])
            if size > LARGEST_TEXT:
                raise ValueError(f"{where}: more than {LARGEST_TEXT} characters; an experiment file has no more")
        return "[" + ", ".join(parts) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        if any("\ud800" <= character <= "\udfff" for character in value):
            raise ValueError(f"{where}: {value!r}; an experiment file has text in UTF-8 alone")
        return _string(value)
    raise TypeError(f"{where}: {value!r}; expected text, numbers, booleans, lists or dicts of these")
