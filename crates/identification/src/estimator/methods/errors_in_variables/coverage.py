"""How far the standard errors of tls, bels and iv-compensated hold in short records: python3 coverage.py (numpy 2, scipy 1).

The records of tests.rs with white noises of variances 1 and 0.25 in y and u; each estimator by its definition. The solution x of
g(x) = mean (z z' - D) c = 0 has the covariance H W H'/n, H the pseudoinverse of dg/dx over all of x, the estimated variances
among it, and W the sum of autocovariances of (z z' - D) c with Bartlett's weights. So no term is left out. Each line: the mean
square of error/se, its median over that of chi-squared (0.455), the coverage of 95 % intervals, and the standard deviation of
the errors over the median of se, for a_1, a_2, b_1, b_2.
"""
import numpy as np
from scipy.signal import lfilter

TRUTH = np.array([-1.5, 0.7, 1, 0.5])
SIGNS = np.array([1, 1, -1, -1])

def record(rng, N):
    u = lfilter([1], [1, -0.7], rng.standard_normal(N))
    y = lfilter([0, 1, 0.5], [1, -1.5, 0.7], u)
    return u + 0.5 * rng.standard_normal(N), y + rng.standard_normal(N)

def signals(u, y, earlier):
    k = np.arange(2 + earlier, len(y))
    return np.array([y[k - i] for i in range(3)] + [u[k - 1 - i] for i in range(2 + earlier)]).T

def long_run(scores):
    n = len(scores)
    lags = int(4 * (n / 100) ** (2 / 9))
    W = scores.T @ scores / n
    for lag in range(1, lags + 1):
        G = scores[lag:].T @ scores[:-lag] / n
        W += (1 - lag / (lags + 1)) * (G + G.T)
    return W

def equations(S, x, variances, size):
    """g and dg/dx without the columns of variances."""
    m = len(S)
    c = np.r_[1, SIGNS * x, np.zeros(m - 5)]
    d = np.r_[[variances[0]] * 3, [variances[1]] * 2, np.zeros(m - 5)]
    return c, d, (S @ c - d * c) / size, (S - np.diag(d))[:, 1:5] * SIGNS / size[:, None]

def errors(z, c, d, J, size, first=0):
    H = np.linalg.pinv(J[first:])
    W = long_run(((z * (z @ c)[:, None] - d * c) / size)[:, first:])
    return np.sqrt(np.diag(H @ W @ H.T / len(z)))[:4]

def bels(u, y, known=None):
    z = signals(u, y, 4)
    S = z.T @ z / len(z)
    size = np.sqrt(np.diag(S))
    lines = S[5:] / size[5:, None]
    x = np.r_[np.linalg.lstsq(lines[:, 1:5] * SIGNS, -lines[:, 0], rcond=None)[0], np.zeros(1 if known else 2)]
    def parts(x):
        c, d, g, J = equations(S, x[:4], (x[4], known or x[-1]), size)
        of_y, of_u = np.r_[-c[:3], np.zeros(6)], np.r_[np.zeros(3), -c[3:5], np.zeros(4)]
        columns = [of_y / size] if known else [of_y / size, of_u / size]
        return c, d, g, np.column_stack([J, *columns])
    for _ in range(100):
        _, _, g, J = parts(x)
        step, share = np.linalg.lstsq(J, -g, rcond=None)[0], 1.0
        while share > 1e-6 and np.sum(parts(x + share * step)[2] ** 2) > g @ g:
            share /= 2
        x = x + share * step
        if np.abs(step).max() < 1e-11:
            break
    c, d, _, J = parts(x)
    return x[:4], errors(z, c, d, J, size)

def tls(u, y):
    z = signals(u, y, 0)
    S, r = z.T @ z / len(z), np.array([4.0, 4, 4, 1, 1])
    values, vectors = np.linalg.eigh(S / np.sqrt(np.outer(r, r)))
    c = vectors[:, 0] / np.sqrt(r)
    x, one = SIGNS * c[1:] / c[0], np.ones(5)
    c, d, _, J = equations(S, x, (4 * values[0], values[0]), one)
    return x, errors(z, c, d, np.column_stack([J, -r * c]), one)

def iv_compensated(u, y):
    z = signals(u, y, 0)
    S, one = z.T @ z / len(z), np.ones(5)
    x = np.linalg.solve((S - np.diag([1, 1, 1, 0.25, 0.25]))[1:, 1:] * SIGNS, -S[1:, 0])
    c, d, _, J = equations(S, x, (1, 0.25), one)
    return x, errors(z, c, d, J, one, 1)

def show(name, N, trials, method):
    found = [method(*record(rng, N)) for _ in range(trials)]
    error, se = np.array([x for x, _ in found]) - TRUTH, np.array([se for _, se in found])
    t = error / se
    print(f"N = {N} {name}: mean {np.mean(t**2, 0).round(2)} median {(np.median(t**2, 0) / 0.455).round(2)} covered",
          f"{np.mean(np.abs(t) < 1.96, 0).round(3)} spread {(error.std(0) / np.median(se, 0)).round(2)}", flush=True)

rng = np.random.default_rng(5)
for N, trials in [(1000, 1500), (3000, 1000)]:
    for name, method in [("bels", bels), ("bels, v_u known", lambda u, y: bels(u, y, 0.25)), ("tls", tls),
                         ("iv-compensated", iv_compensated)]:
        show(name, N, trials, method)

# The scores of tls are correlated over n = 2 lags alone, where the noises are white. Those lags with the weight 1 instead:
def long_run(scores):
    n = len(scores)
    G = [scores[lag:].T @ scores[: n - lag] / n for lag in range(3)]
    return G[0] + G[1] + G[1].T + G[2] + G[2].T

for N, trials in [(1000, 1500), (3000, 1000)]:
    show("tls, two lags without weights", N, trials, tls)
