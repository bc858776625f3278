"""The version of a function: what changes it, what does not, and what it says that it cannot cover."""

import importlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import textwrap
import unittest
import warnings
from pathlib import Path

import asobench as ab

#: Functions `f` of which a part V may be another one. Each reaches it in another way.
REACHED = {
    "a constant": "def f(u, y): return V",
    "a comprehension": """
        def part(): return V
        def f(u, y): return [part() for _ in u]""",
    "a set comprehension": """
        def part(): return V
        def f(u, y): return {k: part() for k in u}, {part() for _ in u}""",
    "a lambda": """
        def part(): return V
        def f(u, y): return (lambda: part())()""",
    "a generator": """
        def part(): return V
        def f(u, y): return sum(part() for _ in u)""",
    "a nested function": """
        def part(): return V
        def f(u, y):
            def inner():
                def innermost(): return part()
                return innermost()
            return inner()""",
    "a class in the function": """
        def part(): return V
        def f(u, y):
            class Inner:
                def get(self): return part()
            return Inner().get()""",
    "a default of a nested function": """
        def f(u, y):
            def inner(x=V): return x
            return inner()""",
    "a default of a helper": """
        def part(x=V): return x
        def f(u, y): return part()""",
    "a keyword's default": """
        def part(*, x=V): return x
        def f(u, y): return part()""",
    "a helper of a helper": """
        def second(): return V
        def first(): return [second() for _ in range(1)]
        def f(u, y): return first()""",
    "functions that call each other": """
        def even(n): return n == 0 or odd(n - 1)
        def odd(n): return V if n == 1 else even(n - 1)
        def f(u, y): return even(len(u))""",
    "a closure": """
        def make(x):
            def f(u, y): return x
            return f
        f = make(V)""",
    "a function in a closure": """
        def make(g):
            def f(u, y): return [g() for _ in u]
            return f
        f = make(lambda: V)""",
    "a cell of a nested function": """
        def make(x):
            def f(u, y): return [x + k for k in u]
            return f
        f = make(V)""",
    "an option": "def f(u, y, x=V): return x",
    "a keyword option": "def f(u, y, *, x=V): return x",
    "a global number": """
        X = V
        def f(u, y): return X""",
    "a global in a comprehension": """
        X = V
        def f(u, y): return [X for _ in u]""",
    "a global list of dicts": """
        X = [{"a": (1, [V])}]
        def f(u, y): return X""",
    "a global set": """
        X = {"a", "b", str(V)}
        def f(u, y): return X""",
    "a constant set": "def f(u, y): return y in {'a', 'b', V}",
    "a small array": """
        X = np.array([V, 2.0])
        def f(u, y): return X""",
    "the middle of a large array": """
        X = np.zeros(5000)
        X[2500] = V
        def f(u, y): return X""",
    "the middle of a large array in a closure": """
        def make(x):
            def f(u, y): return x
            return f
        X = np.zeros((100, 100))
        X[50, 50] = V
        f = make(X)""",
    "an array in a default": """
        X = np.zeros(5000)
        X[2500] = V
        def f(u, y, x=X): return x""",
    "every second sample of an array": """
        X = np.zeros(5000)
        X[2500] = V
        X = X[::2]
        def f(u, y): return X""",
    "the type of an array": """
        X = np.zeros(3, [np.float32, np.float64][V - 1])
        def f(u, y): return X""",
    "the shape of an array": """
        X = np.zeros((V, 6 // V))
        def f(u, y): return X""",
    "an array of objects": """
        X = np.array([None, [1, V]], dtype=object)
        def f(u, y): return X""",
    "an array with fields": """
        X = np.zeros(2000, [("a", "i1"), ("b", "f8")])
        X["b"][1000] = V
        def f(u, y): return X""",
    "a masked array": """
        X = np.ma.masked_less(np.arange(5000.0), V)
        def f(u, y): return X""",
    "an array of long doubles": """
        X = np.array([1, np.longdouble(1) + V * np.finfo(np.longdouble).eps])
        def f(u, y): return X""",
    "a method of a class": """
        class Solver:
            def run(self): return V
        def f(u, y): return Solver().run()""",
    "an attribute of a class": """
        class Solver:
            x = V
        def f(u, y): return Solver.x""",
    "a base class": """
        class Base:
            def run(self): return V
        class Solver(Base): pass
        def f(u, y): return Solver().run()""",
    "a property, a static and a class method": """
        class Solver:
            @property
            def a(self): return self.b() + self.c()
            @staticmethod
            def b(): return V
            @classmethod
            def c(cls): return [V for _ in range(1)]
        def f(u, y): return Solver().a""",
    "an instance": """
        class Solver:
            def __init__(self): self.x = {"x": np.full(3000, V)}
            def run(self): return self.x
        solver = Solver()
        def f(u, y): return solver.run()""",
    "an instance with slots": """
        class Solver:
            __slots__ = ("x",)
        solver = Solver()
        solver.x = V
        def f(u, y): return solver.x""",
    "a bound method": """
        class Solver:
            def __init__(self): self.x = V
            def run(self, u, y): return self.x
        f = Solver().run""",
    "a callable instance": """
        class Solver:
            def __call__(self, u, y): return [V for _ in u]
        f = Solver()""",
    "a partial": """
        def part(x): return x
        g = functools.partial(part, V)
        def f(u, y): return g()""",
    "a partial that is the function": """
        def part(u, y, x): return x
        f = functools.partial(part, x=V)""",
    "a cached helper": """
        @functools.lru_cache
        def part(): return V
        def f(u, y): return part()""",
    "a wrapped helper": """
        def twice(of):
            @functools.wraps(of)
            def wrapper(): return of() + V
            return wrapper
        @twice
        def part(): return 1
        def f(u, y): return part()""",
    "a context manager of the library": """
        @contextlib.contextmanager
        def part(): yield V
        def f(u, y):
            with part() as x: return x""",
    "a function of a package that calls a helper": """
        part = np.vectorize(lambda x: x + V)
        def f(u, y): return part(u)""",
    "a function in a dict": """
        X = {"part": lambda: V}
        def f(u, y): return X["part"]()""",
    "an attribute of a function": """
        def part(): return part.x
        part.x = V
        def f(u, y): return part()""",
    "an enumeration": """
        class X(enum.Enum): A = V
        def f(u, y): return X.A.value""",
    "a data class": """
        @dataclasses.dataclass
        class X:
            a: int = V
            b: list = dataclasses.field(default_factory=lambda: [V])
        def f(u, y): return X()""",
    "a named tuple": """
        X = collections.namedtuple("X", "a b", defaults=[V])
        def f(u, y): return X(1)""",
    "an exception that is caught": """
        def f(u, y):
            try: return u[9]
            except [KeyError, IndexError][V - 1]: return 0""",
    "which lines an exception is caught in": """
        if V == 1:
            def f(u, y):
                try:
                    a = u[9]
                    b = y[9]
                except IndexError: return 0
        else:
            def f(u, y):
                a = u[9]
                try: b = y[9]
                except IndexError: return 0""",
    "a method that is called": """
        @ab.method
        def other(u, y): return [V for _ in u]
        def f(u, y): return other(u, y)""",
    "a model": """
        X = ab.Model(B=[V], nk=1)
        def f(u, y): return X""",
    "a module": """
        import my_helpers
        def f(u, y): return my_helpers.get()""",
    "a module by another name": """
        import my_helpers as h
        def f(u, y):
            g = h
            return [g.get() for _ in u]""",
    "a module within the function": """
        def f(u, y):
            import my_helpers
            return my_helpers.get()""",
    "a name from a module within the function": """
        def f(u, y):
            from my_helpers import get
            return get()""",
    "a module that is handed on": """
        import my_helpers
        def part(module): return module.get()
        def f(u, y): return part(my_helpers)""",
    "a constant of a module": """
        import my_helpers
        def f(u, y): return my_helpers.X""",
    "a module of a package": """
        import my_package.sub
        def f(u, y): return my_package.sub.get()""",
    "a module relative to a package": """
        from my_package import user
        def f(u, y): return user.get()""",
}

