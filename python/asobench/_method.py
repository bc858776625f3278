"""Functions as methods of studies."""

from __future__ import annotations

import inspect
import json
import os
import signal
import socket
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, overload

import numpy as np

from ._arrays import whole
from ._model import PARTS, Model
from ._version import Version
from ._worker import answer

#: The data that a function may ask for by the name of an argument.
TOLD = ("u", "y", "r", "na", "nb", "nc", "nd", "nf", "nk", "order", "samples", "sampling", "loop", "trial", "seed")

#: The process that the program starts: it hands bytes on between the program and this Python.
RELAY = """
import os, select, socket, sys
here = socket.socket(socket.AF_UNIX)
os.chdir(os.environ["ASOBENCH_RELAY"])
here.connect("door")
here.sendall(os.fsencode(sys.argv[1]).hex().encode() + b"\\n")
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

#: Keys of an experiment file that a function sets itself.
OWN_KEYS = ("command", "workers", "worker", "estimator")
#: Seconds that copies of this process have to say what changed in them.
LAST_WORDS = 1.0


def command(name: str) -> list[str]:
    """The program that is a function's method: Python apart from its environment and the current folder."""
    return [sys.executable, "-I", "-S", "-c", RELAY, name]


def consent(methods: Sequence[Answering]) -> list[str]:
    """The flags that agree to the commands of functions, and to no other."""
    return [word for method in methods for word in ("--allow-command", json.dumps(command(method.name)))]


class Answering(Protocol):
    """The answers that a relay can ask for."""

    name: str
    processes: int | None
    single: bool

    def ready(self) -> dict[str, Any]: ...
    def changes(self) -> list[str]: ...
    def say_changed(self, labels: Sequence[str]) -> None: ...
    def reply(self, u: Any, y: Any, r: Any, setting: Mapping[str, Any]) -> dict[str, Any]: ...


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
        if not isinstance(name, str):
            raise TypeError(f"name: {name!r}; expected text")
        for key in OWN_KEYS:
            if key in keys:
                raise TypeError(f"method {name}: key {key!r}; a function sets it itself")
        if version is not None and not (0 < len(str(version)) <= 80 and str(version).isprintable()):
            raise ValueError(f"version: {str(version)[:80]!r}; expected 1 to 80 visible characters")
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
        self._given_version = None if version is None else str(version)
        self._running: Version | None = None
        self._said: set[str] = set()
        self.__doc__, self.__name__ = function.__doc__, name

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self.function(*arguments, **options)

    def having(self, name: str | None = None, **options: Any) -> Method:
        """The same method with other options, under a name of its own."""
        values = {**{k: v for k, v in self.options.items() if v is not inspect.Parameter.empty}, **options}
        label = name or self.name + "".join(f"-{key}-{value}" for key, value in options.items())
        other = Method(
            self.function, label, self._given_version, self.batch, self.processes, self.timeout, self.keys, values
        )
        other._said = self._said
        return other

    def table(self) -> dict[str, Any]:
        """The method as an entry of an experiment file."""
        workers = {"workers": self.processes or 1}
        return {
            "name": self.name,
            "command": command(self.name),
            "batch": self.batch,
            "timeout": self.timeout,
            **workers,
            **self.keys,
        }

    #: Whether it is given one record after the other.
    single = True

    @property
    def reached_by_version(self) -> tuple[Any, ...]:
        """The values that belong to the version of a function that calls this method."""
        return self._given_version or self.function, self.options

    @property
    def version(self) -> str:
        """The version as it is now: the given one, or a digest of what the function reaches; with its options."""
        return self._text(self._now())

    def _now(self) -> Version:
        return Version(self.function if self._given_version is None else None, self.options)

    def _text(self, of: Version) -> str:
        if self._given_version is None:
            return of.text
        return f"{self._given_version} {of.text[:8]}" if self.options else self._given_version

    def ready(self) -> dict[str, Any]:
        """The answer to hello while a study runs; a word on what its version does not cover."""
        self._running = self._now()
        unknown = {f"{label or self.name} ({why})" for label, why in self._running.unknown.items()} - self._said
        if unknown:
            warnings.warn(
                f"method {self.name}: its version does not cover {', '.join(sorted(unknown))}: results are taken up "
                "when that has changed, unless version= says so",
                stacklevel=4,
            )
            self._said |= unknown
        return {
            "frame": "ready",
            "protocol": 1,
            "name": self.name[:100],
            "version": self._text(self._running),
            "returns": "polynomials",
            "deterministic": True,
        }

    def changes(self) -> list[str]:
        """The parts of the version that have changed since the study began to run."""
        before, now = self._running, self._now()
        labels = {*now.parts, *(before.parts if before else ())}
        changed = {label or self.name for label in labels if before and before.parts.get(label) != now.parts.get(label)}
        return sorted(changed - self._said)

    def say_changed(self, labels: Sequence[str]) -> None:
        """A word on what changed while a study ran."""
        if labels:
            warnings.warn(
                f"method {self.name}: {', '.join(labels)} changed while the study ran, and its version with it; "
                "expected what is constant, or version=",
                stacklevel=5,
            )
        self._said |= set(labels)

    def reply(self, u: Any, y: Any, r: Any, setting: Mapping[str, Any]) -> dict[str, Any]:
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
        Results of another version, or of other options, are not taken up. If left out, the version is a digest of
        the bytecode, of the globals, closures and defaults that this names, and of the functions and classes that are
        reached through them; installed packages count by their versions. A warning names what it cannot cover.
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
    name = name or getattr(function, "__name__", None)
    if name is None:
        raise TypeError(f"method: {type(function).__name__}; expected name=, since it has none of its own")
    batch = whole("batch", batch, 1)
    processes = None if processes is None else whole("processes", processes, 1)
    return Method(function, name, version, batch, processes, timeout, keys, {})


