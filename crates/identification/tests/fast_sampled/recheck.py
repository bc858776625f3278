"""Searches each case of make.py once more, from 9 random denominators and from two of refined instruments, with B by least
squares: a lower minimum replaces the one that is there, and a case whose criterion falls towards the boundary is left
out."""

import json
import sys

import numpy as np
from make import Model
from scipy.signal import lfilter

rng = np.random.default_rng(59)


def lagged(signal, lags):
    return np.array([np.r_[np.zeros(lag), signal[:-lag]] for lag in lags])


def refined(u, y, n, nb, pole):
    """Fifteen passes of simplified refined instruments from signals through 1/(1 - pole q^-1)^n."""
    f, b, best = np.poly([pole] * n), None, (np.inf, None)
    for _ in range(16):
        of_u, of_y = lfilter([1.0], f, u), lfilter([1.0], f, y)
        z = of_y
        if b is not None:
            x = lfilter(np.r_[0, b], f, u)
            best = min(best, (-((x @ y) ** 2) / (x @ x), tuple(f)))
            z = lfilter([1.0], f, x)
        inputs = lagged(of_u, range(1, nb + 1))
        phi = np.vstack([-lagged(of_y, range(1, n + 1)), inputs])
        theta = np.linalg.solve(np.vstack([-lagged(z, range(1, n + 1)), inputs]) @ phi.T,
                                np.vstack([-lagged(z, range(1, n + 1)), inputs]) @ of_y)
        zeros = np.roots(np.r_[1, theta[:n]])
        f = np.real(np.poly(np.where(abs(zeros) >= 1, 1 / np.conj(zeros), zeros)))
        b = theta[n:]
    return np.array(best[1])


def again(case, u, y):
    orders = case["orders"]
    n, nb = orders.get("nf") or orders["na"], orders["nb"]
    model = Model(case["estimator"], orders, u, y, 1e-3)
    best = (case["best"], 0.0, None)
    denominators = [refined(u, y, n, nb, pole) for pole in (0.98, 0.99)]
    for i in range(9):
        zeros = 1 - 10 ** rng.uniform(-4, -0.3, n)
        if i % 3 == 1:
            zeros[-1] = rng.uniform(-1, 1)
        denominators.append(np.poly(zeros))
    for f in denominators:
        columns = lagged(lfilter([1.0], f, u), range(1, nb + 1)).T
        b = np.linalg.lstsq(columns, y, rcond=None)[0]
        start = {"nb": np.r_[0, b], "nf": f, "na": f, "nc": [1.0], "nd": [1.0]}
        found = model.search(model.inverse(start))
        if found and found[0] < best[0] * (1 - 1e-9):
            best = found
    if best[2] is None:
        return case
    p = model.parts(best[2])
    largest = max(max(abs(np.roots(p[name])), default=0) for name in ("nc", "nf"))
    inside = best[1] < 1e-6 and largest < 1 - 1e-7
    print(case, f"{best[0] / case['best'] - 1:.1e}", "inside" if inside else "left out", file=sys.stderr, flush=True)
    return {**case, "best": float(best[0])} if inside else None


records = json.load(open(sys.argv[1]))
for record in records:
    u = np.array([1.0 if sign == "+" else -1.0 for sign in record["u"]])
    y = np.array(record["y"], float)
    record["cases"] = [case for case in (again(case, u, y) for case in record["cases"]) if case]
records = [record for record in records if record["cases"]]
print("[" + ",\n".join(json.dumps(of, separators=(",", ":")) for of in records) + "]")
