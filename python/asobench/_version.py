"""The version of a function: a digest of its bytecode and of all that this reaches."""

from __future__ import annotations

import builtins
import copyreg
import dis
import functools
import hashlib
import importlib
import importlib.machinery
import importlib.metadata
import importlib.util
import os
import pickle
import random
import sys
from collections.abc import Callable, Iterator
from types import (
    BuiltinFunctionType,
    CellType,
    CodeType,
    FunctionType,
    GetSetDescriptorType,
    MappingProxyType,
    MemberDescriptorType,
    MethodType,
    ModuleType,
)
from typing import Any

import numpy as np

from ._native import VERSION

#: The attributes of a class that are no text of its own, or differ from process to process.
NO_TEXT = {
    "__dict__", "__weakref__", "__module__", "__annotations__", "__annotate__", "__annotate_func__", "_abc_impl",
    "__annotations_cache__", "__static_attributes__", "__firstlineno__", "__dataclass_fields__",
}  # fmt: skip
#: Names that find what no bytecode names; the second ones only where modules of the user are reached.
DYNAMIC = ({"eval", "exec", "globals", "__import__", "import_module"}, {"getattr", "vars"})
#: Whose state changes with every call.
RANDOM = (random.Random, np.random.Generator, np.random.RandomState, np.random.BitGenerator)

#: A function with its results so far.
CACHE = type(functools.lru_cache(len))


