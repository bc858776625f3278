"""Identification of linear systems, and Monte-Carlo benchmarks of the methods: asobench from Python.

Models are estimated by the library of the program in this process; studies are run by the program, which the wheel
carries. There is no second implementation.
"""

from ._errors import Declined, Error, EstimateFailed, StudyError
from ._estimators import estimate, estimators
from ._method import Method, method
from ._model import Continuous, Fit, FrequencyResponse, Model, Offset, ResidualTests, Roots, StepResponse
from ._native import VERSION as __version__
from ._observer import ModelObserver, Observation
from ._orders import Observer, OrderTable, observer, orders
from ._results import Picture, Replay, Results, Verdict
from ._study import Study, run, simulate
from ._worker import worker

__all__ = [
    "Continuous",
    "Declined",
    "Error",
    "EstimateFailed",
    "Fit",
    "FrequencyResponse",
    "Method",
    "Model",
    "ModelObserver",
    "Observation",
    "Observer",
    "Offset",
    "OrderTable",
    "Picture",
    "Replay",
    "ResidualTests",
    "Results",
    "Roots",
    "StepResponse",
    "Study",
    "StudyError",
    "Verdict",
    "__version__",
    "estimate",
    "estimators",
    "method",
    "observer",
    "orders",
    "run",
    "simulate",
    "worker",
]
