"""CVA, SSARX and PARSIM-K by their definitions, for tests.rs and parsim.rs: python3 reference.py FOLDER > reference.json

No QR of Hankel matrices and no triangles: projections and regressions are least squares on the whole matrices, square
roots of covariances are those of eigenvalues. cva: Z and Y_f less their fits by U_f; the states are the first n rows of
V'(Z Z')^(-1/2) with U S V' = (Y Y')^(-1/2) Y Z' (Z Z')^(-1/2) (Larimore 1990). ssarx: Y_f less the part of u and y since t by
a long ARX model, of the order by AIC = N ln(RSS/N) + 4 p among 1 ... min(50, N/6), zeros before the record (Jansson 2003).
Then (A, B, K) and (C, D) by least squares over t = s ... N-2. parsim-k: row after row as in Pannocchia and Calosi (2010),
then A, B and the initial state by least squares of y filtered by 1/C. Records less their means. numpy 2, scipy 1.
"""
import json, sys
import numpy as np
from scipy.signal import lfilter

lstsq = lambda a, b: np.linalg.lstsq(a, b, rcond=None)[0]

def root(m):
    w, v = np.linalg.eigh(m)
    return v * w ** -0.5 @ v.T

def long_arx(u, y, nk):
    N, best = len(y), None
    lag = lambda x, i: np.r_[np.zeros(i), x[:N - i]]
    for p in range(1, min(50, N // 6) + 1):
        Phi = np.column_stack([-lag(y, i) for i in range(1, p + 1)] + [lag(u, nk + i) for i in range(p)])
        theta = lstsq(Phi, y)
        aic = N * np.log(((y - Phi @ theta) ** 2).mean()) + 4 * p
        if best is None or aic < best[0]:
            best = aic, np.r_[1, theta[:p]], np.r_[np.zeros(nk), theta[p:]]
    return best[1:]

def parsim_k(u, y, N, n, nk, s):
    t = np.arange(s, N - s + 1)
    Z = np.vstack([y[t - 1 - i] for i in range(s)] + [u[t - 1 - i] for i in range(s)])
    U, Y = (np.vstack([x[t + i] for i in range(s)]) for x in (u, y))
    M = lstsq(np.vstack([Z, U[:1]] if nk == 0 else [Z]).T, Y[0])
    G, h, g = [M[:2 * s]], [M[2 * s] if nk == 0 else 0.0], [0.0]
    for i in range(1, s):
        M = lstsq(np.vstack([Z, U[0], Y[0]]).T, Y[i] - sum(h[j] * U[i - j] + g[j] * Y[i - j] for j in range(i)))
        G, h, g = G + [M[:2 * s]], h + [M[2 * s]], g + [M[2 * s + 1]]
    Zp = Z - (lstsq(U.T, Z.T).T @ U)
    w, v = np.linalg.eigh(Zp @ Zp.T)
    left, S, _ = np.linalg.svd(np.array(G) @ (v * w ** 0.5 @ v.T))
    O = left[:, :n] * S[:n] ** 0.5
    C = np.poly(lstsq(O[:-1], O[1:]))
    delta = np.r_[1, np.zeros(N - 1)]
    yf, uf, df = (lfilter([1], C, x) for x in (y, u, delta))
    lag = lambda x, i: np.r_[np.zeros(i), x[:N - i]]
    nb = n + 1 - nk
    theta = lstsq(np.column_stack([lag(yf, i) for i in range(1, n + 1)] + [lag(uf, nk + i) for i in range(nb)]
                                  + [lag(df, i) for i in range(n)]), y)
    return dict(singular_values=S.tolist(), A=np.r_[1, C[1:] - theta[:n]].tolist(), C=C.tolist(), B=theta[n:n + nb].tolist())

def case(folder, file, N, n, nk, s, method):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    d = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = (d[k][:N] - d[k][:N].mean() for k in "uy")
    found = parsim_k(u, y, N, n, nk, s) if method == "parsim-k" else states(u, y, N, n, nk, s, method)
    return dict(method=method, file=file, N=N, n=n, nk=nk, block_rows=s, **found)

def states(u, y, N, n, nk, s, method):
    t = np.arange(s, N - s + 1)
    past = lambda t: np.vstack([y[t - 1 - i] for i in range(s)] + [u[t - 1 - i] for i in range(s)])
    Z = past(t)
    if method == "cva":
        U = np.vstack([u[t + i] for i in range(s)])
        apart = lambda x: x - (lstsq(U.T, x.T).T @ U)
        Y, Zp = apart(np.vstack([y[t + i] for i in range(s)])), apart(Z)
    else:
        a, b = long_arx(u, y, nk)
        Zp, Y = Z, np.vstack([sum(a[j] * y[t + i - j] for j in range(min(len(a), i + 1)))
                              - sum(b[j] * u[t + i - j] for j in range(min(len(b), i + 1))) for i in range(s)])
    whiten = root(Zp @ Zp.T)
    S, Vt = np.linalg.svd(root(Y @ Y.T) @ Y @ Zp.T @ whiten)[1:]
    J = (Vt @ whiten)[:n]
    t = np.arange(s, N - 1)
    x, next_ = J @ past(t), J @ past(t + 1)
    direct = [u[t]] if nk == 0 else []
    CD = lstsq(np.vstack([x, *direct]).T, y[t])
    M = lstsq(np.vstack([x, u[t], y[t]]).T, next_.T).T
    C, D, K = CD[:n], CD[n] if nk == 0 else 0.0, M[:, n + 1]
    A, B = M[:, :n] + np.outer(K, C), M[:, n] + K * D
    A_, C_ = np.poly(A), np.poly(M[:, :n])
    h = np.r_[D, [C @ np.linalg.matrix_power(A, i) @ B for i in range(n)]]
    return dict(correlations=S[:s].tolist(), A=A_.tolist(), C=C_.tolist(), B=np.convolve(A_, h)[nk:n + 1].tolist())

cases = [("daisy_dryer.csv", 1000, 4, 0, 15), ("epfl_laserbeam.csv", 500, 3, 1, 10), ("sim_armax2.csv", 1000, 2, 1, 8)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c, m)) for c in cases for m in ("cva", "ssarx", "parsim-k")) + "]")
