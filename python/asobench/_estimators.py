"""The estimators of the registry as functions; nothing here knows one by name."""

from __future__ import annotations

import difflib
import inspect
import json
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Vector, signal, whole
from ._model import Model

COEFFICIENTS = ("na", "nb", "nc", "nd", "nf")


@cache
def registry() -> dict[str, dict[str, Any]]:
    """The facts of each estimator: "about", and "options" with "about", "default" and "schema" of each."""
    entries = json.loads(_native.estimators())
    return {
        entry["name"]: {"about": entry["about"], "options": {option.pop("key"): option for option in entry["options"]}}
        for entry in entries
    }


def estimate(
    u: ArrayLike | Sequence[ArrayLike], y: ArrayLike | Sequence[ArrayLike], estimator: str = "arx", **options: Any
) -> Model:
    """Estimates a model of a record: ``A(q) y = B(q)/F(q) u + C(q)/D(q) e``.

    Nothing is subtracted from the record, and no estimate is replaced by another. The result equals that of
    ``asobench estimate`` bit for bit. The model keeps a copy of the record.

    Parameters
    ----------
    u, y : array_like, (N,)
        Input and output: real finite numbers. Contiguous arrays of doubles are read without a copy. Two lists of arrays
        are records of one plant, each with a start of its own, for arx, iv, oe, armax and bj: the model keeps none.
    estimator : str
        A name of :data:`asobench.estimators`, such as ``"arx"``, ``"oe"``, ``"iv"``.
    na, nb, nc, nd, nf : int, optional
        Orders: the numbers of coefficients of A, B, C, D, F.
    nk : int
        The delay in samples; 1 if left out.
    order : int, optional
        Instead of orders: n for na = nb = n, or what the estimator makes of n.
    orders : str, optional
        Instead of both, as text: ``"nb=2,nf=2,nk=1"``.
    **options
        The estimator's own: ``help(asobench.estimators.oe)``.

    Returns
    -------
    Model

    Raises
    ------
    TypeError, ValueError
        Of arguments that do not fit, in one line.
    EstimateFailed
        Where the calculation has no model, such as of a singular record.

    Examples
    --------
    >>> import asobench as ab, numpy as np
    >>> u = np.tile([1.0, 1.0, -1.0, 1.0, -1.0, -1.0, -1.0], 20)
    >>> y = ab.Model(B=[2.0], F=[1, -0.5], nk=1).simulate(u)
    >>> model = ab.estimate(u, y, "oe", nb=1, nf=1, nk=1)
    >>> np.allclose(model.params, [2, -0.5])
    True
    """
    given, order, delay = _request(estimator, options)
    record: tuple[Vector, Vector] | None = None
    lengths: list[int] = []
    if _is_several(u) or _is_several(y):
        u, y, lengths = _joined(u, y)
    else:
        u, kept_u = _kept("u", u)
        y, kept_y = _kept("y", y)
        record = kept_u, kept_y
    native, made = _native.estimate(estimator, json.dumps(given, default=_plain), order, delay, u, y, lengths)
    if made is not None:
        given["orders"] = made
    return Model._of(native, estimator, given, record)


def _is_several(given: Any) -> bool:
    """Whether a list of signals is given, and not one signal."""
    return isinstance(given, (list, tuple)) and len(given) > 0 and all(np.ndim(part) == 1 for part in given)


def _joined(u: Any, y: Any) -> tuple[Vector, Vector, list[int]]:
    """Records that follow each other, with their lengths."""
    if not (_is_several(u) and _is_several(y) and len(u) == len(y)):
        raise ValueError("u, y: several records; expected two lists of as many arrays")
    of_u, of_y = ([signal(f"{name}[{i}]", part) for i, part in enumerate(of)] for name, of in (("u", u), ("y", y)))
    for i, (one, other) in enumerate(zip(of_u, of_y, strict=True)):
        if len(one) != len(other):
            raise ValueError(f"u[{i}] has {len(one)} samples and y[{i}] has {len(other)}; expected equal lengths")
    return np.concatenate(of_u), np.concatenate(of_y), [len(part) for part in of_y]


def _kept(name: str, given: Any) -> tuple[Vector, Vector]:
    """A signal as it is, and one that nobody else changes."""
    if type(given) is np.ndarray and given.dtype == np.float64 and given.ndim == 1 and given.flags.c_contiguous:
        return given, given.copy()
    made = signal(name, given)
    return made, made


