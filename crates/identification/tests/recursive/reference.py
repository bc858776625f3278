"""Makes reference.json: recursive refined IV, the recursive prediction error method and the joint extended Kalman filter,
in plain matrix arithmetic from the formulas of their sources, on records of NumPy's.

SRIV: Young, Recursive Estimation and Time-Series Analysis (2011), chapter 7, with P as a matrix and the filters as sums
over all past samples with the coefficients of their own times. RPEM: Ljung and Soderstrom, Theory and Practice of
Recursive Identification (1983), section 3.7 (general SISO), with R(k) = R(k-1) lambda + psi psi' inverted anew at every
k; during its start y stands for B/F u where there is no A. EKF: Ljung, Asymptotic behavior of the extended Kalman filter (1979), with full Jacobians and the plain P update.

    python3 crates/identification/tests/recursive/reference.py > crates/identification/tests/recursive/reference.json   # made with NumPy 2.4.6, SciPy 1.17.1
"""

import json

import numpy as np
from scipy.signal import lfilter

rng = np.random.default_rng(37)
SAMPLES = 300
AT = [40, 80, 150, 300]


def record(a, b, c, d, f, nk, sigma):
    u = rng.normal(size=SAMPLES)
    e = sigma * rng.normal(size=SAMPLES)
    x = lfilter(np.r_[np.zeros(nk), b], np.polymul(a, f), u)
    return u, x + lfilter(c, np.polymul(a, d), e)


def stable(p):
    return len(p) < 2 or np.all(np.abs(np.roots(p)) < 1)


def at(x, k):
    return x[k] if k >= 0 else 0.0


def sriv(u, y, nb, nf, nk, lam, early, start, p0, theta0):
    """theta = (b, f)."""
    d, first = nb + nf, max(nf, nb + nk - 1)
    theta, p = np.array(theta0, float), p0 * np.eye(d)
    kept = np.zeros(d)
    uf, yf, x, xf = (np.zeros(SAMPLES) for _ in range(4))
    out, rows, missing = {}, 0, lam - early
    for k in range(SAMPLES):
        f = kept[nb:]
        uf[k] = u[k] - sum(f[i] * at(uf, k - 1 - i) for i in range(nf))
        yf[k] = y[k] - sum(f[i] * at(yf, k - 1 - i) for i in range(nf))
        if k >= first:
            lags = lambda s, t: np.array([at(s, k - nk - i) for i in range(nb)] + [-at(t, k - 1 - i) for i in range(nf)])
            if rows < start:
                phi = z = lags(u, y)
                target, lk = y[k], lam
            else:
                phi, z = lags(uf, yf), lags(uf, xf)
                target, lk = yf[k], lam - missing
                missing *= 0.99
            gain = p @ z / (lk + phi @ p @ z)
            theta = theta + gain * (target - phi @ theta)
            p = (p - np.outer(gain, phi @ p)) / lk
            rows += 1
            if stable(np.r_[1, theta[nb:]]):
                kept = theta.copy()
        b, f = kept[:nb], kept[nb:]
        x[k] = sum(b[i] * at(u, k - nk - i) for i in range(nb)) - sum(f[i] * at(x, k - 1 - i) for i in range(nf))
        xf[k] = x[k] - sum(f[i] * at(xf, k - 1 - i) for i in range(nf))
        if k + 1 in AT:
            out[k + 1] = theta.tolist()
    return out


def rpem(u, y, orders, lam, early, start, p0, theta0):
    na, nb, nc, nd, nf, nk = (orders[key] for key in ("na", "nb", "nc", "nd", "nf", "nk"))
    ends = np.cumsum([na, nb, nc, nd, nf])
    split = lambda t: np.split(np.asarray(t), ends[:-1])
    d, first = ends[-1], max(na + nf, nb + nk - 1)
    theta, ls, r = np.array(theta0, float), np.array(theta0, float), np.eye(d) / p0
    common = range(na) if na else range(d - nf, d)
    places = sorted([*common, *range(na, na + nb)])
    w, v, eps, yc, uc, wc, uf, wf, ec, vc = (np.zeros(SAMPLES) for _ in range(10))
    lags = lambda s, k, n, shift=1: np.array([at(s, k - shift - i) for i in range(n)])
    out, rows, missing, started = {}, 0, lam - early, False
    for k in range(SAMPLES):
        a, b, c, dd, f = split(theta)
        uc[k] = u[k] + dd @ lags(u, k, nd) - c @ lags(uc, k, nc)
        uf[k] = uc[k] - f @ lags(uf, k, nf)
        if k >= first and rows < start:
            phi = np.zeros(d)
            phi[na:na + nb] = lags(u, k, nb, nk)
            phi[list(common)] = -lags(y, k, len(common))
            phi = phi[places]
            sub = np.ix_(places, places)
            r = lam * r if lam < 1 else r
            r[sub] += np.outer(phi, phi)
            ls[places] += np.linalg.solve(r[sub], phi) * (y[k] - phi @ ls[places])
            rows += 1
            _, _, c, _, f = split(ls)
            if stable(np.r_[1, c]) and stable(np.r_[1, f]):
                theta = ls.copy()
        elif k >= first:
            started = True
            phi = np.r_[-lags(y, k, na), lags(u, k, nb, nk), lags(eps, k, nc), -lags(v, k, nd), -lags(w, k, nf)]
            psi = np.r_[-lags(yc, k, na), lags(uf, k, nb, nk), lags(ec, k, nc), -lags(vc, k, nd), -lags(wf, k, nf)]
            error = y[k] - phi @ theta
            lk, missing = lam - missing, missing * 0.99
            r = lk * r + np.outer(psi, psi)
            step = np.linalg.solve(r, psi) * error
            for _ in range(21):
                _, _, c, _, f = split(theta + step)
                if stable(np.r_[1, c]) and stable(np.r_[1, f]):
                    theta = theta + step
                    break
                step = step / 2
        a, b, c, dd, f = split(theta)
        w[k] = y[k] if not started and na == 0 else b @ lags(u, k, nb, nk) - f @ lags(w, k, nf)
        v[k] = y[k] + a @ lags(y, k, na) - w[k]
        eps[k] = v[k] + dd @ lags(v, k, nd) - c @ lags(eps, k, nc)
        yc[k] = y[k] + dd @ lags(y, k, nd) - c @ lags(yc, k, nc)
        wc[k] = w[k] + dd @ lags(w, k, nd) - c @ lags(wc, k, nc)
        wf[k] = wc[k] - f @ lags(wf, k, nf)
        ec[k] = eps[k] - c @ lags(ec, k, nc)
        vc[k] = v[k] - c @ lags(vc, k, nc)
        if k + 1 in AT:
            out[k + 1] = theta.tolist()
    return out