#: The same, but here V is not reached.
NOT_REACHED = {
    "another function": """
        def other(): return V
        def f(u, y): return 1""",
    "another global": """
        X, Z = V, 2
        def f(u, y): return Z""",
    "a comment": """
        def f(u, y):
            # V
            return 1""",
    "an attribute of the same name": """
        real = V
        def f(u, y): return u.real""",
    "another function of a module": """
        import my_helpers
        def f(u, y): return my_helpers.constant()""",
    "a cache": """
        @functools.lru_cache
        def part(x): return x
        part(V)
        def f(u, y): return part(1)""",
}

#: Functions with something that no version covers, and a part of the word about it.
CANNOT = [
    ("""
        X = ctypes.CDLL(None)
        def f(u, y): return ab.Model(B=[X.abs(1)], nk=1)""", "study_module.X (of ctypes.CDLL)"),
    ("""
        X = threading.Lock()
        def f(u, y):
            with X: return ab.Model(B=[1], nk=1)""", "study_module.X (of _thread.lock)"),
    ("""
        X = 0
        def f(u, y):
            global X
            X += 1
            return ab.Model(B=[1], nk=1)""", "study_module.X (a global that is set)"),
    ("""
        X = np.random.default_rng(1)
        def f(u, y): return ab.Model(B=[X.random()], nk=1)""", "study_module.X (a generator of random numbers)"),
    ("""
        def f(u, y): return ab.Model(B=[eval("1")], nk=1)""", "eval (finds others by their names)"),
    ("""
        import my_helpers
        def f(u, y): return ab.Model(B=getattr(my_helpers, "g" + "et")(), nk=1)""",
     "getattr (finds others by their names)"),
    ("""
        import sys
        sys.modules.pop("_bisect", None)
        import _bisect as X
        def f(u, y): return ab.Model(B=[1 + X.bisect([1], 0)], nk=1)""", "study_module.X (a C extension)"),
]  # fmt: skip

