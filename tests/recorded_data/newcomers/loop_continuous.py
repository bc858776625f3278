"""A record of a plant in continuous time in a closed loop, and clrivc by numpy and scipy, for tests/recorded_data/newcomers.rs.

python3 loop_continuous.py (numpy 2, scipy 1) writes loop_continuous.csv and loop_continuous.json.

(s + 1)/(s^2 + 0.5 s + 1) with the controller (10 s + 15)/s of Gilson, Garnier, Young and Van den Hof (2008), here at the samples,
K = (10 + (15 h - 10)/q)/(1 - 1/q), u = r - K y, h = 0.02, noise (1 + 0.5/q)/(1 - 0.85/q) e. r has random signs for 40 samples
each. All signals are zero before the record.

The equations are solved as a root: sum z(k) e(k) = 0 with e = D/C (y - B/A u), z = D/C (-s B/A^2 v, -B/A^2 v, s/A v, 1/A v) at
the samples, and the derivatives of sum e(k)^2 by c and d are 0. v is the loop's input without noise, by the controller around the
sampled model or by the least squares of a long model. Filters in s are scipy's matrix exponential for an input that is constant
between samples.
"""
import json
import numpy as np
from scipy.linalg import expm
from scipy.optimize import root
from scipy.signal import lfilter

rng = np.random.default_rng(33)
N, h = 1500, 0.02
KN, KM = np.array([10, 15 * h - 10]), np.array([1.0, -1.0])


def states(den, v):
    """s^(n-1)/den v ... 1/den v."""
    n = len(den) - 1
    M = np.zeros((n + 1, n + 1))
    M[0, :n], M[0, n] = -np.array(den[1:]), 1
    M[range(1, n), range(n - 1)] = 1
    E = expm(M * h)
    x, all = np.zeros(n), np.empty((len(v), n))
    for k in range(len(v)):
        all[k] = x
        x = E[:n, :n] @ x + E[:n, n] * v[k]
    return all.T


def sampled(b, a):
    """B(q) and F(q) of a model of order 2, from its first samples of an impulse response."""
    M = np.array([[-a[0], -a[1], 1], [1, 0, 0], [0, 0, 0.0]])
    E = expm(M * h)
    f = np.poly(E[:2, :2])
    g = np.array([0, b @ E[:2, 2], b @ E[:2, :2] @ E[:2, 2]])
    return np.convolve(f, g)[:3], f


lag = lambda s, n: np.concatenate([np.zeros(n), s[:len(s) - n]])
r = np.repeat(rng.choice([-1.0, 1.0], N // 40 + 1), 40)[:N]
e = lfilter([1, 0.5], [1, -0.85], 0.01 * rng.standard_normal(N))
B, F = sampled(np.array([1.0, 1.0]), np.array([0.5, 1.0]))
x, y, k, u = (np.zeros(N) for _ in range(4))
past = lambda s, i, lag: s[i - lag] if i >= lag else 0.0
for i in range(N):
    x[i] = -F[1] * past(x, i, 1) - F[2] * past(x, i, 2) + B[1] * past(u, i, 1) + B[2] * past(u, i, 2)
    y[i] = x[i] + e[i]
    k[i] = past(k, i, 1) + KN[0] * y[i] + KN[1] * past(y, i, 1)
    u[i] = r[i] - k[i]
with open("loop_continuous.csv", "w") as to:
    to.write("t,u,y,r\n")
    for i in range(N):
        to.write(f"{i * h:.4g},{u[i]:.6f},{y[i]:.6f},{r[i]:.0f}\n")
data = np.genfromtxt("loop_continuous.csv", delimiter=",", names=True)
u, y, r = data["u"], data["y"], data["r"]


def follows(s, m):
    columns = [-lag(s, i) for i in range(1, m + 1)] + [lag(r, i) for i in range(m + 1)]
    theta = np.linalg.lstsq(np.array(columns).T, s, rcond=None)[0]
    a, b = np.concatenate([[1], theta[:m]]), theta[m:]
    assert np.all(np.abs(np.roots(a)) < 1)
    return lfilter(b, a, r)


def closed(b, a):
    b, f = sampled(b, a)
    den = np.convolve(f, KM) + np.convolve(b, KN)
    assert np.all(np.abs(np.roots(den)) < 1)
    return lfilter(np.convolve(f, KM), den, r)


def clrivc(source):
    def parts(t):
        b, a, c, d = t[:2], t[2:4], np.array([1, t[4]]), np.array([1, t[5]])
        den = np.concatenate([[1], a])
        w = y - b @ states(den, u)
        v = source(b, a)
        both = states(np.convolve(den, den), v)
        of_x = [both[1] * b[0] + both[2] * b[1], both[2] * b[0] + both[3] * b[1]]
        z = lfilter(d, c, np.array([*states(den, v), -of_x[0], -of_x[1]]))
        slopes = np.array([-lag(lfilter(d, np.convolve(c, c), w), 1), lag(lfilter([1], c, w), 1)])
        return lfilter(d, c, w), z, slopes

    def equations(t):
        e, z, slopes = parts(t)
        return np.concatenate([z @ e / np.sqrt((z**2).sum(1)), slopes @ e / np.sqrt((slopes**2).sum(1))])

    t = np.array([1, 1, 0.5, 1, 0.5, -0.85])
    for _ in range(4):
        t = root(equations, t, method="hybr", options={"xtol": 1e-15}).x
    # Newton's steps with central differences take what is left.
    for _ in range(6):
        J = np.array([(equations(t + s) - equations(t - s)) / 2e-5 for s in 1e-5 * np.eye(6)]).T
        t = t - np.linalg.solve(J, equations(t))
    assert np.max(np.abs(equations(t))) < 1e-12, equations(t)
    e, z, slopes = parts(t)
    s2 = e @ e / (N - 6)
    se = np.sqrt(s2 * np.diag(np.linalg.inv(z @ z.T)))
    noise_se = np.sqrt(s2 * np.diag(np.linalg.inv(slopes @ slopes.T)))
    return {"theta": list(t[:4]), "se": list(se), "noise": list(t[4:]), "noise_se": list(noise_se), "loss": e @ e / N}


known = follows(u, 12)
case = {"data": "loop_continuous.csv", "method": "clrivc", "orders": "nb=2,nc=1,nd=1,nf=2,nk=1", "hold": "zero-order", "ts": h}
controller = f"{KN[0]:g},{KN[1]:g}/1,-1"
cases = [
    case | {"arguments": ["--controller", controller], "expected": clrivc(closed)},
    case | {"arguments": ["--long", "12"], "expected": clrivc(lambda b, a: known)},
]
json.dump({"about": __doc__.splitlines()[0], "cases": cases}, open("loop_continuous.json", "w"), indent=1)
for case in cases:
    print(case["arguments"], {k: np.round(v, 5).tolist() for k, v in case["expected"].items()})