def _request(estimator: str, options: dict[str, Any]) -> tuple[dict[str, Any], int, int]:
    """The options, the order and the delay."""
    if not isinstance(estimator, str):
        raise TypeError(f"estimator: {estimator!r}; expected a name such as 'arx'")
    known = registry().get(estimator)
    if known is None:
        near = difflib.get_close_matches(estimator.lower(), [*registry()], 1)
        if near:
            raise ValueError(f"estimator: unknown estimator {estimator!r}; did you mean {near[0]!r}?")
        _native.describe(estimator, "{}")
        raise ValueError(f"estimator: {estimator!r}")
    options = dict(options)
    order, nk = options.pop("order", None), options.pop("nk", None)
    counts = {name: options.pop(name) for name in COEFFICIENTS if options.get(name) is not None}
    takes = known["options"]
    unknown = next((key for key in options if key not in takes), None)
    if unknown is not None:
        near = difflib.get_close_matches(unknown, [*takes, *COEFFICIENTS, "nk", "order"], 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise TypeError(f"{estimator}: unknown option {unknown!r}; {hint}{estimator} takes {', '.join(takes)}")
    options = {key: value for key, value in options.items() if value is not None}
    delay = 1 if nk is None else whole("nk", nk, 0)
    ways = sum((order is not None, bool(counts), "orders" in options))
    if ways > 1 or ("orders" in options and nk is not None):
        raise TypeError("order, na ... nf with nk, or orders: expected one of the three ways")
    if not ways:
        way = "orders such as na=2, nb=2, nk=1" if "orders" in takes else "order=n"
        raise TypeError(f"{estimator}: expected {way}")
    if order is None and not counts:
        return {**options, "orders": _orders_text(options["orders"])}, 0, delay
    if order is not None:
        order = whole("order", order, 1)
        if delay == 0 and "orders" not in takes:
            raise ValueError(f"nk: 0; {estimator} has a delay of at least 1")
        return options, order, delay
    counts = {name: whole(name, count, 0) for name, count in counts.items()}
    if "orders" in takes:
        text = ",".join(f"{name}={count}" for name, count in {**counts, "nk": delay}.items())
        return {**options, "orders": text}, 0, delay
    if set(counts) != {"na", "nb"} or counts["na"] != counts["nb"]:
        raise TypeError(f"{estimator}: expected order=n; it has na = nb = n")
    return options, whole("na", counts["na"], 1), delay


def _orders_text(given: Any) -> Any:
    """Orders as text; of a dict such as dict(na=2, nb=2)."""
    if isinstance(given, dict):
        return ",".join(f"{name}={count}" for name, count in given.items())
    if not isinstance(given, str):
        raise TypeError(f"orders: {given!r}; expected text such as 'na=2,nb=2,nk=1', or na=2, nb=2, nk=1 as arguments")
    return given


def _plain(value: Any) -> Any:
    """NumPy's values for JSON."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{value!r} is no value of an option")


class Estimators:
    """The estimators, each a function with its own options: ``ab.estimators.oe(u, y, nb=2, nf=2, starts=3)``.

    Examples
    --------
    >>> import asobench as ab
    >>> "arx" in list(ab.estimators)
    True
    >>> print(ab.estimators.arx.__doc__.splitlines()[0])
    Least squares for any orders: na, nb and the delay nk.
    """

    def __getattr__(self, name: str) -> Callable[..., Model]:
        estimator = name.replace("_", "-")
        if name.startswith("__") or estimator not in registry():
            raise AttributeError(f"no estimator {name!r}; expected one of {', '.join(self)}")
        function = _function(estimator)
        setattr(self, name, function)
        return function

    def __iter__(self) -> Any:
        return iter(registry())

    def __len__(self) -> int:
        return len(registry())

    def __getitem__(self, name: str) -> Callable[..., Model]:
        if name not in registry():
            raise KeyError(name)
        return getattr(self, name.replace("-", "_"))  # type: ignore[no-any-return]

    def __dir__(self) -> list[str]:
        return [name.replace("-", "_") for name in registry()]

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {entry['about']}" for name, entry in registry().items())


def _function(estimator: str) -> Callable[..., Model]:
    """The function of an estimator, with the signature and the docs that the registry gives."""
    entry = registry()[estimator]

    def function(u: ArrayLike, y: ArrayLike, **options: Any) -> Model:
        return estimate(u, y, estimator, **options)

    kind = inspect.Parameter
    own = {key: option["default"] for key, option in entry["options"].items()}
    names = {**dict.fromkeys(("order", "nk", *COEFFICIENTS)), **own}
    parameters = [kind(name, kind.POSITIONAL_OR_KEYWORD) for name in "uy"]
    parameters += [kind(name, kind.KEYWORD_ONLY, default=default) for name, default in names.items()]
    function.__name__ = function.__qualname__ = estimator.replace("-", "_")
    function.__signature__ = inspect.Signature(parameters, return_annotation=Model)  # type: ignore[attr-defined]
    lines = [entry["about"], "", "Parameters", "----------", "u, y : array_like, (N,)"]
    lines += ["order, na, nb, nc, nd, nf, nk : int, optional", "    As of :func:`asobench.estimate`."]
    for key, option in entry["options"].items():
        default = "" if option["default"] is None else f", default {option['default']!r}"
        lines += [f"{key} : {_kind(option['schema'])}{default}", f"    {option['about']}"]
    function.__doc__ = "\n".join(lines)
    return function


def _kind(schema: dict[str, Any]) -> str:
    """A JSON schema in a word."""
    values = [value for value in schema.get("enum", []) if value is not None]
    if values:
        return "{" + ", ".join(map(repr, values)) + "}"
    kinds = schema.get("type", "str")
    kinds = [kinds] if isinstance(kinds, str) else kinds
    names = {"integer": "int", "number": "float", "string": "str", "array": "list", "boolean": "bool", "object": "dict"}
    return " or ".join(names.get(kind, kind) for kind in kinds if kind != "null")


estimators = Estimators()
