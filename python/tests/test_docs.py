"""The examples of docstrings, and that every public name has one."""

import doctest
import importlib
import inspect
import pkgutil
import unittest

import asobench


def modules():
    names = [name for _, name, _ in pkgutil.iter_modules(asobench.__path__) if name != "__main__"]
    return [importlib.import_module(f"asobench.{name}") for name in names]


def load_tests(loader, tests, pattern):
    for module in modules():
        tests.addTests(doctest.DocTestSuite(module, optionflags=doctest.NORMALIZE_WHITESPACE))
    return tests


class Docs(unittest.TestCase):
    def test_every_public_name_is_described(self):
        for name in asobench.__all__:
            public = getattr(asobench, name)
            self.assertTrue(name == "__version__" or inspect.getdoc(public), name)
            for member, value in vars(public).items() if inspect.isclass(public) else ():
                if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                    self.assertTrue(inspect.getdoc(value), f"{name}.{member}")


if __name__ == "__main__":
    unittest.main()
