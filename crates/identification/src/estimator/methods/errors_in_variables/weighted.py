"""bels without and with the inverse covariance of its lines' errors as weight, by numbers of earlier inputs, on four plants
and three lengths; u is white, its noise has the variance 0.09, that of y 0.09 of the output's. Needs numpy and scipy:
python3 weighted.py [records of each]"""

import sys

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

PLANTS = [([1, 0.5], [1, -1.5, 0.7]), ([1, -0.6], [1, -1.7, 0.8]), ([0.5, -0.3], [1, -1.4, 0.45]), ([1, 0.9], [1, -1.5, 0.56])]


def record(random, n, b, f, v_y):
    u = random.standard_normal(n + 200)
    y = lfilter([0] + b, f, u)
    noise = random.standard_normal((2, n))
    return u[200:] + 0.3 * noise[0], y[200:] + np.sqrt(v_y) * noise[1]


def bels(u, y, na, nb, earlier, weighted):
    k = np.arange(max(na, nb + earlier), len(y))
    z = np.stack([y[k - i] for i in range(na + 1)] + [u[k - 1 - i] for i in range(nb + earlier)], 1)
    n, width = len(z), na + nb
    s = z.T @ z / n
    sizes = np.sqrt(np.diag(s))

    def c_and_d(x):
        c, d = np.zeros(len(s)), np.zeros(len(s))
        c[0], c[1 : na + 1], c[na + 1 : width + 1] = 1, x[:na], -x[na:width]
        d[: na + 1], d[na + 1 : width + 1] = x[-2], x[-1]
        return c, d

    def lines(x):
        c, d = c_and_d(x)
        return (s @ c - d * c) / sizes

    signs = np.r_[np.ones(na), -np.ones(nb)]
    clean = slice(width + 1, None)
    start = np.linalg.lstsq(s[clean, 1 : width + 1] * signs / sizes[clean, None], -s[clean, 0] / sizes[clean], rcond=None)[0]
    x = least_squares(lines, np.r_[start, 0, 0], method="lm").x
    for _ in range(2 if weighted else 0):
        c, d = c_and_d(x)
        scores = (z * (z @ c)[:, None] - d * c) / sizes - lines(x)
        lags = int(4 * (n / 100) ** (2 / 9))
        covariance = scores.T @ scores / n
        for lag in range(1, lags + 1):
            product = scores[lag:].T @ scores[:-lag] / n
            covariance += (1 - lag / (lags + 1)) * (product + product.T)
        root = np.linalg.cholesky(covariance)
        x = least_squares(lambda x: np.linalg.solve(root, lines(x)), x, method="lm").x
    return x


if __name__ == "__main__":
    random, count = np.random.default_rng(1), int((sys.argv + ["30"])[1])
    for b, f in PLANTS:
        theta = np.r_[f[1:], b]
        v_y = 0.09 * lfilter([0] + b, f, random.standard_normal(20000)).var()
        for n in (300, 1000, 3000):
            records = [record(random, n, b, f, v_y) for _ in range(count)]
            for earlier in (4, 8, 12, 20):
                for weighted in (False, True):
                    found = np.array([bels(*each, 2, 2, earlier, weighted) for each in records])
                    errors = np.linalg.norm(found[:, :4] - theta, axis=1)
                    rms = np.sqrt(((found[:, 0] - theta[0]) ** 2).mean())
                    print(b, f, n, earlier, weighted, f"rms of a_1 {rms:.4f}, off {(errors > 0.5).mean():.2f}, v_u < 0 {(found[:, -1] < 0).mean():.2f}")
