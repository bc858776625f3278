"""Arrays from users: real numbers in one dimension, or a clear refusal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def signal(name: str, given: Any) -> Vector:
    """A contiguous array of doubles of what is not one already."""
    array = real(name, given)
    if array.ndim != 1:
        part = "row is such as x[0]" if array.shape[0] == 1 else "column is such as x[:, 0]"
        hint = f"; one {part}" if array.ndim == 2 else ""
        raise ValueError(f"{name}: shape {array.shape}; expected one dimension{hint}")
    return np.ascontiguousarray(array)


def real(name: str, given: Any) -> Vector:
    """Real numbers as doubles."""
    expected = "expected an array of real numbers"
    if given is None or isinstance(given, (str, bytes, dict, set)):
        raise TypeError(f"{name}: {'None' if given is None else type(given).__name__}; {expected}")
    if hasattr(given, "__next__"):
        raise TypeError(f"{name}: {type(given).__name__}; {expected}, such as list({name})")
    if np.ma.is_masked(given):
        raise ValueError(f"{name}: {int(np.ma.getmaskarray(given).sum())} masked samples; expected all samples")
    try:
        array = np.asarray(given)
    except ValueError as error:
        raise ValueError(f"{name}: rows of different lengths; {expected}") from error
    if array.dtype.kind not in "biuf":
        what = {"c": "complex numbers", "U": "strings", "S": "strings", "O": "objects"}
        raise TypeError(f"{name}: {what.get(array.dtype.kind, str(array.dtype))}; {expected}")
    with np.errstate(over="ignore"):
        return array.astype(np.float64)


#: The largest number that the extension takes.
LARGEST = 2**63 - 1


def whole(name: str, given: Any, least: int, most: int = LARGEST) -> int:
    """A whole number."""
    if isinstance(given, (bool, np.bool_)) or not isinstance(given, (int, np.integer)):
        raise TypeError(f"{name}: {given!r}; expected a whole number")
    if given < least:
        raise ValueError(f"{name}: {given}; expected a whole number of at least {least}")
    if given > most:
        raise ValueError(f"{name}: {given}; expected a whole number of at most {most}")
    return int(given)
