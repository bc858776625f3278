"""Models: polynomials with what follows from them."""

from __future__ import annotations

import html
import json
import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import Vector, real, signal, whole
from ._native import Native, measured
from ._observer import ModelObserver, covariance

Z_95 = 1.959963984540054
PARTS = ("A", "B", "C", "D", "F")


class Roots(NamedTuple):
    """Poles or zeros, with standard errors by the delta method; NaN without a covariance."""

    at: NDArray[np.complex128]
    se_real: Vector
    se_imag: Vector
    se_modulus: Vector


class FrequencyResponse(NamedTuple):
    """The frequency response of B/(A F), with 95 % bands."""

    w: Vector
    """Frequencies, rad/sample."""
    response: NDArray[np.complex128]
    magnitude: Vector
    magnitude_low: Vector
    magnitude_high: Vector
    phase: Vector
    """rad, without jumps."""
    phase_low: Vector
    phase_high: Vector


class StepResponse(NamedTuple):
    """The step response of B/(A F) from rest, k = 0, 1, ..., with standard errors."""

    y: Vector
    se: Vector


class Continuous(NamedTuple):
    """The model in continuous time, B(s)/A(s), of which a model is the sampled one."""

    numerator: Vector
    """``b_0 ... b_m``, descending powers of s, in powers of 1/s."""
    denominator: Vector
    """``1, a_1 ... a_n``."""
    se: Vector
    """The standard errors of ``b_0 ... b_m, a_1 ... a_n``; NaN without a covariance."""
    ts: float
    """The time between samples, seconds."""
    hold: str
    """The input between samples."""
    dead_time: float
    """Seconds."""
    dead_time_se: float
    """Its standard error; NaN if it was not estimated or without a covariance."""
    integrator: bool
    """A pole is fixed at 0."""


class Findings(NamedTuple):
    """What an estimate found beside the numbers of its model."""

    loss: float
    condition: float
    iterations: int | None
    minima: int | None
    status: str | None
    singular_values: list[float]
    has_start: bool
    continuous: tuple[list[float], list[float], list[float], float, str, float] | None
    offsets: list[tuple[float, float]]


class ResidualTests(NamedTuple):
    """P-values of the tests of residuals, each at 1 %; NaN where a test could not be made."""

    white: float
    """The residuals are white."""
    past_input: float
    """Past input does not explain them: B, F and the delay are right."""
    feedback: float
    """The record has no feedback and, with a delay, no direct term."""
    at_once: float
    """The same of u(k) alone, which a direct term moves too."""
    later: float
    """The same of u(k+1) ... u(k+5) beside u(k), which feedback alone moves."""
    numbers: dict[str, Any]
    """All numbers, with the names of ``asobench estimate --format json``."""

    @property
    def passed(self) -> bool:
        """Whether no test of the residuals fails."""
        return not (self.white < 0.01 or self.past_input < 0.01)


class Fit(NamedTuple):
    """FIT in per cent, 100 (1 - |y - yhat| / |y - mean y|)."""

    simulated: float
    """Of the output simulated from u alone."""
    one_step: float
    """Of the output predicted one step ahead."""


class Offset(NamedTuple):
    """A constant of y."""

    value: float
    """In y's unit: the output in equilibrium where u is 0."""
    se: float
    """Its standard error."""


