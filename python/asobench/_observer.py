"""Observers of models: gain, poles, and the states of a record with their standard deviations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import Vector, real
from ._native import NativeObserver


class Observation(NamedTuple):
    """The states of a record."""

    x: NDArray[np.float64]
    """xhat(k), (K + 1, n), k = 0 ... K, from u and y up to k - 1, in the coordinates of ``Model.state_space``."""
    sd: NDArray[np.float64] | None
    """The standard deviations of x(k) - xhat(k), (K + 1, n); None where the covariances of the noise are not known."""
    y: Vector
    """The prediction of y(k) from u up to k and y up to k - 1, (K,)."""
    innovations: Vector
    """y(k) less its prediction, (K,)."""
    white: float
    """The p-value of Ljung and Box's test of the innovations; NaN where they are too few, or zero."""


class ModelObserver:
    """An observer of a model, from the model's x0; ``Model.observer`` makes one.

    It is ``xhat(k+1) = A xhat(k) + b u(k) + gain (y(k) - c xhat(k) - d u(k))``; `kalman-coloured` has further states,
    of the noise, whose gains follow.
    """

    def __init__(self, native: NativeObserver, kind: str) -> None:
        self._native, self.kind = native, kind

    @property
    def gain(self) -> Vector:
        """The gain, (n,); that of the steady state where it varies, empty of an observer without feedback."""
        return self._native.gain()[0]

    @property
    def poles(self) -> NDArray[np.complex128]:
        """The eigenvalues of A - gain c, largest modulus first."""
        parts = self._native.gain()[1]
        return np.asarray(parts[:, 0] + 1j * parts[:, 1])

    @property
    def Q(self) -> NDArray[np.float64] | None:
        """The covariance of the noise that drives the states, (n, n), given or identified; None of placed poles."""
        return self._native.noise()[0]

    @property
    def r(self) -> float | None:
        """The variance of the noise that y is measured with."""
        return self._native.noise()[1]

    @property
    def P(self) -> NDArray[np.float64] | None:
        """The covariance of x(k) - xhat(k) in the steady state, (n, n); None where the noise is not known."""
        return self._native.noise()[2]

    @property
    def innovation_variance(self) -> float:
        """The variance of the innovations in the steady state; NaN where the noise is not known."""
        return self._native.noise()[3]

    def run(self, u: ArrayLike, y: ArrayLike) -> Observation:
        """The states of a record."""
        x, sd, (predicted, innovations), white = self._native.run(u, y)
        return Observation(x, sd, predicted, innovations, white)

    def __repr__(self) -> str:
        return f"ModelObserver({self.kind!r})"


def covariance(name: str, given: ArrayLike | None, n: int) -> Vector | None:
    """A covariance by rows: of one number times I, of a diagonal, or of a matrix."""
    if given is None:
        return None
    array = real(name, given)
    if array.ndim == 0:
        array = array * np.eye(n)
    elif array.shape == (n,):
        array = np.diag(array)
    if array.shape != (n, n):
        raise ValueError(f"{name}: shape {array.shape}; expected a number, ({n},) or ({n}, {n})")
    return array.ravel()
