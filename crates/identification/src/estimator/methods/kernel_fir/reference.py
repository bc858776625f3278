"""Kernel estimates of impulse responses by dense formulas, for tests.rs: python3 reference.py FOLDER > reference.json

V = c Phi K Phi' + s^2 I (N x N, no factor of K, no QR); the hyperparameters minimise Y'V^-1 Y + ln det V by scipy's
Nelder-Mead from a grid of starts; g = c K Phi'V^-1 Y, P = c K - c K Phi'V^-1 Phi K c (Pillonetto et al.,
Automatica 50, 2014, sections 4 and 11). s^2 is the sample variance of least squares, or a hyperparameter. Records less
their means, zeros before them. numpy 2, scipy 1.
"""
import json, sys
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

def kernel(name, n, alpha, rho):
    i = np.arange(1, n + 1)
    most, sum_, apart = np.maximum.outer(i, i), np.add.outer(i, i), np.abs(np.subtract.outer(i, i))
    if name == "tc":
        return alpha ** most.astype(float)
    if name == "dc":
        return alpha ** (sum_ / 2) * rho ** apart.astype(float)
    return alpha ** (sum_ + most).astype(float) / 2 - alpha ** (3.0 * most) / 6

def case(folder, file, N, nk, n, name, mode):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    d = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = (d[k][:N] - d[k][:N].mean() for k in "uy")
    Phi = np.array([[u[k - nk - i] if k >= nk + i else 0.0 for i in range(n)] for k in range(N)])
    g_ls = np.linalg.lstsq(Phi, y, rcond=None)[0]
    s2_ls = ((y - Phi @ g_ls) ** 2).sum() / (N - n)
    def unpack(x):
        alpha = np.exp(-np.exp(x[1]))
        rho = np.tanh(x[2]) if name == "dc" else 0.5
        s2 = s2_ls if mode == "least-squares" else np.exp(x[-1])
        return np.exp(x[0]) * kernel(name, n, alpha, rho), s2, alpha, rho
    def cost(x):
        if not (-12 < x[1] < 3 and -50 < x[0] < 50):
            return 1e10
        K, s2, _, _ = unpack(x)
        try:
            factor = cho_factor(Phi @ K @ Phi.T + s2 * np.eye(N), lower=True)
        except np.linalg.LinAlgError:
            return 1e10
        return y @ cho_solve(factor, y) + 2 * np.log(np.diag(factor[0])).sum()
    best = None
    for c in (-2, 2):
        for t in (-4, -2.5, -1):
            for r in (0.3, 2.0) if name == "dc" else (0,):
                x = [c, t] + ([r] if name == "dc" else []) + ([np.log(s2_ls)] if mode != "least-squares" else [])
                found = minimize(cost, x, method="Nelder-Mead", options=dict(maxiter=80, xatol=1e-3, fatol=1e-4))
                best = found if best is None or found.fun < best.fun else best
    for _ in range(3):
        best = minimize(cost, best.x, method="Nelder-Mead", options=dict(maxiter=600, xatol=1e-8, fatol=1e-12))
    K, s2, alpha, rho = unpack(best.x)
    factor = cho_factor(Phi @ K @ Phi.T + s2 * np.eye(N), lower=True)
    g = K @ Phi.T @ cho_solve(factor, y)
    P = K - K @ Phi.T @ cho_solve(factor, Phi @ K)
    return dict(file=file, N=N, nk=nk, taps=n, kernel=name, noise_variance=mode, s2=s2, alpha=alpha,
                rho=rho if name == "dc" else None, minus_two_log=best.fun, g=g.tolist(), se=np.sqrt(np.diag(P)).tolist())

cases = [("sim_oe2_short.csv", 120, 1, 30), ("epfl_laserbeam.csv", 120, 1, 40)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c, name, mode)) for c in cases
                      for name in ("tc", "dc", "ss") for mode in ("least-squares", "likelihood")) + "]")
