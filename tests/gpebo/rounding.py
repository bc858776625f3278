"""Makes rounding.json: plants whose exponentials are badly conditioned, beyond what balancing mends.

A = T diag(poles) T^-1 with integer T of determinant 1, so that A is exact; y = x_1. `rms_x1` and `rms_x` are the root mean
squares over [0, 1] of x from (1, ..., 1), by the closed form of the sum of exponentials with mpmath at 80 digits.

    python3 tests/gpebo/rounding.py > tests/gpebo/rounding.json   # made with mpmath 1.3.0, NumPy 2.4.6
"""

import json

import mpmath as mp
import numpy as np

mp.mp.dps = 80
rng = np.random.default_rng(5)


def unimodular(n, most):
    """A product of random shears with integers, dense."""
    t = np.eye(n, dtype=object).astype(int).astype(object)
    for _ in range(3 * n):
        i, j = rng.choice(n, 2, replace=False)
        t[i] = t[i] + int(rng.integers(-most, most + 1)) * t[j]
    return t


cases = []
while len(cases) < 12:
    n = 2
    t = unimodular(n, int(rng.integers(2, 25)))
    poles = [-1 - 3 * i for i in range(n - 1)] + [-int(rng.integers(20, 200))]
    exact = mp.matrix(t.tolist())
    inverse = exact ** -1
    a = exact * mp.diag(poles) * inverse
    rows = [[int(mp.nint(a[i, j])) for j in range(n)] for i in range(n)]
    if max(abs(x) for row in rows for x in row) > 2**52 or rows[0][1] == 0:
        continue
    weights = inverse * mp.matrix([1] * n)
    squares = []
    for i in range(n):
        c = [exact[i, k] * weights[k] for k in range(n)]
        squares.append(sum(c[k] * c[l] * (mp.e ** (poles[k] + poles[l]) - 1) / (poles[k] + poles[l])
                           for k in range(n) for l in range(n)))
    condition = float(mp.mnorm(exact, 1) * mp.mnorm(inverse, 1))
    if condition < 1e4:
        continue
    cases.append({"a": rows, "condition": float(f"{condition:.2g}"), "rms_x1": float(mp.sqrt(squares[0])),
                  "rms_x": float(mp.sqrt(sum(squares)))})
print("[\n" + ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases) + "\n]")
