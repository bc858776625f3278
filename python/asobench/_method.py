"""Functions as methods of studies."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import shutil
import signal
import socket
import sys
import tempfile
import textwrap
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import FunctionType
from typing import Any, overload

import numpy as np

from ._arrays import whole
from ._model import PARTS, Model
from ._worker import answer

#: What a function may ask for by the name of an argument.
TOLD = ("u", "y", "r", "na", "nb", "nc", "nd", "nf", "nk", "order", "samples", "sampling", "loop", "trial", "seed")

#: The process that the program starts: it hands bytes on between the program and this Python.
RELAY = """
import os, select, socket, sys
here = socket.socket(socket.AF_UNIX)
here.connect(os.environ["ASOBENCH_RELAY"])
here.sendall(sys.argv[1].encode() + b"\\n")
requests = os.open(os.environ["ASOBENCH_REQUESTS"], os.O_RDONLY)
replies = os.open(os.environ["ASOBENCH_REPLIES"], os.O_WRONLY)
while True:
    ready = select.select([requests, here], [], [])[0]
    if here in ready:
        data = here.recv(1 << 20)
        if not data: break
        while data: data = data[os.write(replies, data):]
    if requests in ready:
        data = os.read(requests, 1 << 20)
        if not data: break
        here.sendall(data)