class Relay:
    """Where the program's relays find the functions, while a study runs."""

    def __init__(self, methods: Sequence[Answering]) -> None:
        self.methods = list(methods)
        self.children: list[int] = []

    def __enter__(self) -> dict[str, str]:
        if not self.methods:
            return {}
        self.ready = [method.ready() for method in self.methods]
        self.place = tempfile.TemporaryDirectory(prefix="asobench-", ignore_cleanup_errors=True)
        self.folder = Path(self.place.name)
        self.door = socket.socket(socket.AF_UNIX)
        place = os.open(self.folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            # A door's path is short; that of the folder may be long.
            self.door.bind(f"/proc/self/fd/{place}/door")
        finally:
            os.close(place)
        self.door.listen(64)
        self.porter = threading.Thread(target=self._accept, daemon=True)
        self.porter.start()
        return {"ASOBENCH_RELAY": str(self.folder)}

    def __exit__(self, *_: Any) -> None:
        if not self.methods:
            return
        self.door.shutdown(socket.SHUT_RDWR)
        self.porter.join(LAST_WORDS)
        self.door.close()
        until = time.monotonic() + LAST_WORDS
        for child in self.children:
            while not os.waitpid(child, os.WNOHANG)[0]:
                if time.monotonic() > until:
                    os.kill(child, signal.SIGKILL)  # the program has all answers; one may hang in its function
                    os.waitpid(child, 0)
                    break
                time.sleep(0.01)
        self._warn()
        self.place.cleanup()

    def _accept(self) -> None:
        while True:
            try:
                line, _ = self.door.accept()
            except OSError:
                return
            name = bytes.fromhex(line.makefile("rb", 0).readline().decode()).decode()
            at = next((at for at, method in enumerate(self.methods) if method.name == name), None)
            if at is None:
                line.close()
            elif self.methods[at].processes:
                self._fork(at, line)
            else:
                threading.Thread(target=self._serve, args=(at, line), daemon=True).start()

    def _fork(self, at: int, line: socket.socket) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child:
            self.children.append(child)
            line.close()
            return
        try:
            self._serve(at, line)
            self._note(at, "changed", "\n".join(self.methods[at].changes()))
        finally:
            os._exit(0)

    def _note(self, at: int, about: str, text: str) -> None:
        """Leaves a text about a method, whose name is none of a file."""
        path = self.folder / f"{at}-{about}-{os.getpid()}"
        path.write_text(text, encoding="utf-8", errors="backslashreplace")

    def _serve(self, at: int, line: socket.socket) -> None:
        method = self.methods[at]
        first: list[int] = []

        def on_error(trial: int) -> None:
            if not first or trial < first[0]:
                first[:] = [trial]
                self._note(at, f"error-{trial:020d}", traceback.format_exc())

        with line, line.makefile("rb") as requests, line.makefile("wb") as replies:
            try:
                answer(method.reply, self.ready[at], method.single, requests, replies, on_error)
            except (BrokenPipeError, ConnectionResetError):
                pass
            except Exception:
                self._note(at, "error-", traceback.format_exc())

    def _notes(self, at: int, about: str) -> list[tuple[str, str]]:
        """The texts about a method, with the rest of their names."""
        found = sorted(self.folder.glob(f"{at}-{about}-*"))
        return [(path.name.split("-")[2], path.read_text(encoding="utf-8")) for path in found]

    def _warn(self) -> None:
        for at, method in enumerate(self.methods):
            errors = self._notes(at, "error")
            if errors:
                number, text = errors[0]
                where = f"trial {int(number)} (the first)" if number else "a message"
                warnings.warn(f"method {method.name}: {where} failed:\n{text}", stacklevel=4)
            changed = {
                *method.changes(),
                *(label for _, text in self._notes(at, "changed") for label in text.split("\n")),
            }
            method.say_changed(sorted(changed - {""}))
