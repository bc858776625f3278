"""Makes reference.json: 50 filters and 50 placements, of plants in units of states and time from 1e-9 to 1e9.

A plant is A = rate D A0 D^-1, c = D^-1 c0, rounded to doubles, D the `units`; the filters have Q = D Q0 D times rate and
r, the discrete ones (rate 1) F = A. P and the gain are the stabilising solution of the rounded equation, to 60 digits:
scipy's solution of the plain one, in these units, improved by Newton's iteration (Kleinman 1968, Hewer 1971) with mpmath at
120 digits, each step a Lyapunov equation in Kronecker form. Gains that place poles are Ackermann's formula with mpmath at
120 digits.

`condition` bounds how errors of eps in the data change P, relative to its norm, both in plain units: for filters
||T^-1|| (2 ||A|| ||P|| + ||Q|| + ||P||^2 ||c||^2 / r) / ||P|| with T the operator of Newton's step (Kenney and Hewer 1990),
for discrete ones ||T^-1|| (2 ||F||^2 ||P|| + ||Q||) / ||P||; for placements it is the condition number of the
observability matrix, time in units of the norm of A0, with rows and columns divided by their largest entries.

    python3 reference.py > reference.json   # made with mpmath 1.3.0, NumPy 2.4.6, SciPy 1.17.1
"""

import json

import mpmath as mp
import numpy as np
from scipy.linalg import solve_continuous_are, solve_discrete_are

mp.mp.dps = 120
rng = np.random.default_rng(630)


def matrix(m):
    return mp.matrix(np.atleast_2d(m).tolist())


def lyapunov(a, q, discrete):
    """X of A X + X A' + Q = 0, or of X = A X A' + Q, by one linear system."""
    n = a.rows
    t = mp.zeros(n * n, n * n)
    for i in range(n):
        for j in range(n):
            for k in range(n):
                for l in range(n):
                    t[i * n + j, k * n + l] = (
                        (i == k and j == l) - a[i, k] * a[j, l]
                        if discrete
                        else -(a[i, k] * (j == l) + a[j, l] * (i == k))
                    )
    x = mp.lu_solve(t, mp.matrix([q[i, j] for i in range(n) for j in range(n)]))
    return mp.matrix([[x[i * n + j] for j in range(n)] for i in range(n)])


def solve(a, c, q, r, start, discrete):
    a, c, q, p, r = matrix(a), matrix(c).T, matrix(q), matrix(start), mp.mpf(r)
    for _ in range(30):
        gain = a * p * c / ((c.T * p * c)[0] + r) if discrete else p * c / r
        closed = a - gain * c.T
        new = lyapunov(closed, q + gain * r * gain.T, discrete)
        change = max(abs((x - y) / x) for x, y in zip(new, p) if x != 0)
        p = new
        if change < mp.mpf(10) ** -60:
            gain = a * p * c / ((c.T * p * c)[0] + r) if discrete else p * c / r
            return p, gain
    raise ValueError("no convergence")


def condition(a, c, q, r, p, discrete):
    n, norm = len(a), lambda m: np.linalg.norm(m, 2)
    gain = a @ p @ c / (c @ p @ c + r) if discrete else p @ c / r
    closed = a - np.outer(gain, c)
    eye = np.eye(n)
    t = np.eye(n * n) - np.kron(closed, closed) if discrete else np.kron(closed, eye) + np.kron(eye, closed)
    size = 2 * norm(a) ** 2 * norm(p) if discrete else 2 * norm(a) * norm(p) + norm(p) ** 2 * (c @ c) / r
    return norm(np.linalg.inv(t)) * (size + norm(q)) / norm(p)


def plain(n, discrete):
    a = rng.normal(size=(n, n))
    if discrete:
        return a * rng.uniform(0.3, 1.3) / max(abs(np.linalg.eigvals(a)))
    return a - rng.uniform(-0.5, 3) * np.eye(n)


