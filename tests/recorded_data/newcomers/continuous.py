"""Records of plants in continuous time, and their least squares by scipy, for tests/recorded_data/newcomers.rs.

python3 continuous.py (numpy 2, scipy 1) writes rao_garnier.csv, hybrid.csv, lines.csv and continuous.json.

Plants and protocols: Rao and Garnier 2004 (rao_garnier: Ts = 0.01, random signs, white noise, 10 dB); Young, Garnier and
Gilson 2008 (hybrid: 2/(s^2+4s+3), Ts = 0.05, noise (1+0.9/q)/(1-1/q+0.2/q^2)); lines: (s+1)/(s^2+0.5s+1), Ts = 0.1, input
on straight lines between samples.

The output of B/A is a sum of modes r/(s-p), each a recursion whose coefficients are integrals of exp(p t) by hand: no
matrix exponential. The sum of (D/C (y - B/A u))^2 over all coefficients is least, all signals zero before the record,
by scipy.optimize.least_squares with differences; so are the standard errors, s^2 (J'J)^-1, and of the noise model's and the
plant's blocks without cross terms.
"""
import json
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter


def output(num, den, u, h, hold):
    poles = np.roots(den)
    direct = num[0] if len(num) == len(den) else 0.0
    y = direct * u
    for p in poles:
        r = np.polyval(num, p) / np.polyval(np.polyder(den), p)
        z = p * h
        e = np.exp(z)
        if hold == "zero-order":
            b = [0, h * np.expm1(z) / z]
        else:
            late = (np.expm1(z) - z) / z**2
            b = [h * late, h * (np.expm1(z) / z - late)]
        y = y + (r * lfilter(b, [1, -e], u)).real
    return y


def fit(u, y, num, den, h, hold, c=(), d=()):
    nb, n, nc = len(num), len(den) - 1, len(c)
    truth = np.concatenate([num, den[1:], c, d])
    scale = np.abs(truth)

    def residual(x):
        x = x * scale
        b, a = x[:nb], np.concatenate([[1], x[nb:nb + n]])
        cq, dq = (np.concatenate([[1], part]) for part in (x[nb + n:nb + n + nc], x[nb + n + nc:]))
        return lfilter(dq, cq, y - output(b, a, u, h, hold))

    def jacobian(x):
        columns = []
        for i in range(len(x)):
            step = np.zeros(len(x))
            step[i] = 3e-4 * max(abs(x[i]), 1e-2)
            f = {k: residual(x + k * step) for k in (-3, -2, -1, 1, 2, 3)}
            columns.append((45 * (f[1] - f[-1]) - 9 * (f[2] - f[-2]) + f[3] - f[-3]) / 60 / step[i])
        return np.array(columns).T

    x = truth / scale
    for _ in range(100):
        J, r = jacobian(x), residual(x)
        step = np.linalg.lstsq(J, -r, rcond=None)[0]
        x = x + step
        if np.max(np.abs(step)) < 1e-12:
            break
    found = least_squares(residual, truth / scale, jac=lambda x: jacobian(x), xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert np.max(np.abs(found.x - x)) < 1e-6, (found.x, x)
    J, r = jacobian(x), residual(x)
    s2 = r @ r / (len(y) - len(x))
    plant = nb + n
    blocks = [J[:, :plant], J[:, plant:]]
    variances = [np.diag(s2 * np.linalg.inv(K.T @ K)) for K in blocks if K.shape[1]]
    se = np.sqrt(np.concatenate(variances)) * scale
    x = x * scale
    return {
        "theta": list(x[:plant]), "se": list(se[:plant]), "noise": list(x[plant:]), "noise_se": list(se[plant:]),
        "loss": r @ r / len(y), "noise_variance": s2,
    }


def write(name, h, u, y):
    with open(name, "w") as to:
        to.write("t,u,y\n")
        for k in range(len(u)):
            to.write(f"{k * h:.4g},{u[k]:.6g},{y[k]:.5f}\n")
    data = np.genfromtxt(name, delimiter=",", names=True)
    return data["u"], data["y"]


random = np.random.default_rng(8)
signs = lambda n, hold=1: np.repeat(random.choice([-1.0, 1.0], n // hold + 1), hold)[:n]
cases = []

num, den, h = [-6400.0, 1600.0], [1.0, 5.0, 408.0, 416.0, 1600.0], 0.01
u = signs(1000, 7)
x = output(num, den, u, h, "zero-order")
u, y = write("rao_garnier.csv", h, u, x + np.std(x) / np.sqrt(10) * random.standard_normal(len(u)))
case = {"data": "rao_garnier.csv", "method": "srivc", "orders": "nb=2,nf=4,nk=1", "hold": "zero-order", "ts": h}
cases.append(case | {"expected": fit(u, y, num, den, h, "zero-order")})

num, den, h = [2.0], [1.0, 4.0, 3.0], 0.05
u = signs(1016, 8)
x = output(num, den, u, h, "zero-order")
v = lfilter([1, 0.9], [1, -1, 0.2], random.standard_normal(len(u)))
u, y = write("hybrid.csv", h, u, x + np.std(x) / np.std(v) * 10**-0.75 * v)
case = {"data": "hybrid.csv", "hold": "zero-order", "ts": h}
cases.append(case | {"method": "srivc", "orders": "nb=1,nf=2,nk=1", "expected": fit(u, y, num, den, h, "zero-order")})
found = fit(u, y, num, den, h, "zero-order", [0.9], [-1.0, 0.2])
cases.append(case | {"method": "rivc", "orders": "nb=1,nc=1,nd=2,nf=2,nk=1", "expected": found})

num, den, h = [1.0, 1.0], [1.0, 0.5, 1.0], 0.1
u = np.round(lfilter([1.0], [1, -0.8], random.standard_normal(800)), 4)
x = output(num, den, u, h, "first-order")
u, y = write("lines.csv", h, u, x + 0.1 * np.std(x) * random.standard_normal(len(u)))
case = {"data": "lines.csv", "method": "srivc", "orders": "nb=2,nf=2,nk=1", "hold": "first-order", "ts": h}
cases.append(case | {"expected": fit(u, y, num, den, h, "first-order")})

json.dump({"about": __doc__.splitlines()[0], "cases": cases}, open("continuous.json", "w"), indent=1)
for case in cases:
    print(case["data"], case["method"], case["expected"]["theta"], case["expected"]["se"])
