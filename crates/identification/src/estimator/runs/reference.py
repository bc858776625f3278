"""One model of three records, by NumPy and SciPy, for tests.rs: python3 reference.py > reference.json

The records are of y = B/F u + 1/F e with starts that are not at rest. arx: the equations of all records that look back only
within a record. iv: four passes from arx, instruments the output of the last model from the state that fits each record
best. oe, armax, bj: the sum of squared prediction errors of all records, from rest or with numbers for what was before
each. Standard errors: s^2 = RSS / (equations - parameters, of starts too). numpy 2, scipy 1.
"""
import json
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

N, NA, NB = [70, 110, 90], 2, 2
A0, B0 = [1, -1.5, 0.7], [0, 1, 0.5]

def records():
    rng, found = np.random.default_rng(57), []
    for n in N:
        u, e = np.sign(rng.standard_normal(n)), 0.5 * rng.standard_normal(n)
        y, x = np.zeros(n), 3 * rng.standard_normal(2)
        for k in range(n):
            y[k] = x[0] + e[k]
            x = np.r_[1.5 * x[0] + x[1] + u[k], -0.7 * x[0] + 0.5 * u[k]]
            x += np.r_[1.5 * e[k], -0.7 * e[k]]
        found.append((np.round(u, 12), np.round(y, 12)))
    return found

def rows(x, lags, first):
    return np.column_stack([x[first - i:len(x) - i] for i in lags])

def stacked(data, instruments=None):
    phi = np.vstack([np.hstack([-rows(y, (1, 2), 2), rows(u, (1, 2), 2)]) for u, y in data])
    z = phi if instruments is None else np.vstack(
        [np.hstack([-rows(x, (1, 2), 2), rows(u, (1, 2), 2)]) for (u, _), x in zip(data, instruments)])
    return phi, z, np.concatenate([y[2:] for _, y in data])

def solve(phi, z, y):
    theta = np.linalg.solve(z.T @ phi, z.T @ y)
    s2 = np.sum((y - phi @ theta) ** 2) / (len(y) - 4)
    inverse = np.linalg.inv(z.T @ phi)
    return theta, np.sqrt(s2 * np.diag(inverse @ (z.T @ z) @ inverse.T))

def simulated(theta, u, y):
    """The model's output from the state that fits y best: forced, and the two free responses."""
    a, b = np.r_[1, theta[:2]], np.r_[0, theta[2:]]
    impulses = [np.eye(len(y))[0], np.eye(len(y))[1]]
    free = np.column_stack([lfilter([1], a, i) for i in impulses])
    forced = lfilter(b, a, u)
    return forced + free @ np.linalg.lstsq(free, y - forced, rcond=None)[0]

FORMS = {"oe": (0, 2, 0, 0, 2), "armax": (2, 2, 2, 0, 0), "bj": (0, 2, 1, 1, 2)}

def split(theta, orders):
    parts = np.split(theta, np.cumsum(orders))
    a, b, c, d, f = (np.r_[0 if i == 1 else 1, p] for i, p in enumerate(parts[:5]))
    return a, b, c, d, f, parts[5]

def errors(theta, orders, data, numbers):
    a, b, c, d, f, starts = split(theta, orders)
    if any(len(p) > 1 and max(abs(np.roots(p))) >= 1 for p in (c, f)):
        return np.full(sum(N), 1e3)
    found = []
    for i, (u, y) in enumerate(data):
        e = lfilter(d, c, lfilter(a, [1], y) - lfilter(b, f, u))
        if numbers:
            p = starts[i * numbers:(i + 1) * numbers]
            e += lfilter(p, np.convolve(c, f), np.eye(len(y))[0])
        found.append(e)
    return np.concatenate(found)

def minimised(form, data, estimate):
    na, nb, nc, nd, nf = orders = FORMS[form]
    numbers = max(nc + nf, nd + na + nf, nd + nb + 1 - 1) if estimate else 0
    truth = [-1.5, 0.7] * (na > 0) + [1, 0.5] + [0.1] * nc + [0.1] * nd + [-1.5, 0.7] * (nf > 0)
    rng, best = np.random.default_rng(1), None
    for i in range(8):
        start = np.r_[truth, np.zeros(numbers * len(data))] * (1 + 0.05 * i * rng.standard_normal(1))
        fit = least_squares(errors, start, args=(orders, data, numbers), xtol=1e-15, ftol=1e-15, gtol=1e-15,
                            x_scale="jac", jac="3-point", max_nfev=4000)
        best = fit if best is None or fit.cost < best.cost else best
    free = len(best.x)
    s2 = 2 * best.cost / (sum(N) - free)
    se = np.sqrt(s2 * np.diag(np.linalg.inv(best.jac.T @ best.jac)))
    return best.x[:sum(orders)], se[:sum(orders)], 2 * best.cost / sum(N)

data, cases = records(), []
phi, _, y = stacked(data)
theta, se = solve(phi, phi, y)
cases.append({"estimator": "arx", "initial": None, "theta": list(theta), "se": list(se)})
for _ in range(4):
    z = [simulated(theta, u, y) for u, y in data]
    theta, se = solve(*stacked(data, z))
cases.append({"estimator": "iv", "initial": None, "theta": list(theta), "se": list(se)})
for form in FORMS:
    for estimate in (False, True):
        theta, se, loss = minimised(form, data, estimate)
        cases.append({"estimator": form, "initial": "estimate" if estimate else "zero", "theta": list(theta),
                      "se": list(se), "loss": loss})
print(json.dumps({"records": [[list(u), list(y)] for u, y in data], "cases": cases}))