def ekf(u, y, n, x0, a0, b0, px, ptheta, r, qx, qtheta):
    """State (x, a, b): x(k+1) = A x + b u, A the companion matrix of a; y = x_1 + e. Filtered at k, then predicted."""
    s = np.r_[x0, a0, b0]
    p = np.diag(np.r_[np.full(n, px), np.full(2 * n, ptheta)])
    q = np.diag(np.r_[np.full(n, qx), np.full(2 * n, qtheta)])
    h = np.eye(3 * n)[0]
    out = {}
    for k in range(SAMPLES):
        gain = p @ h / (h @ p @ h + r)
        s = s + gain * (y[k] - s[0])
        p = p - np.outer(gain, h @ p)
        x, a, b = np.split(s, 3)
        jacobian = np.eye(3 * n)
        jacobian[:n, :n] = np.eye(n, k=1)
        jacobian[n - 1, :n] = a
        jacobian[n - 1, n:2 * n] = x
        jacobian[:n, 2 * n:] = u[k] * np.eye(n)
        s = np.r_[np.r_[x[1:], a @ x] + b * u[k], a, b]
        p = jacobian @ p @ jacobian.T + q
        if k + 1 in AT:
            out[k + 1] = s.tolist()
    return out


def orders(**given):
    return {key: given.get(key, 0) for key in ("na", "nb", "nc", "nd", "nf")} | {"nk": given.get("nk", 1)}


cases = []
one, f2, b2 = [1.0], [1, -1.5, 0.7], [1.0, 0.5]
for nk, lam, early, start, p0 in [(1, 1.0, 1.0, 10, 100.0), (2, 0.995, 0.95, 8, 1000.0), (0, 1.0, 0.97, 0, 1.0)]:
    u, y = record(one, b2, one, one, f2, nk, 0.5)
    theta0 = [0.5, 0.2, -1.2, 0.5] if start == 0 else [0.0] * 4
    common = {"u": u.tolist(), "y": y.tolist(), "lambda": lam, "early": early, "start": start, "p0": p0, "theta0": theta0}
    form = orders(nb=2, nf=2, nk=nk)
    cases.append({"method": "sriv", "orders": form, **common,
                  "theta": sriv(u, y, 2, 2, nk, lam, early, start, p0, theta0)})
    cases.append({"method": "rpem", "orders": form, **common, "theta": rpem(u, y, form, lam, early, start, p0, theta0)})
for form, truth in [
    (orders(na=2, nb=2, nc=2), (f2, b2, [1, -0.8, 0.2], one, one)),
    (orders(nb=2, nc=1, nd=1, nf=2), (one, b2, [1, 0.5], [1, -0.7], f2)),
    (orders(na=1, nb=1, nc=1, nd=1, nf=1, nk=0), ([1, -0.6], [1.0], [1, 0.4], [1, -0.3], [1, -0.8])),
    (orders(na=2, nc=1), (f2, [0.0], [1, 0.5], one, one)),
]:
    u, y = record(*truth, form["nk"], 0.5)
    theta0 = [0.0] * sum(form[key] for key in ("na", "nb", "nc", "nd", "nf"))
    for lam, early, start, p0 in [(1.0, 1.0, 12, 10.0), (0.99, 0.95, 0, 100.0)]:
        cases.append({"method": "rpem", "orders": form, "u": u.tolist(), "y": y.tolist(), "lambda": lam, "early": early,
                      "start": start, "p0": p0, "theta0": theta0,
                      "theta": rpem(u, y, form, lam, early, start, p0, theta0)})

filters = []
for n, a in [(1, [0.8]), (2, [-0.7, 1.5]), (3, [0.2, -0.95, 1.6])]:
    b = [1.0, 0.5, 0.25][:n]
    companion = np.eye(n, k=1)
    companion[-1] = a
    x, u, y = np.ones(n), rng.normal(size=SAMPLES), np.zeros(SAMPLES)
    for k in range(SAMPLES):
        y[k] = x[0] + 0.3 * rng.normal()
        x = companion @ x + np.array(b) * u[k]
    start = {"x0": [0.0] * n, "a0": [0.5 * v for v in a], "b0": [0.8] * n}
    tuning = {"px": 4.0, "ptheta": 1.0, "r": 0.09, "qx": 1e-4, "qtheta": 1e-6}
    filters.append({"n": n, "u": u.tolist(), "y": y.tolist(), **start, **tuning,
                    "state": ekf(u, y, n, **start, **tuning)})

print(json.dumps({"at": AT, "recursions": cases, "filters": filters}))
