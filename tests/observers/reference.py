"""Makes reference.json: Kalman filters with coloured noise, and GPEBO in discrete time, on a record of NumPy's.

Kalman: x(k+1) = A x + b u + w, E w w' = rho I, y = x_1 + C(q)/D(q) e, E e^2 = 1, A = [0 I; a']. The noise is in
controllable canonical form, s(k+1) = Ad s + (1, 0, ...)' e, f = (c - c_0 d)'s + c_0 e, not in the program's innovations
form; the steady state is by scipy.linalg.solve_discrete_are, rho by scipy.optimize.minimize_scalar of -2 log L.

GPEBO: theta_hat(k) by least squares on all rows up to k - 1 at once (not recursive), Phi(k) by matrix powers; DREM with
the determinant and the cofactors of [phi(k); ...; phi(k - n + 1)].

    python3 tests/observers/reference.py > tests/observers/reference.json   # made with NumPy 2.4.6, SciPy 1.17.1
"""

import json

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

rng = np.random.default_rng(31)
AT = [1, 2, 5, 20, 119]
SAMPLES = 120


def companion(a):
    n = len(a)
    m = np.eye(n, k=1)
    m[-1] = a
    return m


def record(a, b, c, d, q, s):
    """u, y of the plant with process noise of deviation q and measurement noise s C/D e."""
    m, x = companion(a), rng.normal(size=len(a)) * 3
    u = rng.choice([-1.0, 1.0], SAMPLES)
    f = lfilter(c, d, rng.normal(size=SAMPLES)) * s
    y = []
    for k in range(SAMPLES):
        y.append(x[0] + f[k])
        x = m @ x + np.array(b) * u[k] + q * rng.normal(size=len(a))
    return u, np.array(y)


def augmented(a, b, c, d):
    n, m = len(a), max(len(c), len(d)) - 1
    c, d = np.pad(np.array(c, float), (0, m + 1 - len(c))), np.pad(np.array(d, float), (0, m + 1 - len(d)))
    noise = np.eye(m, k=-1)
    noise[0] = -d[1:]
    f = np.block([[companion(a), np.zeros((n, m))], [np.zeros((m, n)), noise]])
    h = np.concatenate([np.eye(n)[0], c[1:] - c[0] * d[1:]])
    g = np.concatenate([np.zeros(n), np.eye(m)[0]])
    return f, np.concatenate([b, np.zeros(m)]), h, g, c[0]


def kalman(case, rho):
    """-2 log L at the best sigma^2, and xhat(k)."""
    f, b, h, g, c0 = augmented(case["a"], case["b"], case["c"], case["d"])
    n = len(case["a"])
    q = np.outer(g, g)
    q[:n, :n] = rho * np.eye(n)
    s = (g * c0)[:, None]
    p = solve_discrete_are(f.T, h[:, None], q, [[c0**2]], s=s)
    v = h @ p @ h + c0**2
    gain = (f @ p @ h + s[:, 0]) / v
    x, squares, states = np.concatenate([case["x0"], np.zeros(len(h) - n)]), 0.0, []
    for u, y in zip(case["u"], case["y"]):
        states.append(x[:n])
        e = y - h @ x
        squares += e * e / v
        x = f @ x + b * u + gain * e
    k = len(case["y"])
    return k * (np.log(2 * np.pi * squares / k) + 1) + k * np.log(v), states


def cofactors(m):
    n = len(m)
    minor = lambda i, j: np.linalg.det(np.delete(np.delete(m, i, 0), j, 1)) if n > 1 else 1.0
    return np.array([[(-1) ** (i + j) * minor(i, j) for j in range(n)] for i in range(n)])


def gpebo(case, gamma, rho):
    a, b, n = companion(case["a"]), np.array(case["b"]), len(case["a"])
    xi, theta, drem, squares = [np.array(case["x0"])], np.zeros(n), [], []
    for u in case["u"]:
        xi.append(a @ xi[-1] + b * u)
    powers = [np.linalg.matrix_power(a, k) for k in range(SAMPLES)]
    rows = np.array([p[0] for p in powers])
    z = np.array(case["y"]) - np.array(xi)[:SAMPLES, 0]
    for k in range(SAMPLES):
        root = np.vstack([rows[:k], np.sqrt(rho) * np.eye(n)])
        fit = np.linalg.lstsq(root, np.concatenate([z[:k], np.zeros(n)]), rcond=None)[0]
        squares.append(xi[k] + powers[k] @ fit)
        drem.append(xi[k] + powers[k] @ theta)
        if k >= n - 1:
            m = rows[k - n + 1 : k + 1][::-1]
            delta, mixed = np.linalg.det(m), cofactors(m).T @ z[k - n + 1 : k + 1][::-1]
            theta = theta + gamma * delta * (mixed - delta * theta) / (1 + gamma * delta**2)
    return drem, squares


def at(states):
    return [list(states[k]) for k in AT]


second = {"a": [-0.7, 1.5], "b": [1.0, 0.5], "x0": [0.5, -1.0]}
third = {"a": [0.657, -2.17, 2.5], "b": [1.0, 0.4, -0.3], "x0": [0.0, 1.0, 0.0]}
swing = {"a": [-1.0, 1.910672978251212], "b": [0.024813061596885566, 0.07222205], "x0": [0.0, 0.0]}
paper = {
    "a": [-0.00009, 0.002835, -0.035525, 0.2275, -0.7875, 1.4],
    "b": [0.6, 0.2, 0.1, 0.3, 0.4, 0.5],
    "x0": [1.0] * 6,
}
out = {"at": AT, "kalman": [], "gpebo": []}
for plant, c, d, q in [
    (second, [1.0, 0.7], [1.0, -0.9], 0.3),
    (second, [1.0, -0.4, 0.2], [1.0, -0.8], 0.05),
    (third, [1.0], [1.0, -1.2, 0.5], 0.2),
]:
    u, y = record(plant["a"], plant["b"], c, d, q, 0.5)
    case = {**plant, "c": c, "d": d, "u": list(u), "y": list(y), "filters": []}
    for rho in [0.01, 0.3]:
        cost, states = kalman(case, rho)
        case["filters"].append({"rho": rho, "minus_two_log": cost, "xhat": at(states)})
    best = minimize_scalar(lambda z: kalman(case, 10**z)[0], bounds=(-6, 3), method="bounded", options={"xatol": 1e-9})
    case["best"] = {"rho": 10**best.x, "minus_two_log": best.fun}
    out["kalman"].append(case)
for plant, gamma, rho in [(second, 2.0, 0.1), (third, 0.5, 0.01), (swing, 3.0, 1.0), (paper, 1.0, 0.01)]:
    u, y = record(plant["a"], plant["b"], [1.0], [1.0], 0.0, 0.5)
    case = {**plant, "u": list(u), "y": list(y), "gamma": gamma, "rho": rho}
    drem, squares = gpebo(case, gamma, rho)
    out["gpebo"].append({**case, "drem": at(drem), "squares": at(squares)})
print(json.dumps(out, indent=None, default=float))
