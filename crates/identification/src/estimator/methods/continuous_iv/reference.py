"""Dead times between samples, integrators, starts and offsets in continuous time: least squares for tests.rs.

python3 reference.py (numpy 2, scipy 1) writes reference.json, records too.

The output of B(s)/A(s) exp(-tau s) is a sum of modes r/(s - p), each a recursion from sample to sample whose
coefficients are integrals of exp(p t) by hand, and from there over the share of a sample that is left of it after the
dead time: no matrix exponential, no state space. A state at the first sample adds K(s)/A(s) of an impulse there,
while u before is its first value; an offset adds a constant; a pole at 0 is one of the modes. The sum of (D/C (y -
x))^2 over all numbers is least by Gauss-Newton with differences of sixth order, checked by
scipy.optimize.least_squares from there, and on a grid of dead times with the others free ("curve": tau, least sum /
N, B, A). Standard errors: s^2 (J'J)^-1 of the plant's numbers and tau, with those of the start and the offset, and of
the noise model's, without cross terms.
"""
import json
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter


def phi(z):
    """Integrals of exp(z t) and of exp(z (1 - t)) t over t from 0 to 1."""
    if abs(z) < 1e-12:
        return 1 + z / 2, 0.5 + z / 6
    if abs(z) < 0.05:
        terms = [1.0]
        for i in range(1, 14):
            terms.append(terms[-1] * z / (i + 1))
        first = sum(terms)
        return first, sum(t / (i + 2) for i, t in enumerate(terms))
    first = np.expm1(z) / z
    return first, (first - 1) / z


def delayed(u, whole, before):
    return np.concatenate([np.full(whole, before), u])[: len(u)]


def output(num, den, tau, u, h, hold, start=(), cell=None):
    """tau in samples; `cell`: the whole samples of it."""
    cell = int(np.floor(tau)) if cell is None else cell
    share = 1 - (tau - cell)
    before = u[0] if len(start) else 0.0
    v, after = delayed(u, cell + 1, before), delayed(u, cell, before)
    lines = hold == "first-order"
    y = np.zeros(len(u), complex)
    if len(num) == len(den):
        y += num[0] * (v + (share * (after - v) if lines else 0))
    k = np.arange(len(u))
    for p in np.roots(den):
        slope = np.polyval(np.polyder(den), p)
        r = np.polyval(num, p) / slope
        z = p * h
        one, ramp = phi(z)
        b = [h * ramp, h * (one - ramp)] if lines else [0, h * one]
        state = lfilter(b, [1, -np.exp(z)], v.astype(complex))
        part = share * h
        one, ramp = phi(z * share)
        y += r * (np.exp(z * share) * state + part * (one * v + (share * ramp * (after - v) if lines else 0)))
        if len(start):
            y += np.polyval(start, p) / slope * np.exp(z * k)
    return y.real


