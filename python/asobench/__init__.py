"""Monte-Carlo benchmarks of estimators and adaptive state observers: the program `asobench` from Python.

There is no second implementation here: studies are run by the program, which a wheel carries.
"""

from ._study import Results, run, simulate
from ._worker import Declined, worker

__all__ = ["Declined", "Results", "run", "simulate", "worker"]
