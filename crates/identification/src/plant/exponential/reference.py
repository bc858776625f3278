"""Makes reference.json: 200 matrix exponentials, of matrices whose states are in units from 1e-10 to 1e10.

Each `a` is D A0 D^-1 rounded to doubles, D the `units`, A0 of one of eight kinds. `exact` is its exponential, by scaling,
a Taylor series and squaring with mpmath at 160 digits, checked at 200, rounded to doubles. `condition` is the condition
number of the exponential of D^-1 a D in the Frobenius norm, by scipy.linalg.expm_cond.

    python3 reference.py > reference.json   # made with mpmath 1.3.0, NumPy 2.4.6, SciPy 1.17.1
"""

import json

import mpmath as mp
import numpy as np
from scipy.linalg import expm_cond

rng = np.random.default_rng(63)
EACH = 25


def exponential(a, digits):
    """e^a by 40 + log2(norm) halvings and the series, whose remainder is below 10^-digits."""
    with mp.workdps(digits):
        m = mp.matrix(a.tolist())
        halvings = 40 + max(0, int(mp.ceil(mp.log(mp.mnorm(m, 1) + 1, 2))))
        m = m / mp.mpf(2) ** halvings
        term = total = mp.eye(len(a))
        k = 0
        while mp.mnorm(term, 1) > mp.mpf(10) ** -digits:
            k += 1
            term = term * m / k
            total = total + term
        for _ in range(halvings):
            total = total * total
        return total


def stable(n, fastest):
    """Real poles from -1 to -fastest, and a pair, in random coordinates."""
    poles = np.diag(-(10 ** rng.uniform(0, np.log10(fastest), n)))
    poles[0, 1], poles[1, 0], poles[1, 1] = 3, -3, poles[0, 0]
    v = rng.normal(size=(n, n)) + 2 * np.eye(n)
    return v @ poles @ np.linalg.inv(v)


def plain(kind, n):
    if kind == "random":
        return rng.normal(size=(n, n)) * 10 ** rng.uniform(-2, 1)
    if kind == "stable":
        return stable(n, 10 ** rng.uniform(0.3, 2.5))
    if kind == "triangular":
        return np.diag(-(10 ** rng.uniform(-1, 1.5, n))) + np.triu(rng.normal(size=(n, n)), 1) * 10 ** rng.uniform(0, 5)
    if kind == "companion":
        m = np.eye(n, k=1)
        m[-1] = -np.poly(-(10 ** rng.uniform(-1, 1, n)))[:0:-1]
        return m
    if kind == "held":
        m = np.zeros((n + 2, n + 2))
        m[:n, :n], m[:n, n], m[n, n + 1] = stable(n, 30), rng.normal(size=n), 1
        return m
    if kind == "oscillators":
        m = rng.normal(size=(n, n)) * 10 ** rng.uniform(0, 1.5)
        return (m - m.T) / 2 - 0.1 * np.eye(n)
    if kind == "cycle":
        m = np.diag(-(10 ** rng.uniform(0, 1.8, n)))
        for i in range(n):
            m[i, (i + 1) % n] += rng.choice([-1, 1]) * 10 ** rng.uniform(0, 1.5)
        return m
    half = max(1, n // 2)
    a, g, c = stable(max(half, 2), 20), rng.normal(size=(max(half, 2), 1)), rng.normal(size=(max(half, 2), 1))
    return np.block([[-a.T, c @ c.T], [g @ g.T, a]])


cases = []
KINDS = ["random", "stable", "triangular", "companion", "held", "oscillators", "cycle", "hamiltonian"]
for kind in KINDS:
    for _ in range(EACH):
        a = plain(kind, int(rng.integers(2, 5)))
        units = 10 ** rng.uniform(-10, 10, len(a))
        a = units[:, None] * a / units[None, :]
        exact, check = exponential(a, 160), exponential(a, 200)
        off = max(abs((e - c) / c) for e, c in zip(exact, check) if c != 0)
        assert off < 1e-60, (kind, off)
        flat = lambda m: [float(x) for x in m]
        cases.append({
            "kind": kind,
            "units": units.tolist(),
            "a": a.ravel().tolist(),
            "condition": float(f"{expm_cond(a * units[None, :] / units[:, None]):.3g}"),
            "exact": [float(exact[i, j]) for i in range(len(a)) for j in range(len(a))],
        })
print("[\n" + ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases) + "\n]")