class Model:
    """The model ``A(q) y = B(q)/F(q) u + C(q)/D(q) e``.

    Parameters
    ----------
    A, C, D, F : array_like, optional
        Polynomials in q^-1, ascending, which begin with 1: ``A = [1, a_1, a_2]``. Left out: 1.
    B : array_like
        Without `nk` the whole polynomial: ``[0, b_1, b_2]`` has a delay of one sample. With `nk` the coefficients from
        the delay on: ``[b_1, b_2]``.
    nk : int, optional
        The delay in samples.
    noise_variance : float, optional
        The variance of e.
    cov : array_like, optional
        The covariance of the parameters, (p, p), in the order of A, B, C, D, F.
    x0 : array_like, optional
        The state at k = 0 in the form of :meth:`state_space`; left out: rest.

    Examples
    --------
    >>> import asobench as ab
    >>> model = ab.Model(A=[1, -1.5, 0.7], B=[1.0, 0.5], nk=1)
    >>> print(model.equation())
    y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)
    >>> model.poles
    array([0.75+0.37080992j, 0.75-0.37080992j])
    >>> model.simulate([1.0, 0.0, 0.0])
    array([0., 1., 2.])
    """

    def __init__(
        self,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        C: ArrayLike | None = None,
        D: ArrayLike | None = None,
        F: ArrayLike | None = None,
        *,
        nk: int | None = None,
        noise_variance: float = float("nan"),
        cov: ArrayLike | None = None,
        x0: ArrayLike | None = None,
    ) -> None:
        if B is None:
            raise TypeError("B: left out; expected its coefficients")
        a, c, d, f = (_monic(name, part) for name, part in (("A", A), ("C", C), ("D", D), ("F", F)))
        b, delay = _delayed(signal("B", B), nk)
        for name, part in zip(PARTS, (a, b, c, d, f)):
            if len(part) > MOST_COEFFICIENTS:
                raise ValueError(f"{name}: {len(part)} coefficients; expected at most {MOST_COEFFICIENTS}")
        p = sum(map(len, (a, b, c, d, f))) - 4 - delay
        covariance = np.zeros((0, 0)) if cov is None else real("cov", cov)
        if cov is not None and covariance.shape != (p, p):
            raise ValueError(f"cov: shape {covariance.shape}; expected ({p}, {p}) of {p} parameters")
        start = None if x0 is None else signal("x0", x0)
        native = Native(a, b, c, d, f, delay, float(noise_variance), covariance.ravel(), 0, start)
        self._set(native, "", {}, None)

    def _set(
        self, native: Native, estimator: str, options: dict[str, Any], record: tuple[Vector, Vector] | None
    ) -> None:
        self._native, self.estimator, self._record = native, estimator, record
        self._options = options

    @classmethod
    def _of(
        cls, native: Native, estimator: str, options: dict[str, Any], record: tuple[Vector, Vector] | None
    ) -> Model:
        model = cls.__new__(cls)
        model._set(native, estimator, options, record)
        return model

    def __reduce__(self) -> tuple[Any, ...]:
        n = self._native
        cov = n.cov()
        parts: tuple[Any, ...] = (
            *n.polynomials(),
            n.delay,
            n.noise_variance,
            [] if cov is None else cov.ravel(),
            n.shift,
            n.x0,
        )
        return _restore, (parts, n.findings(), self.estimator, self._options, self._record)

    @cached_property
    def _found(self) -> Findings:
        return Findings(*self._native.findings())

    # The polynomials.

    @cached_property
    def _polynomials(self) -> dict[str, Vector]:
        polynomials = dict(zip(PARTS, self._native.polynomials()))
        for polynomial in polynomials.values():
            polynomial.flags.writeable = False
        return polynomials

    @property
    def A(self) -> Vector:
        """``1, a_1 ... a_na``."""
        return self._polynomials["A"]

    @property
    def B(self) -> Vector:
        """nk zeros, then nb coefficients."""
        return self._polynomials["B"]

    @property
    def C(self) -> Vector:
        """``1, c_1 ... c_nc``."""
        return self._polynomials["C"]

    @property
    def D(self) -> Vector:
        """``1, d_1 ... d_nd``."""
        return self._polynomials["D"]

    @property
    def F(self) -> Vector:
        """``1, f_1 ... f_nf``."""
        return self._polynomials["F"]

    @property
    def nk(self) -> int:
        """The delay in samples."""
        return self._native.delay

    @property
    def orders(self) -> str:
        """The orders as text, such as ``"nb=2,nf=2,nk=1"``."""
        return self._native.orders

    # The estimate.

    @property
    def options(self) -> dict[str, Any]:
        """Every option of the estimator with its value."""
        from ._native import describe

        described: dict[str, Any] = (
            json.loads(describe(self.estimator, json.dumps(self._options))) if self.estimator else {}
        )
        return described

    @property
    def status(self) -> str:
        """``"ok"``, or why a search ended before a minimum, such as ``"boundary"``."""
        return self._found.status or "ok"

    @property
    def names(self) -> list[str]:
        """The names of the parameters."""
        first = {"A": 1, "B": self.nk, "C": 1, "D": 1, "F": 1}
        return [f"{key.lower()}_{i}" for key in PARTS for i in range(first[key], len(self._polynomials[key]))]

    @cached_property
    def params(self) -> Vector:
        """The parameters, (p,), in the order of A, B, C, D, F."""
        return self._native.params()

    @cached_property
    def se(self) -> Vector:
        """Their standard errors, (p,); NaN without a covariance."""
        errors = self._native.se()
        return np.full(len(self.params), np.nan) if errors is None else errors

    @cached_property
    def cov(self) -> NDArray[np.float64] | None:
        """Their covariance, (p, p); None of an estimator without one."""
        return self._native.cov()

    def conf_int(self) -> NDArray[np.float64]:
        """The 95 % intervals of the parameters, (p, 2)."""
        return np.column_stack([self.params - Z_95 * self.se, self.params + Z_95 * self.se])

    @property
    def noise_variance(self) -> float:
        """The variance of e, in the square of y's unit; NaN if it is not known."""
        return self._native.noise_variance

    @property
    def loss(self) -> float:
        """The mean squared prediction error over the record."""
        return self._found.loss

    @property
    def condition(self) -> float:
        """The condition number of the last equations that were solved."""
        return self._found.condition

    @property
    def iterations(self) -> int | None:
        """Of a method that iterates."""
        return self._found.iterations

    @property
    def minima(self) -> int | None:
        """How many distinct minima a search from several starts found."""
        return self._found.minima

    @property
    def singular_values(self) -> Vector:
        """Of a subspace method, largest first; they hint at the order."""
        return np.array(self._found.singular_values)

    @property
    def continuous(self) -> Continuous | None:
        """The model in continuous time, of an estimator that has one."""
        found = self._found.continuous
        if found is None:
            return None
        numerator, denominator, covariance, ts, hold, dead_time = found
        p = len(numerator) + len(denominator) - 1
        size = math.isqrt(len(covariance))
        se = np.sqrt(np.array(covariance).reshape(size, size).diagonal()) if covariance else np.full(p, np.nan)
        late_se = float(se[p]) if size > p else math.nan
        b, a = np.array(numerator), np.array(denominator)
        return Continuous(b, a, se[:p], ts, hold, dead_time * ts, late_se, bool(a[-1] == 0))

    @property
    def x0(self) -> Vector | None:
        """The state at k = 0; None if it could not be found."""
        return self._native.x0

    @property
    def offset(self) -> Offset | None:
        """The constant mu of y in ``A (y - mu) = B/F u + C/D e`` with its standard error; None if it was not estimated.

        Of several records it is that of the first; ``offsets`` has one for each.
        """
        return next(iter(self.offsets), None)

    @property
    def offsets(self) -> list[Offset]:
        """The constant of y in each record, if it was estimated (``offset="estimate"``)."""
        return [Offset(*offset) for offset in self._found.offsets]

    # Properties that follow from the polynomials.

    @cached_property
    def _precision(self) -> tuple[Roots, Roots, float, float, list[str]]:
        poles, zeros, gain, gain_se, without = self._native.precision()
        of = [Roots(r[:, 0] + 1j * r[:, 1], r[:, 2], r[:, 3], r[:, 5]) for r in (poles, zeros)]
        return of[0], of[1], gain, gain_se, without

    @property
    def poles(self) -> NDArray[np.complex128]:
        """The poles of B/(A F), largest modulus first."""
        return self._precision[0].at

    @property
    def zeros(self) -> NDArray[np.complex128]:
        """The zeros of B without its delay, largest modulus first."""
        return self._precision[1].at

    @property
    def poles_se(self) -> Roots:
        """The poles with their standard errors."""
        return self._precision[0]

    @property
    def zeros_se(self) -> Roots:
        """The zeros with their standard errors."""
        return self._precision[1]

    @property
    def gain(self) -> float:
        """The static gain B(1)/(A(1) F(1))."""
        return self._precision[2]

    @property
    def gain_se(self) -> float:
        """Its standard error."""
        return self._precision[3]

    @property
    def orders_without_cancellations(self) -> list[str]:
        """Orders to try where poles and zeros may cancel."""
        return self._precision[4]

    @property
    def stable(self) -> bool:
        """Whether all poles of B/(A F) lie within the unit circle."""
        return not self._native.unstable

    def equation(self, digits: int = 6) -> str:
        """The model as an equation, which makes signs visible."""
        return self._native.equation(whole("digits", digits, 0))

    def state_space(self) -> tuple[NDArray[np.float64], Vector, Vector, float]:
        """A (n, n), b (n,), c (n,) and d of ``x(k+1) = A x(k) + b u(k)``, ``y = c x + d u``.

        The last row of A is the paper's a, and c = (1, 0 ... 0). A method without a delay of its own (`iv`, `ls`) with
        nk > 1 has this form for the output nk - 1 samples later.
        """
        (a, b, _), d = self._native.canonical()
        matrix = np.eye(len(a), k=1)
        matrix[-1] = a
        return matrix, b, np.eye(len(a))[0], d

    def simulate(self, u: ArrayLike, x0: ArrayLike | None = None) -> Vector:
        """The output under `u` alone.

        Parameters
        ----------
        u : array_like, (K,)
        x0 : array_like, (n,), optional
            The state at k = 0, such as ``model.x0``; left out: rest.

        Returns
        -------
        ndarray, (K,)
        """
        return self._native.simulate(u, None if x0 is None else signal("x0", x0))

    def residuals(self, u: ArrayLike | None = None, y: ArrayLike | None = None) -> Vector:
        """The one-step prediction errors of a record, or of the one that was estimated from, from the best start.

        The first `max(na, nb + nk - 1)` of a model without C, D, F are NaN, since they look back beyond the record.
        """
        return self._errors(*self._of_record(u, y), 1)

    def _errors(self, u: ArrayLike, y: ArrayLike, steps: int) -> Vector:
        found = self._native.errors(u, y, steps)
        if found is None:
            raise ValueError("no start of the predictor: it is unstable, or the record is shorter than its memory")
        first, errors = found
        errors[:first] = np.nan
        return errors

    def predict(self, u: ArrayLike, y: ArrayLike, k: int = 1) -> Vector:
        """The prediction of y(t) from u and from y up to t - k.

        The start of the predictor is fitted to the record. Samples before which nothing is known are NaN.

        Returns
        -------
        ndarray, (K,)
        """
        return signal("y", y) - self._errors(u, y, whole("k", k, 1))

    def frequency_response(self, w: ArrayLike | None = None) -> FrequencyResponse:
        """The frequency response with 95 % bands, by the derivatives of ln |G| and of the phase.

        Parameters
        ----------
        w : array_like, optional
            Ascending frequencies, rad/sample; left out: 256 up to pi.
        """
        grid = np.linspace(np.pi / 256, np.pi, 256) if w is None else signal("w", w)
        size, log_se, phase, phase_se = self._native.frequency_response(grid)
        factor = np.exp(Z_95 * log_se)
        return FrequencyResponse(
            grid,
            size * np.exp(1j * phase),
            size,
            size / factor,
            size * factor,
            phase,
            phase - Z_95 * phase_se,
            phase + Z_95 * phase_se,
        )

    def step_response(self, samples: int = 50) -> StepResponse:
        """The step response from rest, k = 0 ... `samples` - 1, of at most a million samples."""
        return StepResponse(*self._native.step_response(whole("samples", samples, 1)))

    # The model against a record.

    def _of_record(self, u: ArrayLike | None, y: ArrayLike | None) -> tuple[ArrayLike, ArrayLike]:
        if u is None and y is None:
            if self._record is None:
                raise TypeError("u, y: left out, and the model was not estimated from a record")
            return self._record
        if u is None or y is None:
            raise TypeError("expected both u and y, or neither")
        return u, y

    def fit(self, u: ArrayLike | None = None, y: ArrayLike | None = None) -> Fit:
        """FIT on a record, from its best initial state; on the record of the estimate from the estimated one."""
        simulated, one_step, _ = self._native.fit(*self._of_record(u, y), u is None and y is None, 1)
        return Fit(simulated, one_step)

    def fit_ahead(self, k: int, u: ArrayLike | None = None, y: ArrayLike | None = None) -> float:
        """FIT of the output predicted k steps ahead, as `predict` does, on the records of `fit`."""
        steps = whole("k", k, 1)
        return self._native.fit(*self._of_record(u, y), u is None and y is None, steps)[2]

    def residual_tests(self, u: ArrayLike | None = None, y: ArrayLike | None = None) -> ResidualTests | None:
        """Tests of the residuals of a record, or of the one that was estimated from; None where there are too few."""
        numbers, feedback = self._native.tests(*self._of_record(u, y), u is None and y is None)
        if numbers is None:
            return None
        read, of_record = json.loads(numbers), json.loads(feedback or "{}")
        p = [(read[name] or {}).get("p_value") for name in ("white", "free_of_past_input")]
        p += [of_record.get(name) for name in ("p_value", "at_once", "later")]
        white, past, loop, at_once, later = (float("nan") if value is None else float(value) for value in p)
        return ResidualTests(white, past, loop, at_once, later, read)

    # The states.

    def observer(
        self,
        kind: str = "dead-beat",
        *,
        Q: ArrayLike | None = None,
        r: float | None = None,
        P0: ArrayLike | None = None,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
    ) -> ModelObserver:
        """The observer of this model, with its gain and poles; its ``run`` gives the states of a record.

        Parameters
        ----------
        kind : str
            ``"dead-beat"``, ``"scaled:RHO"``, ``"poles:LIST"``, ``"kalman"``, ``"kalman-coloured"`` (measurement noise
            of the model's colour), ``"kalman-varying"`` (from `P0`), ``"gpebo-drem:GAMMA"`` or ``"gpebo-squares:RHO"``.
        Q : array_like, optional
            The covariance of the noise that drives the states: a number q for q I, (n,) for a diagonal, or (n, n).
        r : float, optional
            The variance of the noise that y is measured with. Without Q and r Kalman filters identify them by maximum
            likelihood, Q = rho r I.
        P0 : array_like, optional
            The covariance of x(0) about its estimate, as Q.
        u, y : array_like, (K,), optional
            The record on which they are identified; left out: that of the estimate.

        Examples
        --------
        >>> import asobench as ab
        >>> model = ab.Model(A=[1, -0.5], B=[1.0], nk=1)
        >>> model.observer("kalman", Q=0.875, r=1.0).gain.round(12)
        array([0.25])
        """
        if not isinstance(kind, str):
            raise TypeError(f"kind: {kind!r}; expected text such as 'kalman' or 'dead-beat'")
        if (Q is None) != (r is None):
            raise TypeError("Q, r: expected both, or neither")
        n = len(self._native.canonical()[0][0])
        q, p0 = covariance("Q", Q, n), covariance("P0", P0, n)
        identified = q is None and kind.startswith("kalman")
        record = self._of_record(u, y) if identified else ([0.0], [0.0])
        noise = None if q is None or r is None else (q, float(r), p0)
        return ModelObserver(self._native.observer(kind, noise, *record), kind)

    # Other packages.

    def _in_z(self) -> tuple[Vector, Vector]:
        numerator, denominator = self.B, np.convolve(self.A, self.F)
        n = max(len(numerator), len(denominator))
        numerator, denominator = (np.pad(part, (0, n - len(part))) for part in (numerator, denominator))
        return np.trim_zeros(numerator, "f"), denominator

    def to_scipy(self, dt: float = 1.0) -> Any:
        """B/(A F) as ``scipy.signal.dlti``."""
        from scipy import signal as scipy_signal

        return scipy_signal.dlti(*self._in_z(), dt=dt)

    def to_control(self, dt: float | bool = True) -> Any:
        """B/(A F) as ``control.TransferFunction``."""
        import control

        return control.TransferFunction(*self._in_z(), dt)

    # Words and pictures.

    def summary(self) -> str:
        """A table of the parameters with their standard errors and 95 % intervals, and what the record says."""
        lines = [f"{self.estimator or 'model'}: {self.orders}", *self.equation().splitlines(), ""]
        lines.append(f"{'parameter':<10}{'estimate':>14}{'std. error':>14}{'95 % from':>14}{'to':>14}")
        rows = [*zip(self.names, self.params, self.se, self.conf_int())]
        for mu in self.offsets:
            rows.append(("offset", mu.value, mu.se, (mu.value - Z_95 * mu.se, mu.value + Z_95 * mu.se)))
        for name, p, se, ends in rows:
            numbers = [*measured(p, se), *(measured(end, se)[0] for end in ends)]
            lines.append(f"{name:<10}" + "".join(f"{text:>14}" for text in numbers))
        lines += ["", f"noise variance  {self.noise_variance:.6g}"]
        lines.append("static gain     " + " +- ".join(filter(None, measured(self.gain, self.gain_se))))
        lines.append("poles           " + ", ".join(f"{pole:.4g}" for pole in self.poles))
        if self._record is not None:
            lines += [f"FIT             {self.fit().simulated:.3f} % simulated, {self.fit().one_step:.3f} % one-step"]
            tests = self.residual_tests()
            words = (
                "not tested" if tests is None else f"white p = {tests.white:.4f}, past input p = {tests.past_input:.4f}"
            )
            lines += [f"residuals       {words}"]
        lines += [f"status          {self.status}"] if self.estimator else []
        return "\n".join(lines)

    def picture(self) -> str:
        """Measured and simulated output and the prediction errors as SVG, drawn by the program for this record."""
        from ._picture import picture

        if self._record is None:
            raise TypeError("the model was not estimated from a record")
        return picture(self)

    def __getattr__(self, name: str) -> Any:
        own = ELSEWHERE.get(name)
        hint = "" if own is None else f"; here it is {own}"
        raise AttributeError(f"Model has no attribute {name!r}{hint}")

    def __repr__(self) -> str:
        head = f"Model({self.orders}" + (f", by {self.estimator}" if self.estimator else "")
        return head + (f", {self.status})" if self.status != "ok" else ")")

    def _repr_html_(self) -> str:
        text = f"<pre>{html.escape(self.summary())}</pre>"
        if self._record is None or len(self._record[1]) > LARGEST_PICTURE:
            return text
        return text + self.picture()