class Version:
    """A function as it is now.

    Attributes
    ----------
    parts : dict
        Of the function, and of each global that it reaches, the digest.
    unknown : dict
        The values that no digest covers: their names, and why.
    """

    def __init__(self, function: Callable[..., Any] | None, options: Any) -> None:
        self.parts: dict[str, str] = {}
        self.unknown: dict[str, str] = {}
        self._queue: list[tuple[str, Any]] = [("", (function, options))]
        self._reached: set[tuple[int, str]] = set()
        self._set: set[str] = set()
        self._attributes: set[str] = set()
        self._dynamic: set[str] = set()
        self._modules: dict[str, ModuleType] = {}
        self._digests: dict[int, bytes] = {}
        self._kept: list[Any] = []
        self._label = ""
        while isinstance(function, (functools.partial, MethodType)):
            function = function.func if isinstance(function, functools.partial) else function.__func__
        #: The package of the function, whose text may change without its version.
        self._own = (
            str(function.__globals__.get("__name__")).partition(".")[0] if isinstance(function, FunctionType) else ""
        )
        while self._queue or self._of_modules():
            self._label, value = self._queue.pop()
            try:
                self.parts[self._label] = self._digest(value).hex()
            except Exception as error:
                self.parts[self._label] = self._cannot(f"cannot be read: {type(error).__name__}").hex()
        for label in self._set & self.parts.keys():
            self.parts[label] = ""
            self.unknown[label] = "a global that is set"
        for name in sorted(self._dynamic & set().union(*DYNAMIC[: 1 + bool(self._modules)])):
            self.unknown[name] = "finds others by their names"

    @property
    def text(self) -> str:
        """The digest of all."""
        return _sha(repr(sorted(self.parts.items())).encode()).hex()[:16]

    def _cannot(self, why: str) -> bytes:
        self.unknown.setdefault(self._label, why)
        return why.encode()

    # Values that are reached by names.

    def _global(self, scope: dict[str, Any], name: str) -> None:
        """Puts a global among what is to be read."""
        if (id(scope), name) in self._reached:
            return
        self._reached.add((id(scope), name))
        label = f"{scope.get('__name__', '')}.{name}"
        while label in self.parts or label in dict(self._queue):
            label += "'"
        if name in scope:
            self._queue.append((label, scope[name]))
        elif name in vars(builtins):
            self._dynamic.add(name)
        else:
            self.parts[label] = "missing"

    def _home(self, module: str) -> str | None:
        return None if module.partition(".")[0] == self._own else _home(module)

    def _module(self, module: ModuleType) -> str:
        """Where a module is from; what is used of one of the user is read."""
        home = self._home(module.__name__)
        if home is None:
            if _is_compiled(module.__name__):
                self._cannot("a C extension")
            self._modules[module.__name__] = module
        return home or ""

    def _of_modules(self) -> bool:
        """Puts what is used of the user's modules among what is to be read."""
        for module in list(self._modules.values()):
            for name in sorted(self._attributes & vars(module).keys()):
                self._global(vars(module), name)
        return bool(self._queue)

    def _names(self, function: FunctionType) -> None:
        """Looks at every name in the bytecode of a function, and of all code within it."""
        scope = function.__globals__
        for code in _codes(function.__code__):
            before: list[Any] = [0, 0]
            for step in dis.get_instructions(code):
                if step.opname in ("EXTENDED_ARG", "CACHE"):
                    continue
                if step.opname in ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS"):
                    self._global(scope, step.argval)
                elif step.opname in ("STORE_GLOBAL", "DELETE_GLOBAL"):
                    self._global(scope, step.argval)
                    self._set.add(f"{scope.get('__name__', '')}.{step.argval}")
                elif step.opname in ("LOAD_ATTR", "LOAD_METHOD", "IMPORT_FROM"):
                    self._attributes.add(step.argval)
                    self._dynamic |= {step.argval} & {"import_module"}
                elif step.opname == "IMPORT_NAME":
                    self._import(scope, step.argval, before[0])
                before = [before[1], step.argval]

    def _import(self, scope: dict[str, Any], name: str, level: int) -> None:
        """A module that the function imports when it runs."""
        try:
            if level:
                name = importlib.util.resolve_name("." * level + name, scope.get("__package__") or "")
            importlib.import_module(name)
        except Exception:
            self.parts[f"import {name}"] = "missing"
            return
        while name:
            self.parts[f"import {name}"] = self._module(sys.modules[name])
            name = name.rpartition(".")[0]

    # Values that are read.

    def _digest(self, value: Any) -> bytes:
        """The digest of a value; a value within itself is its place."""
        if value is None or value is ... or type(value) in (bool, float, complex):
            return repr(value).encode()
        if type(value) is int:
            return hex(value).encode()
        if type(value) is str:
            return _sha(b"str", value.encode("utf-8", "surrogatepass"))
        if id(value) not in self._digests:
            self._kept.append(value)
            self._digests[id(value)] = b"within itself"
            self._digests[id(value)] = _sha(type(value).__qualname__.encode(), *self._read(value))
        return self._digests[id(value)]

    def _all(self, *values: Any) -> Iterator[bytes]:
        return map(self._digest, values)

    def _read(self, value: Any) -> Iterator[Any]:
        """The parts that make a value."""
        kind = type(value)
        if kind in READERS:
            return READERS[kind](self, value)
        if isinstance(value, type):
            return self._class(value)
        if isinstance(value, ModuleType):
            return iter([value.__name__.encode(), self._module(value).encode()])
        if isinstance(value, RANDOM):
            return iter([self._cannot("a generator of random numbers")])
        if str(kind.__module__).partition(".")[0] in ("ctypes", "_ctypes"):
            return iter([self._cannot(f"of {kind.__module__}.{kind.__qualname__}")])
        if isinstance(value, np.generic):
            return self._array(np.asarray(value))
        if hasattr(kind, "reached_by_version"):
            return self._all(*value.reached_by_version)
        if isinstance(value, functools.cached_property):
            return self._all(value.func)
        if kind is CACHE:
            return self._all(value.__wrapped__)
        return self._object(value)

    def _object(self, value: Any) -> Iterator[bytes]:
        """An object as it would be pickled, but with the text of its class."""
        try:
            reduce = copyreg.dispatch_table.get(type(value))
            reduced: Any = reduce(value) if reduce else value.__reduce_ex__(4)
            if isinstance(reduced, str):
                module = pickle.whichmodule(value, reduced)  # type: ignore[attr-defined]
                home = self._home(module)
                if home and functools.reduce(getattr, reduced.split("."), sys.modules[module]) is value:
                    return iter([home.encode(), reduced.encode()])
                raise TypeError
            return self._all(*(list(part) if hasattr(part, "__next__") else part for part in reduced))
        except RecursionError:
            raise
        except Exception:
            return iter([self._cannot(f"of {type(value).__module__}.{type(value).__qualname__}")])

    def _function(self, function: FunctionType) -> Iterator[bytes]:
        module = str(function.__globals__.get("__name__"))
        home = self._home(module)
        if home:
            yield f"{home} {module} {function.__qualname__}".encode()
            if _named(module, function.__qualname__) is function:
                return
        else:
            self._names(function)
            yield self._digest(function.__code__)
        yield from self._all(function.__defaults__, function.__kwdefaults__, function.__closure__, vars(function))

    def _builtin(self, function: Any) -> Iterator[bytes]:
        owner = function.__self__
        home = self._home(function.__module__ or "") if owner is None or isinstance(owner, ModuleType) else ""
        yield f"{home} {function.__module__} {function.__qualname__}".encode()
        if home is None:
            yield self._cannot("of a C extension")
        elif home == "":
            yield self._digest(owner)

    def _class(self, of: type) -> Iterator[bytes]:
        home = self._home(of.__module__)
        yield f"{home} {of.__module__} {of.__qualname__}".encode()
        # A class of a text without a name has the module of Python's own.
        if home and (of.__module__ != "builtins" or _named("builtins", of.__qualname__) is of):
            return
        if _is_compiled(of.__module__):
            yield self._cannot("of a C extension")
        yield from self._all(type(of), of.__bases__)
        for name, value in sorted(vars(of).items()):
            if name not in NO_TEXT:
                yield from self._all(name, value)

    def _code(self, code: CodeType) -> Iterator[bytes]:
        counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        yield code.co_code
        yield repr((counts, names)).encode()
        yield getattr(code, "co_exceptiontable", b"")
        yield from self._all(*code.co_consts)

    def _cell(self, cell: CellType) -> Iterator[bytes]:
        try:
            return self._all(cell.cell_contents)
        except ValueError:
            return iter([b"empty"])

    def _array(self, array: Any) -> Iterator[Any]:
        """An array with all its bytes, of padding none."""
        yield repr((array.dtype.str, array.shape)).encode()
        if array.dtype.fields:
            yield from self._all(*((name, array[name]) for name in array.dtype.names))
        elif array.dtype.hasobject or array.dtype.kind == "T":
            yield from self._all(*array.ravel().tolist())
        elif array.dtype.char in "gG":
            high = array.astype(array.dtype.char.replace("g", "d").replace("G", "D"))
            yield from self._all(high, (array - high).astype(high.dtype))
        elif array.nbytes:
            yield np.ascontiguousarray(array).reshape(-1).view(np.uint8)


