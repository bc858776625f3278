"""ARX models of several orders, and observers of a model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import Vector, whole
from ._errors import EstimateFailed
from ._estimators import estimate
from ._model import Model


@dataclass(frozen=True)
class OrderTable:
    """ARX models over the same equations.

    Attributes
    ----------
    rows : list of dict
        Of each model "na", "nb", "nk", "V" (the mean squared residual), the criteria, and "fit", the FIT of its
        simulated output in per cent; None where there is no number.
    best : dict
        The row that each criterion chooses.
    equations : int
        How many equations the models share.
    """

    rows: list[dict[str, Any]]
    best: dict[str, dict[str, Any] | None]
    equations: int

    def frame(self, kind: str | None = None) -> Any:
        """The rows as a frame of polars or pandas."""
        from ._frames import frame

        return frame(self.rows, kind)

    def __repr__(self) -> str:
        names = list(self.best)
        lines = [
            f"{'na':>3} {'nb':>3} {'nk':>3} {'V':>11} " + "".join(f"{name:>12} " for name in names) + f"{'fit %':>8}"
        ]
        for row in self.rows:
            cells = [f"{_number(row[name]):>12}{'*' if self.best[name] is row else ' '}" for name in names]
            orders = " ".join(f"{row[name]:>3}" for name in ("na", "nb", "nk"))
            lines.append(f"{orders} {_number(row['V']):>11} {''.join(cells)}{_number(row['fit']):>8}")
        return "\n".join(lines)


#: How many models are compared at once.
MOST_MODELS = 10_000


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"


def orders(u: ArrayLike, y: ArrayLike, n: int | Iterable[int], nk: int | Iterable[int] = 1) -> OrderTable:
    """Compares ARX models with na = nb of several orders and delays, over the same equations.

    Parameters
    ----------
    u, y : array_like, (N,)
    n : int or iterable of int
        Orders, such as ``range(1, 9)``.
    nk : int or iterable of int
        Delays.

    Examples
    --------
    >>> import asobench as ab, numpy as np
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(300)
    >>> y = ab.Model(A=[1, -1.5, 0.7], B=[1, 0.5], nk=1).simulate(u) + 0.01 * rng.standard_normal(300)
    >>> ab.orders(u, y, range(1, 5)).best["bic"]["na"] >= 2
    True
    """
    ns, delays = _each("n", n, 1), _each("nk", nk, 0)
    if len(ns) * len(delays) > MOST_MODELS:
        raise ValueError(f"n, nk: more than {MOST_MODELS} models")
    pairs = [(order, delay) for delay in delays for order in ns]
    triples = [(order, order, delay) for order, delay in pairs]
    equations, names, found, best = _native.compare_orders(triples, u, y)
    rows = []
    for (na, nb, delay), (loss, values, _) in zip(triples, found):
        try:
            fit = estimate(u, y, "arx", na=na, nb=nb, nk=delay).fit().simulated
        except EstimateFailed:
            fit = float("nan")
        row = {"na": na, "nb": nb, "nk": delay, "V": loss, **dict(zip(names, values))}
        rows.append({**row, "fit": fit if np.isfinite(fit) else None})
    chosen = {name: None if i is None else rows[i] for name, i in zip(names, best)}
    return OrderTable(rows, chosen, equations)


def _each(name: str, given: int | Iterable[int], least: int) -> list[int]:
    """Whole numbers."""
    if isinstance(given, str) or given is None:
        raise TypeError(f"{name}: {given!r}; expected a whole number, or several such as range(1, 9)")
    numbers = list(islice(given, MOST_MODELS + 1)) if isinstance(given, Iterable) else [given]
    if not numbers:
        raise ValueError(f"{name}: empty; expected at least one whole number")
    return [whole(name, number, least) for number in numbers]


@dataclass(frozen=True)
class Observer:
    """An observer of a model: ``xhat(k+1) = A xhat(k) + b u(k) + g (y(k) - c xhat(k))``; `observer` makes one."""

    model: Model
    gain: str

    def run(self, u: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """The states of a record, (K + 1, n), from the model's x0, k = 0 ... K.

        They are in the coordinates of :meth:`Model.state_space`.
        """
        return self.model.observer(self.gain).run(u, y).x

    @property
    def g(self) -> Vector:
        """The gain, (n,)."""
        return self.model.observer(self.gain).gain


def observer(model: Model, gain: str = "dead-beat") -> Observer:
    """The observer of a model.

    Parameters
    ----------
    model : Model
    gain : str
        ``"dead-beat"``, ``"scaled:RHO"`` (poles RHO times those of the model) or ``"poles:LIST"``, such as
        ``"poles:0.2,0.1+0.3i,0.1-0.3i"``.

    Examples
    --------
    >>> import asobench as ab
    >>> model = ab.Model(A=[1, -1.5, 0.7], B=[1.0, 0.5], nk=1)
    >>> ab.observer(model).run([1.0, 0.0], [0.0, 1.0]).shape
    (3, 2)
    """
    if not isinstance(model, Model):
        raise TypeError(f"model: {type(model).__name__}; expected a Model")
    if not isinstance(gain, str):
        raise TypeError(f"gain: {gain!r}; expected text such as 'dead-beat' or 'scaled:0.5'")
    _native.check_gain(gain)
    return Observer(model, gain)