#: The names of other packages.
ELSEWHERE = {
    "bse": "se", "cov_params": "cov", "resid": "residuals()", "tvalues": "params / se", "pvalues": "conf_int()",
    "rsquared": "fit()", "aic": "orders(u, y, n)", "bic": "orders(u, y, n)", "forecast": "predict(u, y, k)",
    "G": "B and F, or to_control()", "H": "C and D", "Yid": "predict(u, y)", "Vn": "loss", "NUMERATOR": "B",
    "DENOMINATOR": "F or A", "dcgain": "gain", "damp": "poles", "pole": "poles", "zero": "zeros", "save": "pickle.dump",
    "kalman": "observer('kalman')", "observe": "observer(...).run(u, y)",
}  # fmt: skip

#: Of a polynomial, the delay's zeros among them: matrices of a model have as many rows and columns.
MOST_COEFFICIENTS = 10_000

#: Samples of a record up to which a notebook draws it.
LARGEST_PICTURE = 20_000


def _monic(name: str, given: ArrayLike | None) -> Vector:
    """A polynomial that begins with 1."""
    if given is None:
        return np.ones(1)
    polynomial = signal(name, given)
    if not len(polynomial) or polynomial[0] != 1.0:
        begins = f"begins with {polynomial[0]:g}" if len(polynomial) else "is empty"
        raise ValueError(f"{name}: {begins}; expected [1, {name.lower()}_1, ...]")
    return polynomial


def _delayed(b: Vector, nk: int | None) -> tuple[Vector, int]:
    """B with its zeros, and how many there are."""
    if not b.any():
        raise ValueError("B: all zeros; expected a coefficient")
    zeros = int(np.flatnonzero(b)[0])
    if nk is None:
        return b, zeros
    delay = whole("nk", nk, 0, MOST_COEFFICIENTS)
    if delay and zeros:
        raise ValueError(
            f"B: begins with zero beside nk = {delay}; expected the coefficients from the delay on, or no nk"
        )
    return np.concatenate([np.zeros(delay), b]), delay


def _restore(
    parts: tuple[Any, ...], found: tuple[Any, ...], estimator: str, options: dict[str, Any], record: Any
) -> Model:
    """A pickled model."""
    native = Native(*parts).with_findings(found)
    model = Model.__new__(Model)
    model._set(native, estimator, options, record)
    return model