HEAD = """
import asobench as ab, collections, contextlib, ctypes, dataclasses, enum, functools, random, socket, threading
import numpy as np
"""
HELPERS = "X = V\ndef get(): return [X for _ in range(1)]\ndef constant(): return 1\n"
OWN = ("study_module", "my_helpers", "my_package")
FILES = {
    "my_helpers.py": HELPERS, "my_package/__init__.py": "", "my_package/sub.py": HELPERS,
    "my_package/user.py": "def get():\n    from . import sub\n    from .sub import get\n    return get()\n",
}  # fmt: skip


class Modules(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = Path(place.name)
        before = list(sys.path)
        self.addCleanup(lambda: sys.path.__setitem__(slice(None), before))

    def module(self, source, part=1):
        """A module of this source, whose V is the part, imported from a file."""
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        for name, text in {**FILES, "study_module.py": HEAD + textwrap.dedent(source)}.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text.replace("V", str(part)))
        for name in [name for name in sys.modules if name.partition(".")[0] in OWN]:
            del sys.modules[name]
        sys.path[:] = [str(folder), *(path for path in sys.path if not path.startswith(str(self.folder)))]
        importlib.invalidate_caches()
        return importlib.import_module("study_module")

    def method(self, source, part=1, **keys):
        return ab.method(self.module(source, part).f, name="f", **keys)


