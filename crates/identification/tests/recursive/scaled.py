"""Makes scaled.json: recursive least squares, instrumental variables (delayed, auxiliary) and extended least squares of
records in other units, by the formulas of expected.json (docs/methods.md for the auxiliary model) in 60 digits.

    python3 crates/identification/tests/recursive/scaled.py > crates/identification/tests/recursive/scaled.json   # made with mpmath 1.3.0
"""

import csv
import json
from pathlib import Path

import mpmath as mp

mp.mp.dps = 60
DATA = Path(__file__).parent / "../../../../tests/recorded_data/data"
AT = [50, 150, 400]


def record(name, scale_u, scale_y):
    lines = [line for line in (DATA / name).open() if line[0] in "-.0123456789"]
    rows = list(csv.reader(lines))[: AT[-1]]
    return [[mp.mpf(float(row[i]) * scale) for row in rows] for i, scale in ((1, scale_u), (2, scale_y))]


def stable(a):
    """Jury's test by the step-down recursion."""
    a = [mp.mpf(1), *a]
    while len(a) > 1:
        k = a[-1]
        if abs(k) >= 1:
            return False
        a = [(a[i] - k * a[-1 - i]) / (1 - k * k) for i in range(len(a) - 1)]
    return True


def recursion(method, u, y, orders, lam, p0, start=0):
    na, nb, nc, nk = (orders[key] for key in ("na", "nb", "nc", "nk"))
    d, first = na + nb + nc, max(na, nb + nk - 1)
    at = lambda s, k: s[k] if k >= 0 else mp.mpf(0)
    theta, lam = [mp.mpf(0)] * d, mp.mpf(lam)
    p = [[mp.mpf(p0) if i == j else mp.mpf(0) for j in range(d)] for i in range(d)]
    eps, x, kept, out = [mp.mpf(0)] * len(u), [mp.mpf(0)] * len(u), [mp.mpf(0)] * d, {}
    dot = lambda a, b: mp.fsum(v * w for v, w in zip(a, b))
    for k in range(first, len(u)):
        inputs = [at(u, k - nk - i) for i in range(nb)]
        phi = [-at(y, k - 1 - i) for i in range(na)] + inputs + [at(eps, k - 1 - i) for i in range(nc)]
        z = own = phi
        if method == "delayed" and k - first >= start:
            z = [at(u, k - nk - nb - i) for i in range(na)] + inputs
        elif method == "auxiliary":
            own = [-at(x, k - 1 - i) for i in range(na)] + inputs
            z = own if k - first >= start else phi
        pz = [dot(row, z) for row in p]
        left = [dot(phi, [p[i][j] for i in range(d)]) for j in range(d)]
        scale = lam + dot(phi, pz)
        error = y[k] - dot(phi, theta)
        theta = [t + g / scale * error for t, g in zip(theta, pz)]
        p = [[(p[i][j] - pz[i] / scale * left[j]) / lam for j in range(d)] for i in range(d)]
        eps[k] = y[k] - dot(phi, theta)
        if stable(theta[:na]):
            kept = theta
        x[k] = dot(own, kept)
        if k + 1 in AT:
            out[k + 1] = [float(t) for t in theta]
    return out


cases = []
for data, nk in (("sim_armax2.csv", 1), ("daisy_dryer.csv", 3)):
    for scale_u, scale_y in ((1e-6, 1e-6), (1.0, 1.0), (1e6, 1e6), (1e-3, 1e3)):
        u, y = record(data, scale_u, scale_y)
        for method in ("rls", "delayed", "auxiliary", "rels"):
            for lam, p0 in ((1.0, 100.0), (0.99, 1e6)):
                # Extended least squares has residuals in units of y among its regressors, which is no other difficulty.
                orders = {"na": 2, "nb": 2, "nc": 1 if method == "rels" else 0, "nk": nk}
                cases.append({"data": data, "scale_u": scale_u, "scale_y": scale_y, "method": method, "orders": orders,
                              "forgetting": lam, "p0": p0, "theta": recursion(method, u, y, orders, lam, p0)})
# While the A of the start is not stable its output is 0, so Z'Phi has not full rank for longer than d equations.
for data, nk in (("sim_armax2.csv", 1), ("daisy_dryer.csv", 3)):
    for scale_u, scale_y in ((1.0, 1.0), (1.0, 1e6)):
        u, y = record(data, scale_u, scale_y)
        # Delayed inputs are added to what the start has in units of y, which costs the digits of the ratio.
        for method in ("delayed", "auxiliary") if scale_y == 1.0 else ("auxiliary",):
            for p0 in (1e16, 1e18):
                for start in (0, 1, 2, 3):
                    orders = {"na": 2, "nb": 2, "nc": 0, "nk": nk}
                    theta = recursion(method, u, y, orders, 1.0, p0, start)
                    cases.append({"data": data, "scale_u": scale_u, "scale_y": scale_y, "method": method,
                                  "orders": orders, "forgetting": 1.0, "p0": p0, "start": start, "theta": theta})
print(json.dumps({"cases": cases}))
