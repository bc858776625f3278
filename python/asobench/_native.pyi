"""The extension module: crates/python."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
VERSION: str

class Native:
    def __init__(
        self,
        a: Any,
        b: Any,
        c: Any,
        d: Any,
        f: Any,
        delay: int,
        noise_variance: float,
        covariance: Any,
        shift: int,
        x0: Any | None,
    ) -> None: ...
    def with_findings(
        self,
        loss: float,
        condition: float,
        iterations: int | None,
        minima: int | None,
        status: str | None,
        singular_values: Any,
        start: bool,
        continuous: Any,
    ) -> Native: ...
    delay: int
    orders: str
    shift: int
    noise_variance: float
    loss: float
    condition: float
    iterations: int | None
    minima: int | None
    unstable: bool
    status: str | None
    singular_values: Vector
    x0: Vector | None
    continuous: tuple[list[float], list[float], list[float], float, str, int] | None
    def polynomials(self) -> list[Vector]: ...
    def params(self) -> Vector: ...
    def se(self) -> Vector | None: ...
    def cov(self) -> Vector | None: ...
    def canonical(self) -> tuple[list[Vector], float]: ...
    def equation(self, digits: int) -> str: ...
    def precision(self) -> tuple[Vector, Vector, float, float, list[str]]: ...
    def frequency_response(self, omega: Any) -> list[Vector]: ...
    def step_response(self, samples: int) -> list[Vector]: ...
    def simulate(self, u: Any, x0: Any | None) -> Vector: ...
    def errors(self, u: Any, y: Any, horizon: int) -> tuple[int, Vector] | None: ...
    def tests(self, u: Any, y: Any, own: bool) -> tuple[str | None, str | None]: ...
    def fit(self, u: Any, y: Any, own: bool, horizon: int) -> tuple[float, float, float]: ...
    def observe(self, gain: str, u: Any, y: Any) -> tuple[Vector, Vector]: ...

def estimate(
    estimator: str, options: str, order: int, delay: int, u: Any, y: Any, lengths: list[int]
) -> tuple[Native, str | None]: ...
def compare_orders(
    orders: list[tuple[int, int, int]], u: Any, y: Any
) -> tuple[int, list[str], list[tuple[float | None, list[float | None], list[float]]], list[int | None]]: ...
def estimators() -> str: ...
def describe(estimator: str, options: str) -> str: ...
def check_gain(gain: str) -> None: ...
