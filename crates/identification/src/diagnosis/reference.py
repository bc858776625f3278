"""F tests of added lags of u by numpy and scipy, straight from the formulas: `python3 reference.py > reference.json`.
`python3 reference.py levels` prints the table of false alarms of docs/records.md.

Projections are least squares of whole columns (no triangles), p-values those of scipy.
"""
import json
import sys

import numpy as np
from scipy.signal import lfilter
from scipy.stats import f as fisher


def divide(d, x):
    return lfilter([1.0], d, np.array(x, dtype=float))


def filtered(c, x):
    return np.convolve(c, x)[: len(x)]


def delayed(x, lag):
    return np.concatenate([np.zeros(lag), x[: len(x) - lag]])


def gradient(model, u, y, rest=True):
    """e and psi with zeros before the record, or with its effect P/(C F), whose P is fitted and a part of psi."""
    A, B, C, D, F, nk = (model[name] for name in ("A", "B", "C", "D", "F", "nk"))
    w = filtered(A, y) - divide(F, filtered(B, u))
    e = divide(C, filtered(D, w))
    columns, free = [], np.zeros(len(y))
    na, nb, nc, nd, nf = len(A) - 1, len(B) - nk, len(C) - 1, len(D) - 1, len(F) - 1
    start = np.zeros((len(y), 0))
    if not rest and nc + nd + nf > 0:
        count = max(nc + nf, nd + na + nf, nd + nb + nk - 1)
        impulse = divide(C, divide(F, np.eye(len(y))[0]))
        start = np.column_stack([delayed(impulse, i) for i in range(count)])
        free = -start @ np.linalg.lstsq(start, e, rcond=None)[0]
        e = e + free
    of_y, of_u = divide(C, filtered(D, y)), divide(F, divide(C, filtered(D, u)))
    columns += [delayed(of_y, i) for i in range(1, len(A))]
    columns += [delayed(of_u, i) for i in range(nk, len(B))]
    columns += [delayed(divide(C, e), i) for i in range(1, len(C))]
    columns += [delayed(divide(C, w), i) for i in range(1, len(D))]
    columns += [delayed(divide(F, filtered(B, of_u) - free), i) for i in range(1, len(F))]
    return e, columns + list(start.T)


def autoregression(v, most):
    """D by Yule-Walker equations, each order solved anew, of the order by AIC."""
    n = len(v)
    r = np.array([v[lag:] @ v[: n - lag] / n for lag in range(most + 1)])
    best, least = np.array([1.0]), n * np.log(r[0])
    for order in range(1, most + 1):
        matrix = np.array([[r[abs(i - j)] for j in range(order)] for i in range(order)])
        d = np.linalg.solve(matrix, -r[1 : order + 1])
        variance = r[0] + d @ r[1 : order + 1]
        criterion = n * np.log(variance) + 2 * order
        if criterion < least:
            best, least = np.concatenate([[1.0], d]), criterion
    return best


def added(e, known, columns, tolerance):
    scale = lambda m: m / np.where(np.linalg.norm(m, axis=0) > 0, np.linalg.norm(m, axis=0), 1)
    left, values, _ = np.linalg.svd(scale(known), full_matrices=False)
    q = left[:, values > tolerance * values[0]]
    z = scale(columns)
    for _ in range(2):
        e, z = e - q @ (q.T @ e), z - q @ (q.T @ z)
    left, values, _ = np.linalg.svd(z, full_matrices=False)
    basis = left[:, values > 1e-6]
    d = len(e) - q.shape[1] - basis.shape[1]
    if basis.shape[1] == 0 or d < 5:
        return None
    explained = np.sum((basis.T @ e) ** 2)
    F = explained / basis.shape[1] / ((e @ e - explained) / d)
    return float(fisher.sf(F, basis.shape[1], d))


def of_two(tests):
    tests = [p for p in tests if p is not None]
    return None if not tests else float(-np.expm1(2 * np.log1p(-min(tests))))


