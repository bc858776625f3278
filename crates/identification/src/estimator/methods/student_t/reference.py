"""The estimates that tests.rs expects, by scipy from the truth: python reference.py

Generator: x <- (1664525 x + 1013904223) mod 2^32; share = x / 2^32; u the sign of share - 1/2; e = tan(0.9 pi (share - 1/2)).
"""

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.special import gammaln

N = 300
x = 1


def share():
    global x
    x = (1664525 * x + 1013904223) % 2**32
    return x / 2**32


def record(a, b, c, f, gain):
    u = np.array([1.0 if share() >= 0.5 else -1.0 for _ in range(N)])
    e = np.array([np.tan(0.9 * np.pi * (share() - 0.5)) for _ in range(N)])
    return u, lfilter([1], a, lfilter(b, f, u) + gain * lfilter(c, [1], e))


def errors(theta, na, nb, nc, nf, u, y):
    a, b, c, f = np.split(theta, np.cumsum([na, nb, nc]))
    one = lambda p: np.r_[1.0, p]
    if any(len(p) and np.abs(np.roots(one(p))).max() >= 1 for p in (c, f)):
        return np.full(N, 1e6)
    return lfilter([1], one(c), lfilter(one(a), [1], y) - lfilter(np.r_[0.0, b], one(f), u))


def loss(z, k, orders, u, y, nu):
    s2 = np.exp(z[k])
    nu = np.exp(z[k + 1]) if nu is None else nu
    e = errors(z[:k], *orders, u, y)
    norm = gammaln(nu / 2) - gammaln((nu + 1) / 2) + np.log(nu) / 2
    return N * (np.log(s2) / 2 + norm) + (nu + 1) / 2 * np.log1p(e**2 / (nu * s2)).sum()


cases = [
    ("nb=1,nf=1,nk=1", ([1], [0, 0.8], [1], [1, -0.9]), [0.8, -0.9], 0.3),
    ("na=2,nb=2,nc=1,nk=1", ([1, -1.5, 0.7], [0, 1, 0.5], [1, -0.5], [1]), [-1.5, 0.7, 1, 0.5, -0.5], 0.2),
]
for name, model, truth, gain in cases:
    sizes = [len(p) - 1 for p in model]
    x = 1
    u, y = record(*model, gain)
    for nu in (3.0, None):
        k = len(truth)
        z = np.r_[truth, 2 * np.log(gain), [np.log(3.0)] if nu is None else []]
        for _ in range(6):
            z = minimize(loss, z, (k, sizes, u, y, nu), "Nelder-Mead", options=dict(xatol=1e-12, fatol=1e-13, maxiter=40000, maxfev=40000)).x
        print(name, nu, y[-1], [*map(float, z[:k])], float(np.exp(z[k])), float(np.exp(z[-1])) if nu is None else nu, loss(z, k, sizes, u, y, nu))