"""


class Method:
    """A function that is a method of studies; :func:`method` makes one. It can still be called as a function."""

    def __init__(
        self,
        function: Callable[..., Any],
        name: str,
        version: str | None,
        batch: int,
        processes: int | None,
        timeout: float,
        keys: Mapping[str, Any],
        options: Mapping[str, Any],
    ) -> None:
        parameters = inspect.signature(function).parameters
        own = {}
        for parameter in parameters.values():
            if parameter.kind in (parameter.VAR_POSITIONAL, parameter.POSITIONAL_ONLY):
                raise TypeError(f"method {name}: argument {parameter.name}; expected arguments with names")
            if parameter.name in TOLD or parameter.kind == parameter.VAR_KEYWORD:
                continue
            if parameter.default is parameter.empty and parameter.name not in options:
                raise TypeError(
                    f"method {name}: argument {parameter.name} has no default and is none of {', '.join(TOLD)}"
                )
            own[parameter.name] = parameter.default
        unknown = next((key for key in options if key not in own), None)
        if unknown is not None:
            raise TypeError(f"method {name}: no option {unknown!r}; expected {', '.join(own) or 'none'}")
        self.function, self.name, self.batch, self.processes = function, name, batch, processes
        self.timeout, self.keys, self.options = timeout, dict(keys), {**own, **options}
        self._told = [key for key in TOLD if key in parameters]
        self._given_version = version
        self.version = version or _identity(function, self.options)
        self.__doc__, self.__name__ = function.__doc__, name

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self.function(*arguments, **options)

    def having(self, name: str | None = None, **options: Any) -> Method:
        """The same method with other options, under a name of its own."""
        values = {**{k: v for k, v in self.options.items() if v is not inspect.Parameter.empty}, **options}
        label = name or self.name + "".join(f"-{key}-{value}" for key, value in options.items())
        return Method(
            self.function, label, self._given_version, self.batch, self.processes, self.timeout, self.keys, values
        )

    def table(self) -> dict[str, Any]:
        """The method as an entry of an experiment file."""
        command = [sys.executable, "-S", "-E", "-c", RELAY, self.name]
        workers = {"workers": self.processes or 1}
        return {
            "name": self.name,
            "command": command,
            "batch": self.batch,
            "timeout": self.timeout,
            **workers,
            **self.keys,
        }

    def ready(self) -> dict[str, Any]:
        """What it answers to hello."""
        return {
            "frame": "ready",
            "protocol": 1,
            "name": self.name,
            "version": self.version,
            "returns": "polynomials",
            "deterministic": True,
        }

    def of_record(self, u: Any, y: Any, r: Any, setting: Mapping[str, Any]) -> dict[str, Any]:
        """The reply of one record."""
        known = {"u": u, "y": y, "r": r, **setting}
        found = self.function(**{key: known[key] for key in self._told}, **self.options)
        return _parts(found) if isinstance(found, Model) else found


def _parts(model: Model) -> dict[str, Any]:
    """A model as the protocol has it."""
    parts: dict[str, Any] = {}
    for key in PARTS:
        free = getattr(model, key)[model.nk if key == "B" else 1 :]
        if free.size or key in "AB":
            parts[key] = free
    parts["nk"] = model.nk
    if np.isfinite(model.noise_variance):
        parts["noise_variance"] = model.noise_variance
    if model.cov is not None:
        parts["covariance"] = model.cov
    return parts


@overload
def method(function: Callable[..., Any]) -> Method: ...
@overload
def method(
    *,
    name: str | None = ...,
    version: str | None = ...,
    batch: int = ...,
    processes: int | None = ...,
    timeout: float = ...,
    **keys: Any,
) -> Callable[[Callable[..., Any]], Method]: ...


def method(
    function: Callable[..., Any] | None = None,
    *,
    name: str | None = None,
    version: str | None = None,
    batch: int = 64,
    processes: int | None = None,
    timeout: float = 60,
    **keys: Any,
) -> Any:
    """Makes a method of studies of a function of one record.

    Parameters
    ----------
    function : callable
        Its arguments are what it wants to know, by their names: ``u``, ``y``, ``r`` (the reference of a closed loop),
        each (N,); the orders asked for, ``na`` ... ``nf`` and ``nk``; ``order``, ``samples``, ``sampling``, ``loop``,
        ``trial`` and ``seed``. All others have defaults: they are its options. It returns a :class:`Model`, or a dict
        of free coefficients as :func:`worker` has it. It may raise :class:`Declined`, with a reason or without. Any
        other exception is a failure of that record, with its name and message as the reason.
    name : str, optional
        The name in results; that of the function if left out.
    version : str, optional
        Results of another version are not taken up. If left out, it follows from the text of the function, of the
        functions of its module that it calls, and from the options.
    batch : int
        Records in a message. All models of a message have the same orders; with 1 each record may have its own.
    processes : int, optional
        So many copies of this process compute the records, each apart from the others. If left out, this process does.
    timeout : float
        Seconds for a message. A function that runs in this process goes on after it.
    **keys
        Other keys of a method in experiment files, such as ``orders`` and ``observer``.

    Examples
    --------
    >>> import asobench as ab, numpy as np
    >>> @ab.method
    ... def mine(u, y, na, nb, nk, ridge=0.0):
    ...     k = np.arange(max(na, nb + nk - 1), len(y))[:, None]
    ...     phi = np.hstack([-y[k - np.arange(1, na + 1)], u[k - nk - np.arange(nb)]])
    ...     theta = np.linalg.solve(phi.T @ phi + ridge * np.eye(na + nb), phi.T @ y[k[:, 0]])
    ...     return ab.Model(A=[1, *theta[:na]], B=theta[na:], nk=nk)
    >>> study = ab.Study(settings={"eta": 10, "window": 98}, methods=["arx", mine, mine.having(ridge=5.0)])
    """
    if function is None:
        return lambda of: _made(of, name, version, batch, processes, timeout, keys)
    return _made(function, name, version, batch, processes, timeout, keys)


def _made(
    function: Callable[..., Any],
    name: str | None,
    version: str | None,
    batch: int,
    processes: int | None,
    timeout: float,
    keys: Mapping[str, Any],
) -> Method:
    if not callable(function) or inspect.isclass(function):
        raise TypeError(f"method: {function!r}; expected a function")
    batch = whole("batch", batch, 1)
    processes = None if processes is None else whole("processes", processes, 1)
    return Method(function, name or function.__name__, version, batch, processes, timeout, keys, {})


def _identity(function: Callable[..., Any], options: Mapping[str, Any]) -> str:
    """A digest of a function, of the functions beside it that it calls, and of its options."""
    texts: dict[str, str] = {}

    def add(of: Any) -> None:
        key = f"{of.__module__}.{of.__qualname__}"
        if key in texts:
            return
        try:
            texts[key] = textwrap.dedent(inspect.getsource(of))
        except (OSError, TypeError):
            texts[key] = repr((of.__code__.co_code, of.__code__.co_consts)) if isinstance(of, FunctionType) else key
        for name in of.__code__.co_names if isinstance(of, FunctionType) else ():
            called = of.__globals__.get(name)
            if isinstance(called, FunctionType) and called.__module__ == of.__module__:
                add(called)

    add(function)
    cells = [repr(cell.cell_contents) for cell in getattr(function, "__closure__", None) or ()]
    text = json.dumps([texts, cells, {key: repr(value) for key, value in options.items()}], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class Relay:
    """Where the program's relays find the functions, while a study runs."""

    def __init__(self, methods: Sequence[Method]) -> None:
        self.methods = {method.name: method for method in methods}
        self.folder = Path(tempfile.mkdtemp(prefix="asobench-"))
        self.children: list[int] = []

    def __enter__(self) -> dict[str, str]:
        if not self.methods:
            return {}
        self.door = socket.socket(socket.AF_UNIX)
        self.door.bind(str(self.folder / "door"))
        self.door.listen(64)
        threading.Thread(target=self._accept, daemon=True).start()
        return {"ASOBENCH_RELAY": str(self.folder / "door")}

    def __exit__(self, *_: Any) -> None:
        if self.methods:
            self.door.close()
            for child in self.children:
                os.kill(child, signal.SIGKILL)  # the program has all answers; one may hang in its function
                os.waitpid(child, 0)
            self._warn()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _accept(self) -> None:
        while True:
            try:
                line, _ = self.door.accept()
            except OSError:
                return
            name = line.makefile("rb", 0).readline().decode().strip()
            method = self.methods.get(name)
            if method is None:
                line.close()
            elif method.processes:
                self._fork(method, line)
            else:
                threading.Thread(target=self._serve, args=(method, line), daemon=True).start()

    def _fork(self, method: Method, line: socket.socket) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child:
            self.children.append(child)
            line.close()
            return
        try:
            self._serve(method, line)
        finally:
            os._exit(0)

    def _serve(self, method: Method, line: socket.socket) -> None:
        first: list[int] = []

        def on_error(trial: int) -> None:
            if not first or trial < first[0]:
                first[:] = [trial]
                (self.folder / f"{method.name}.{trial:020d}").write_text(traceback.format_exc())

        with line, line.makefile("rb") as requests, line.makefile("wb") as replies:
            try:
                answer(method.of_record, method.ready(), True, requests, replies, on_error)
            except (BrokenPipeError, ConnectionResetError):
                pass
            except Exception:
                (self.folder / f"{method.name}.").write_text(traceback.format_exc())

    def errors(self) -> Iterator[tuple[str, int | None, str]]:
        """Of each method with exceptions: its name, the first trial, and the traceback."""
        for name in self.methods:
            found = sorted(self.folder.glob(f"{name}.*"))
            if found:
                number = found[0].name.rpartition(".")[2]
                yield name, int(number) if number else None, found[0].read_text()

    def _warn(self) -> None:
        for name, trial, text in self.errors():
            where = "a message" if trial is None else f"trial {trial} (the first)"
            warnings.warn(f"method {name}: {where} failed:\n{text}", stacklevel=4)