def past(model, u, y, rest):
    e, psi = gradient(model, u, y, rest)
    n, nk = len(u), model["nk"]
    lags = min(25, n // 8)
    has_memory = len(model["C"]) + len(model["D"]) + len(model["F"]) > 3
    reach = max(len(model["A"]) - 1, len(model["B"]) - 1)
    first = 0 if rest else max(0 if has_memory else reach, lags)
    e = e - np.mean(e[first:])
    rows = n - first
    d = autoregression(e[first:], min(10, rows // 20))
    first += len(d) - 1
    white = lambda x: filtered(d, x)[first:]
    known = np.column_stack([white(column) for column in psi] + [np.ones(n - first)])
    least = 1 if nk > 0 else 0
    z = np.column_stack([white(delayed(u, lag)) for lag in range(least, lags + 1)])
    near = 6 - least
    return of_two([added(white(e), known, z[:, :near], 1e-9), added(white(e), known, z, 1e-9)])


def long_order(u, y, delay, most):
    """The order by AIC of A y = B u + e, by least squares with zeros before the record."""
    n, best, least = len(y), 0, np.inf
    pairs = [(delayed(-y, i + 1), delayed(u, delay + i)) for i in range(most)]
    r = np.linalg.qr(np.column_stack([column for pair in pairs for column in pair] + [y]), mode="r")[:, -1]
    for order in range(1, most + 1):
        criterion = n * np.log(np.sum(r[2 * order :] ** 2) / n) + 4 * order
        if criterion < least:
            best, least = order, criterion
    return best


def feedback(u, y, delay):
    n = len(y)
    lags = min(25, n // 8)
    u, y = u - np.mean(u), y - np.mean(y)
    direct = delay == 0
    p = long_order(u, y, 0 if direct else 1, max(1, min(50, n // 6, n // 10)))
    of_y, of_u = min(2 * p, n // 8), min(max(2 * p + 5, p + lags), n // 4)
    first = max(of_y, of_u)
    k = np.arange(first, n - lags)
    ahead = lambda i: u[k + i]
    known = [np.ones(len(k))] + [y[k - i] for i in range(1, of_y + 1)]
    known += [u[k - i] for i in range(0 if direct else 1, of_u + 1)]
    future = [ahead(i) for i in range(1 if direct else 0, lags + 1)]
    test = lambda known, z: added(y[k], np.column_stack(known), np.column_stack(z), 1e-13)
    known_too = known if direct else known + future[:1]
    later = future if direct else future[1:]
    return {
        "p": p,
        "p_value": of_two([test(known, future[:6]), test(known, future)]),
        "at_once": None if direct else test(known, future[:1]),
        "later": test(known_too, later[:5]),
    }


def inputs_of(name, rng, n):
    k = np.arange(n)
    match name:
        case "step":
            return (k >= n // 4).astype(float)
        case "staircase":
            return 2.0 * np.repeat(rng.standard_normal(10), n // 10 + 1)[:n]
        case "ramp":
            return 5.0 * k / n
        case "prbs+50":
            return 50.0 + np.sign(np.repeat(rng.standard_normal(n // 3 + 1), 3)[:n])
        case "sine":
            return np.sin(2 * np.pi * 8 * k / n + rng.uniform(0, 6))
        case "multisine":
            return sum(np.sin(2 * np.pi * i * k / n + rng.uniform(0, 6)) for i in (3, 7, 13, 19))
    return rng.standard_normal(n)


def fitted(arx, u, y, nk):
    """A first-order model with one coefficient of B, from rest: least squares, or Gauss-Newton steps from them."""
    b, pole = np.linalg.lstsq(np.column_stack([delayed(u, nk), delayed(y, 1)])[nk:], y[nk:], rcond=None)[0]
    if arx:
        return dict(A=[1.0, -pole], B=[0.0] * nk + [b], C=[1.0], D=[1.0], F=[1.0], nk=nk)
    cost = lambda b, pole: np.sum((y - divide([1.0, -pole], b * delayed(u, nk))) ** 2)
    pole = min(max(pole, 0.0), 0.995)
    for _ in range(60):
        shape = divide([1.0, -pole], delayed(u, nk))
        psi = np.column_stack([shape, b * delayed(divide([1.0, -pole], shape), 1)])
        move = np.linalg.lstsq(psi, y - b * shape, rcond=None)[0]
        size = 1.0
        while size > 1e-6 and not (
            abs(pole + size * move[1]) < 1 and cost(b + size * move[0], pole + size * move[1]) <= cost(b, pole)
        ):
            size /= 2
        b, pole = b + size * move[0], pole + size * move[1]
    return dict(A=[1.0], B=[0.0] * nk + [b], C=[1.0], D=[1.0], F=[1.0, -pole], nk=nk)


def levels():
    """Percent of records with an alarm at 1 %, pole 0.9, noise 0.1; the last two columns are power."""
    print("| u | oe, N = 100 | oe, N = 300 | arx, N = 100 | arx, N = 300 | delay 2 for 1, N = 300 | 1 for 2 |")
    print("|---|---|---|---|---|---|---|")
    for name in ("prbs+50", "multisine", "step", "white", "staircase", "ramp", "sine"):
        cells = []
        cases = [(False, 100, 1, 1, 200), (False, 300, 1, 1, 100), (True, 100, 1, 1, 200), (True, 300, 1, 1, 100)]
        for arx, n, true, used, trials in cases + [(False, 300, 1, 2, 30), (False, 300, 2, 1, 30)]:
            rng = np.random.default_rng([58, arx, n, true, used])
            alarms, made = np.zeros(2), np.zeros(2)
            for _ in range(trials):
                u, e = inputs_of(name, rng, n), 0.1 * rng.standard_normal(n)
                driven = 0.1 * delayed(u, true)
                y = divide([1.0, -0.9], driven + e) if arx else divide([1.0, -0.9], driven) + e
                p = [past(fitted(arx, u, y, used), u, y, not arx)]
                if true == used:
                    p.append(feedback(u, y, 1)["p_value"])
                for i, p in enumerate(p):
                    made[i] += p is not None
                    alarms[i] += p is not None and p < 0.01
            show = lambda i: f"{100 * alarms[i] / trials:.1f}" if made[i] > trials / 2 else "-"
            cells.append(f"{show(0)} / {show(1)}" if true == used else show(0))
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def main():
    rng = np.random.default_rng(58)
    white = lambda n: np.round(rng.standard_normal(n), 4)
    models = {
        "oe": dict(A=[1.0], B=[0.0, 0.9], C=[1.0], D=[1.0], F=[1.0, -0.8], nk=1),
        "arx": dict(A=[1.0, -1.2, 0.5], B=[0.0, 0.8, 0.4], C=[1.0], D=[1.0], F=[1.0], nk=1),
        "all": dict(A=[1.0, -0.5], B=[0.6, 0.4], C=[1.0, 0.4], D=[1.0, -0.3], F=[1.0, -0.6], nk=0),
    }
    inputs = {
        "step": lambda n: (np.arange(n) >= n // 4).astype(float),
        "staircase": lambda n: np.repeat(rng.integers(-3, 4, n // 15 + 1), 15)[:n].astype(float),
        "offset": lambda n: 50.0 + np.sign(rng.standard_normal(n)),
        "white": white,
    }
    cases = []
    for name, model in models.items():
        for kind, make in inputs.items():
            n = 160
            rest = name != "arx" and kind in ("step", "white")
            u, e = make(n), white(n)
            x = divide(model["F"], filtered(model["B"], u))
            v = divide(model["D"], filtered(model["C"], 0.5 * e))
            y = np.round(divide(model["A"], x + v), 6)
            cases.append({
                "name": f"{name} {kind}", "rest": rest, "u": u.tolist(), "y": y.tolist(),
                "orders": ",".join(f"n{c.lower()}={len(model[c]) - 1}" for c in "ACDF")
                + f",nb={len(model['B']) - model['nk']},nk={model['nk']}",
                "parameters": [*model["A"][1:], *model["B"][model["nk"]:], *model["C"][1:], *model["D"][1:], *model["F"][1:]],
                "past": past(model, u, y, rest),
                "feedback": feedback(u, y, model["nk"]),
            })
    print(json.dumps(cases))


if __name__ == "__main__":
    levels() if sys.argv[1:] == ["levels"] else main()