#: How values of a type are read.
READERS: dict[type, Callable[[Version, Any], Iterator[Any]]] = {
    FunctionType: Version._function,
    BuiltinFunctionType: Version._builtin,
    CodeType: Version._code,
    CellType: Version._cell,
    MethodType: lambda self, of: self._all(of.__func__, of.__self__),
    np.ndarray: Version._array,
    tuple: lambda self, of: self._all(*of),
    list: lambda self, of: self._all(*of),
    dict: lambda self, of: self._all(*(part for item in of.items() for part in item)),
    MappingProxyType: lambda self, of: self._all(dict(of)),
    set: lambda self, of: iter(sorted(self._all(*of))),
    frozenset: lambda self, of: iter(sorted(self._all(*of))),
    bytes: lambda self, of: iter([of]),
    bytearray: lambda self, of: iter([of]),
    memoryview: lambda self, of: iter([of.tobytes()]),
    property: lambda self, of: self._all(of.fget, of.fset, of.fdel),
    staticmethod: lambda self, of: self._all(of.__func__),
    classmethod: lambda self, of: self._all(of.__func__),
    MemberDescriptorType: lambda self, of: iter([of.__name__.encode()]),
    GetSetDescriptorType: lambda self, of: iter([of.__name__.encode()]),
}


def _sha(*parts: Any) -> bytes:
    """The digest of parts, each with its length."""
    to = hashlib.sha256()
    for part in parts:
        to.update(str(len(part)).encode() + b":")
        to.update(part)
    return to.digest()


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object with all that are nested in it: comprehensions, lambdas, generators, functions, classes."""
    yield code
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from _codes(part)


def _named(module: str, name: str) -> Any:
    """The value of a name in a module; None if there is none."""
    of: Any = sys.modules.get(module)
    for part in name.split("."):
        of = getattr(of, part, None)
    return of


def _file(module: str) -> str:
    return str(getattr(sys.modules.get(module), "__file__", None) or "")


def _is_compiled(module: str) -> bool:
    return _file(module).endswith(tuple(importlib.machinery.EXTENSION_SUFFIXES))


def _home(module: str) -> str | None:
    """Python, or the package with its version, that a module is from; None of the user's own."""
    python = f"python {sys.version_info[0]}.{sys.version_info[1]}"
    top, file = module.partition(".")[0], _file(module)
    if top == __package__:
        return f"{top} {VERSION}"
    if {"site-packages", "dist-packages"} & set(file.split(os.sep)):
        return _distribution(top)
    if file.startswith(os.path.dirname(os.__file__) + os.sep) or top in sys.builtin_module_names:
        return python
    return python if not file and top in sys.stdlib_module_names else None


@functools.cache
def _distribution(top: str) -> str | None:
    """The package that is installed under a name, with its version."""
    try:
        return f"{top} {importlib.metadata.version(top)}"
    except importlib.metadata.PackageNotFoundError:
        packages = importlib.metadata.packages_distributions().get(top, [])
    found = [f"{name} {importlib.metadata.version(name)}" for name in sorted(set(packages))]
    version = getattr(sys.modules.get(top), "__version__", None)
    return ", ".join(found) or (f"{top} {version}" if version else None)