class Versions(Modules):
    def version(self, source, part):
        """The version while the module's folder is there, of a function that has no unknown parts."""
        method = self.method(source, part)
        self.assertEqual(method._now().unknown, {})
        return method.version

    def test_whatever_is_reached_changes_the_version(self):
        for name, source in REACHED.items():
            with self.subTest(name):
                one, again, two = (self.version(source, part) for part in (1, 1, 2))
                self.assertEqual(one, again)
                self.assertNotEqual(one, two)

    def test_what_is_not_reached_does_not(self):
        for name, source in NOT_REACHED.items():
            with self.subTest(name):
                self.assertEqual(self.version(source, 1), self.version(source, 2))

    def test_every_process_has_the_same_version(self):
        found = []
        for seed in ("1", "2"):
            call = [sys.executable, "-m", "unittest", "-q", "test_versions.Printed"]
            variables = {**os.environ, "PYTHONHASHSEED": seed, "ASOBENCH_PRINT_VERSIONS": "1"}
            done = subprocess.run(call, env=variables, capture_output=True, text=True, cwd=Path(__file__).parent)
            found.append(json.loads(done.stdout))
        self.assertEqual(set(found[0]), {*REACHED, *NOT_REACHED})
        self.assertEqual(found[0], found[1])

    def test_a_word_for_what_it_cannot_cover(self):
        compiled = next(Path(sysconfig.get_path("stdlib"), "lib-dynload").glob("_bisect.*so"), None)
        if compiled:
            own = tempfile.TemporaryDirectory()
            self.addCleanup(own.cleanup)
            shutil.copy(compiled, own.name)
            sys.path.insert(0, own.name)
        for source, part in CANNOT:
            if "_bisect" in source and compiled is None:
                continue  # a Python that has it within
            with self.subTest(part), warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                method = self.method(source)
                for trials in (2, 3):
                    run(self.folder / part.replace("/", ""), method, trials)
                said = [str(warning.message) for warning in caught if "does not cover" in str(warning.message)]
                self.assertEqual(len(said), 1, said)
                self.assertIn(part, said[0])
                self.assertEqual(len(said[0].splitlines()), 1)

    def test_a_given_version_needs_no_word_and_has_the_options(self):
        method = self.method("def f(u, y, x=V): return {'A': [], 'B': [x], 'nk': 1}", version="7")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run(self.folder / "out", method, 2)
            run(self.folder / "out", self.method("def f(u, y, x=V): return None", version="7"), 2)
        with self.assertRaisesRegex(ab.StudyError, "says that it is 'f 7 "):
            run(self.folder / "out", method.having("f", x=2), 2)
        for version in ("", "a\nb", "x" * 81):
            with self.assertRaisesRegex(ValueError, "expected 1 to 80 visible characters"):
                self.method("def f(u, y): return V", version=version)


class Printed(Modules):
    @unittest.skipUnless("ASOBENCH_PRINT_VERSIONS" in os.environ, "a process of another test")
    def test_versions(self):
        sources = {**REACHED, **NOT_REACHED}
        print(json.dumps({name: self.method(source).version for name, source in sources.items()}))


def run(folder, method, trials):
    study = ab.Study(methods=[method], settings={"eta": 10, "window": 40}, measures=["e_g"])
    return study.run(folder, trials=trials, progress=False)


class Results(Modules):
    def values(self, results):
        return [row["mean"] for row in results.rows() if row["measure"] == "e_g"]

    def test_results_of_another_text_are_not_taken_up(self):
        sources = {
            "comprehension": """
                def part(): return V
                def f(u, y): return ab.Model(B=[part() for _ in range(2)], nk=1)""",
            "lambda": """
                def part(): return V
                def f(u, y): return (lambda: ab.Model(B=[part()], nk=1))()""",
            "array": """
                X = np.zeros(5000)
                X[2500] = V
                def f(u, y): return ab.Model(B=[X.max()], nk=1)""",
        }
        for name, source in sources.items():
            with self.subTest(name):
                first = run(self.folder / name, self.method(source), 3)
                self.assertEqual(self.values(run(self.folder / name, self.method(source), 3)), self.values(first))
                with self.assertRaisesRegex(ab.StudyError, "method 'f' says that it is"):
                    run(self.folder / name, self.method(source, 2), 3)
                other = run(self.folder / f"{name}-2", self.method(source, 2), 3)
                self.assertNotEqual(self.values(other), self.values(first))

    def test_a_global_that_changes_between_runs_is_another_version(self):
        module = self.module("""
            X = V
            def f(u, y): return ab.Model(B=[X], nk=1)""")
        method = ab.method(module.f)
        run(self.folder / "out", method, 3)
        module.X = 2
        with self.assertRaisesRegex(ab.StudyError, "method 'f' says that it is"):
            run(self.folder / "out", method, 3)

    def test_a_word_for_what_changes_in_a_run(self):
        source = """
            X = []
            def f(u, y):
                X.append(1)
                return ab.Model(B=[1], nk=1)"""
        for processes in (None, 1):
            with self.subTest(processes), warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                method = self.method(source, processes=processes)
                for out in "ab":
                    run(self.folder / f"{out}{processes}", method, 3)
                self.assertEqual(
                    [str(warning.message) for warning in caught],
                    ["method f: study_module.X changed while the study ran, and its version with it; expected what is "
                     "constant, or version="],
                )  # fmt: skip


if __name__ == "__main__":
    unittest.main()