class Problem:
    def __init__(self, u, y, h, hold, nb, nf, tau=None, cell=None, integrator=False, initial=False, offset=False, nc=0, nd=0):
        self.__dict__.update(locals())
        self.n = nf + integrator

    def split(self, x):
        sizes = [self.nb, self.nf, self.tau is None, self.initial * self.n, self.offset, self.nc, self.nd]
        return np.split(x, np.cumsum(sizes)[:-1])

    def residual(self, x):
        b, f, tau, start, offset, c, d = self.split(x)
        den = np.concatenate([[1], f, [0] * self.integrator])
        tau = (tau[0] if self.tau is None else self.tau) / self.h
        e = self.y - output(b, den, tau, self.u, self.h, self.hold, start, self.cell) - (offset[0] if self.offset else 0)
        return lfilter(np.concatenate([[1], d]), np.concatenate([[1], c]), e)

    def jacobian(self, x, scale):
        columns = []
        for i in range(len(x)):
            step = np.zeros(len(x))
            step[i] = 3e-4 * scale[i]
            f = {k: self.residual(x + k * step) for k in (-3, -2, -1, 1, 2, 3)}
            columns.append((45 * (f[1] - f[-1]) - 9 * (f[2] - f[-2]) + f[3] - f[-3]) / 60 / step[i])
        return np.array(columns).T

    def fit(self, x):
        scale = np.maximum(np.abs(x), 1e-2)
        if self.tau is None:
            scale[self.nb + self.nf] = self.h
        for _ in range(200):
            J, r = self.jacobian(x, scale), self.residual(x)
            step = np.linalg.lstsq(J * scale, -r, rcond=None)[0]
            x = x + scale * step
            if np.max(np.abs(step)) < 2e-13:
                break
        found = least_squares(lambda s: self.residual(s * scale), x / scale, jac=lambda s: self.jacobian(s * scale, scale) * scale,
                              xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert np.max(np.abs(found.x - x / scale)) < 1e-6, (found.x, x / scale)
        return x, scale

    def report(self, x):
        x, scale = self.fit(x)
        J, r = self.jacobian(x, scale), self.residual(x)
        s2 = r @ r / (len(r) - len(x))
        noise = len(x) - self.nc - self.nd
        block = lambda K: np.sqrt(np.diag(s2 * np.linalg.inv(K.T @ K))) if K.shape[1] else np.array([])
        se, noise_se = block(J[:, :noise]), block(J[:, noise:])
        b, f, tau, start, offset, c, d = self.split(x)
        b_se, f_se, tau_se, _, offset_se, _, _ = self.split(np.concatenate([se, noise_se]))
        return x, {
            "theta": [*b, *f], "se": [*b_se, *f_se], "tau": [*tau], "tau_se": [*tau_se],
            "offset": [*offset], "offset_se": [*offset_se], "noise": [*c, *d], "loss": r @ r / len(r), "variance": s2,
        }


random = np.random.default_rng(56)
signs = lambda n, hold: np.repeat(random.choice([-1.0, 1.0], n // hold + 1), hold)[:n]
cases = []


def case(name, method, u, h, hold, b, f, tau, sd, curve=(), integrator=False, level=0.0, start=(), offset=False, c=(), d=()):
    n = len(u)
    den = np.concatenate([[1], f, [0] * integrator])
    x = output(b, den, tau / h, u, h, hold, start)
    v = lfilter(np.concatenate([[1], c]), np.concatenate([[1], d]), sd * random.standard_normal(n))
    y = np.round(x + level + v, 5)
    common = dict(u=u, y=y, h=h, hold=hold, nb=len(b), nf=len(f), integrator=integrator, initial=len(start) > 0, offset=offset,
                  nc=len(c), nd=len(d))
    levels = [level] if offset else []
    truth = np.concatenate([b, f, [tau], start, levels, c, d])
    best = None
    # Within each sample near the truth the loss is smooth; its least value is that of one of them.
    for cell in range(int(tau / h) - 1, int(tau / h) + 2):
        first = truth.copy()
        first[len(b) + len(f)] = (cell + 0.5) * h if cell != int(tau / h) else tau
        try:
            found, expected = Problem(cell=cell, **common).report(first)
        except (AssertionError, np.linalg.LinAlgError):
            continue
        inside = cell <= found[len(b) + len(f)] / h <= cell + 1
        if inside and (best is None or expected["loss"] < best["loss"]):
            best = expected
    known = []
    for given in curve:
        x, expected = Problem(tau=given, **common).report(np.concatenate([b, f, start, levels, c, d]))
        known.append({"tau": given} | {key: expected[key] for key in ("theta", "se", "loss")})
        assert expected["loss"] > best["loss"], (name, given)
    cases.append({
        "name": name, "method": method, "ts": h, "hold": hold, "nb": len(b), "nf": len(f), "nc": len(c), "nd": len(d),
        "integrator": integrator, "initial": len(start) > 0, "offset": offset, "truth": [*b, *f, tau],
        "u": u.tolist(), "y": y.tolist(), "expected": best, "curve": known,
    })
    print(name, best)


case("lag", "srivc", signs(400, 7), 0.05, "zero-order", [2.0], [4.0, 3.0], 0.137, 0.05, curve=[0.0, 0.09, 0.1, 0.131, 0.2])
lines = np.round(lfilter([1.0], [1, -0.8], random.standard_normal(400)), 4)
case("lines", "srivc", lines, 0.1, "first-order", [1.0, 1.0], [0.5, 1.0], 0.234, 0.1, curve=[0.1, 0.26])
case("motor", "srivc", signs(400, 25), 0.01, "zero-order", [79.0], [8.3], 0.0237, 0.05, curve=[0.0, 0.025], integrator=True)
tank = np.round(0.5 + 0.5 * signs(300, 20), 1)
case("tank", "srivc", tank, 1.0, "zero-order", [0.02], [], 2.4, 0.05, curve=[2.0, 2.5], integrator=True, start=[1.2])
stairs = 50 + 5 * np.repeat(random.choice([-2.0, -1.0, 0.0, 1.0, 2.0], 11), 40)[:400]
case("exchanger", "rivc", stairs, 2.0, "zero-order", [0.01375], [0.025], 14.7, 0.05, curve=[12.0, 14.0, 15.3], level=34.5,
     start=[27.0], offset=True, d=[-0.7])

json.dump({"about": __doc__.splitlines()[0], "cases": cases}, open("reference.json", "w"))
