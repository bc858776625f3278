"""Innovations state-space models by scipy, for tests.rs: python3 reference.py FOLDER > reference.json

x(k+1) = A x + B u + K e, y = C x + D u + e in observer form, C = (1, 0 ...), x(0) = 0. The sum of e(k)^2, run sample by sample
in state space, is minimised by scipy's least_squares from six starts around the model of Hannan and Rissanen; the
polynomials are A = det(I - A/q), C = det(I - (A - K C)/q) and B = A (D + C inverse(q - A) B). The standard errors are those of
the polynomials' own Gauss-Newton matrix, s^2 = RSS/(N - parameters). Records less their means. numpy 2, scipy 1.
"""
import json, sys
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

lag = lambda x, i: np.r_[np.zeros(i), x[:len(x) - i]]

def errors(theta, u, y, n, nk):
    a, b, kk, d = theta[:n], theta[n:2 * n], theta[2 * n:3 * n], theta[3 * n] if nk == 0 else 0.0
    e, x = np.empty(len(y)), np.zeros(n)
    for k in range(len(y)):
        e[k] = y[k] - x[0] - d * u[k]
        x = -a * x[0] + np.r_[x[1:], 0] + b * u[k] + kk * e[k]
        if not np.all(np.abs(x) < 1e9):
            return np.full(len(y), 1e3)
    return e

def polynomials(theta, n, nk):
    a, b, kk, d = theta[:n], theta[n:2 * n], theta[2 * n:3 * n], theta[3 * n] if nk == 0 else 0.0
    shift = np.diag(np.ones(n - 1), 1)
    M = shift - np.outer(a, np.eye(n)[0])
    A, C = np.poly(M), np.poly(M - np.outer(kk, np.eye(n)[0]))
    h = np.r_[d, [np.linalg.matrix_power(M, i)[0] @ b for i in range(n)]]
    return A, np.convolve(A, h)[nk:n + 1], C

def arx_start(u, y, n, nk):
    N, p = len(y), 15
    Phi = np.column_stack([-lag(y, i) for i in range(1, p + 1)] + [lag(u, nk + i) for i in range(p)])
    t = np.linalg.lstsq(Phi, y, rcond=None)[0]
    A, B = np.r_[1, t[:p]], np.r_[np.zeros(nk), t[p:]]
    e = lfilter(A, [1], y) - lfilter(B, [1], u)
    Phi = np.column_stack([-lag(y, i) for i in range(1, n + 1)] + [lag(u, nk + i) for i in range(n + 1 - nk)]
                          + [lag(e, i) for i in range(1, n + 1)])
    t = np.linalg.lstsq(Phi, y, rcond=None)[0]
    a, B, c = t[:n], np.r_[np.zeros(nk), t[n:2 * n + 1 - nk]], t[2 * n + 1 - nk:]
    return np.r_[a, B[1:] - B[0] * a, c - a, B[:1] if nk == 0 else []]

def case(folder, file, N, n, nk):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    data = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = (data[k][:N] - data[k][:N].mean() for k in "uy")
    f = lambda t: errors(t, u, y, n, nk)
    start, rng, best = arx_start(u, y, n, nk), np.random.default_rng(1), None
    for i in range(6):
        found = least_squares(f, start + (0.05 * i * rng.standard_normal(len(start)) if i else 0), method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        A, B, C = polynomials(found.x, n, nk)
        print(file, i, found.cost, np.abs(np.roots(C)).max(), file=sys.stderr)
        if np.abs(np.roots(C)).max() < 1 and (best is None or found.cost < best[0]):
            best = found.cost, A, B, C
    _, A, B, C = best
    # Gauss-Newton steps on the polynomials take what differences of least_squares have left.
    nb = n + 1 - nk
    t = np.r_[A[1:], B, C[1:]]
    def parts(t):
        a, b, c = np.r_[1, t[:n]], np.r_[np.zeros(nk), t[n:n + nb]], np.r_[1, t[n + nb:]]
        e = lfilter(a, c, y) - lfilter(b, c, u)
        yf, uf, ef = (lfilter([1], c, x) for x in (y, u, e))
        J = np.column_stack([lag(yf, i) for i in range(1, n + 1)] + [-lag(uf, nk + i) for i in range(nb)] + [-lag(ef, i) for i in range(1, n + 1)])
        return e, J
    for _ in range(200):
        e, J = parts(t)
        t = t - np.linalg.lstsq(J, e, rcond=None)[0]
    e, J = parts(t)
    print("moved", np.abs(t - np.r_[A[1:], B, C[1:]]).max(), "cost", e @ e / 2 - best[0], file=sys.stderr)
    s2 = e @ e / (N - len(t))
    se = np.sqrt(s2 * np.diag(np.linalg.inv(J.T @ J)))
    return dict(file=file, N=N, n=n, nk=nk, A=[1, *t[:n]], B=t[n:n + nb].tolist(), C=[1, *t[n + nb:]], se=se.tolist(), loss=e @ e / N)

cases = [("daisy_dryer.csv", 1000, 3, 0), ("sim_armax2.csv", 1000, 2, 1), ("epfl_laserbeam.csv", 500, 2, 1)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c)) for c in cases) + "]")
