"""The estimates that tests.rs expects: the dense likelihood minimised by scipy from the truth: python reference.py

Generator: x <- (1664525 x + 1013904223) mod 2^32; share = x / 2^32; a normal number is the sum of 12 shares less 6.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, toeplitz
from scipy.optimize import minimize
from scipy.signal import lfilter

N = 150
x = 1


def normal():
    global x
    total = 0.0
    for _ in range(12):
        x = (1664525 * x + 1013904223) % 2**32
        total += x / 2**32
    return total - 6


def loss(z, nb, u, y):
    b, f, logs = z[:nb], z[nb:-3], z[-3:]
    su, sn, sy = np.exp(logs)
    impulse = np.r_[1.0, np.zeros(N - 1)]
    t = toeplitz(lfilter(np.r_[0.0, b], np.r_[1.0, f], impulse), np.zeros(N))
    eye = np.eye(N)
    c = np.block([[(su + sn) * eye, su * t.T], [su * t, su * t @ t.T + sy * eye]])
    try:
        l = cho_factor(c, lower=True)
    except np.linalg.LinAlgError:
        return 1e9
    data = np.r_[u, y]
    return np.log(np.diag(l[0])).sum() + 0.5 * data @ cho_solve(l, data)


for b, f, noise in [([0.8], [-0.9], (0.3, 0.7)), ([1.0, 0.5], [-1.5, 0.7], (0.3, 1.0))]:
    x = 1
    r = np.array([normal() for _ in range(N)])
    u = r + noise[0] * np.array([normal() for _ in range(N)])
    y = lfilter([0.0, *b], [1.0, *f], r) + noise[1] * np.array([normal() for _ in range(N)])
    z = np.r_[b, f, 0, 2 * np.log(noise)]
    for _ in range(3):
        z = minimize(loss, z, (len(b), u, y), "BFGS", options=dict(gtol=1e-9)).x
        z = minimize(loss, z, (len(b), u, y), "Nelder-Mead", options=dict(xatol=1e-10, fatol=1e-12, maxfev=1500, initial_simplex=z + 1e-5 * np.vstack([0 * z, np.eye(len(z))]))).x
    print(u[-1], y[-1], [*map(float, z[:-3])], [*map(float, np.exp(z[-3:]))], loss(z, len(b), u, y))