def flat(m):
    return [float(x) for x in m]


filters = []
for number in range(50):
    discrete = number % 2 == 1
    n = int(rng.integers(1, 5))
    a0, c0 = plain(n, discrete), rng.normal(size=n)
    root = rng.normal(size=(n, n)) * 10 ** rng.uniform(-1.5, 1.5)
    q0, r = root @ root.T, 10 ** rng.uniform(-9, 9)
    q0 *= r
    units, rate = 10 ** rng.uniform(-9, 9, n), 1.0 if discrete else 10 ** rng.uniform(-9, 9)
    start = (solve_discrete_are if discrete else solve_continuous_are)(a0.T, c0[:, None], q0, np.array([[r]]))
    digits = condition(a0, c0, q0, r, start, discrete)
    a, c = rate * units[:, None] * a0 / units, c0 / units
    # x in units D: w of intensity rate Q; v of intensity r / rate gives the same filter in the time rate t.
    q, r = rate * np.outer(units, units) * q0, r / rate
    q = (q + q.T) / 2
    p, gain = solve(a, c, q, r, np.outer(units, units) * start, discrete)
    filters.append({
        "discrete": discrete, "units": units.tolist(), "rate": rate, "a": a.ravel().tolist(), "c": c.tolist(),
        "q": q.ravel().tolist(), "r": r, "p": flat(p), "gain": flat(gain), "condition": float(f"{digits:.3g}"),
    })

placements = []
for number in range(50):
    n = int(rng.integers(2, 8))
    kind = number % 4
    if kind == 0:
        a0, c0 = plain(n, False), rng.normal(size=n)
    elif kind == 1:  # a heat rod
        a0, c0 = np.diag([-2.0] * n) + np.diag([1.0] * (n - 1), 1) + np.diag([1.0] * (n - 1), -1), np.eye(n)[-1]
    elif kind == 2:  # lags in a row
        a0, c0 = np.diag(-rng.uniform(0.5, 3, n)) + np.diag([1.0] * (n - 1), 1), np.eye(n)[0]
    else:  # lags side by side
        a0, c0 = np.diag(-np.sort(rng.uniform(0.2, 4, n))), rng.normal(size=n)
    rows, row = [], c0
    for _ in range(n):
        rows.append(row)
        row = row @ a0 / np.linalg.norm(a0, 1)
    o = np.array(rows)
    o = o / abs(o).max(0)
    number = float(f"{np.linalg.cond(o / abs(o).max(1)[:, None], 1):.3g}")
    units, rate = 10 ** rng.uniform(-9, 9, n), 10 ** rng.uniform(-9, 9)
    a, c = rate * units[:, None] * a0 / units, c0 / units
    poles = [-rate * rng.uniform(0.5, 3) for _ in range(n % 2)]
    for _ in range(n // 2):
        pole = rate * complex(-rng.uniform(0.5, 3), rng.uniform(0, 3))
        poles += [pole, pole.conjugate()]
    m, c_row = matrix(a), matrix(c)
    o = mp.zeros(n, n)
    row = c_row
    for i in range(n):
        o[i, :] = row
        row = row * m
    gain = mp.lu_solve(o, mp.matrix([0] * (n - 1) + [1]))
    for pole in poles:
        gain = m * gain - mp.mpc(pole) * gain
    assert all(abs(x.imag) <= mp.mpf(10) ** -60 * abs(x) for x in gain)
    placements.append({
        "units": units.tolist(), "rate": rate, "a": a.ravel().tolist(), "c": c.tolist(),
        "poles": ",".join(repr(p) if not isinstance(p, complex) else f"{p.real!r}{p.imag:+}i" for p in poles),
        "gain": [float(x.real) for x in gain], "condition": number,
    })

lines = lambda cases: ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
print('{"filters":[\n' + lines(filters) + '\n],"placements":[\n' + lines(placements) + "\n]}")
