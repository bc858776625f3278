"""A record of a closed loop, and methods for it by numpy and scipy, for tests/recorded_data/newcomers.rs.

python3 loop.py (numpy 2, scipy 1) writes loop.csv and loop.json.

y = B/F u + C/D e, u = r - K y, with B = 1/q + 0.5/q^2, F = 1 - 1.5/q + 0.7/q^2, C = 1 + 0.6/q, D = 1 - 0.8/q,
K = 0.1/(1 - 0.5/q), r random signs, e of standard deviation 0.3. All signals are zero before the record.

clriv solves its equations as a root, not by an iteration over linear problems: sum z(k) e(k) = 0 with e = D/C (y - B/F u),
z = D/(C F) (-x(k-1), -x(k-2), v(k-1), v(k-2)), x = B/F v, and the derivatives of sum e(k)^2 by c and d are 0. v is the loop's
input without noise: F M/(F M + B N) r with the controller, or what follows from r by the least squares of a long model.
two-stage, joint: least squares of y, or of what of y follows from r, minus B/F v. indirect: the model of the loop from r to y
by Gauss-Newton steps with its Jacobian, and the weighted least squares of its linear equations. iv4: its four
steps by solve and lstsq, with r instead of u in the instruments.
"""
import json
import numpy as np
from scipy.optimize import least_squares, root
from scipy.signal import lfilter

rng = np.random.default_rng(21)
N = 1000
B, F, C, D = [0, 1, 0.5], [1, -1.5, 0.7], [1, 0.6], [1, -0.8]
KN, KM = np.array([0.1, 0.0]), np.array([1, -0.5])
r = rng.choice([-1.0, 1.0], N)
v = lfilter(C, D, 0.3 * rng.standard_normal(N))
y, u, x, k = np.zeros(N), np.zeros(N), np.zeros(N), np.zeros(N)
past = lambda s, i, lag: s[i - lag] if i >= lag else 0.0
for i in range(N):
    x[i] = 1.5 * past(x, i, 1) - 0.7 * past(x, i, 2) + past(u, i, 1) + 0.5 * past(u, i, 2)
    y[i] = x[i] + v[i]
    k[i] = 0.5 * past(k, i, 1) + 0.1 * y[i]
    u[i] = r[i] - k[i]
with open("loop.csv", "w") as to:
    to.write("u,y,r\n")
    for row in zip(u, y, r):
        to.write(f"{row[0]:.5f},{row[1]:.5f},{row[2]:.0f}\n")
data = np.genfromtxt("loop.csv", delimiter=",", names=True)
u, y, r = data["u"], data["y"], data["r"]
lag = lambda s, n: np.concatenate([np.zeros(n), s[:len(s) - n]])


def follows(s, m):
    columns = [-lag(s, i) for i in range(1, m + 1)] + [lag(r, i) for i in range(m + 1)]
    theta = np.linalg.lstsq(np.array(columns).T, s, rcond=None)[0]
    a, b = np.concatenate([[1], theta[:m]]), theta[m:]
    assert np.all(np.abs(np.roots(a)) < 1)
    return lfilter(b, a, r)


def clriv(source):
    def parts(t):
        b, f, c, d = np.concatenate([[0], t[:2]]), np.concatenate([[1], t[2:4]]), np.array([1, t[4]]), np.array([1, t[5]])
        e = lfilter(d, c, y - lfilter(b, f, u))
        v = source(b, f)
        vf = lfilter(d, np.convolve(c, f), v)
        xf = lfilter(b, f, vf)
        z = np.array([-lag(xf, 1), -lag(xf, 2), lag(vf, 1), lag(vf, 2)])
        w = y - lfilter(b, f, u)
        slopes = np.array([-lag(lfilter(d, np.convolve(c, c), w), 1), lag(lfilter([1], c, w), 1)])
        return e, z, slopes

    def equations(t):
        e, z, slopes = parts(t)
        return np.concatenate([z @ e, slopes @ e]) / N

    found = root(equations, [1, 0.5, -1.5, 0.7, 0.6, -0.8], method="hybr", options={"xtol": 1e-15})
    assert np.max(np.abs(equations(found.x))) < 1e-12
    e, z, slopes = parts(found.x)
    s2 = e @ e / (N - 6)
    P, Q = s2 * np.linalg.inv(z @ z.T), s2 * np.linalg.inv(slopes @ slopes.T)
    order = [2, 3]
    se = np.concatenate([np.sqrt(np.diag(P))[[2, 3]], np.sqrt(np.diag(Q)), np.sqrt(np.diag(P))[[0, 1]]])
    b1, b2, f1, f2, c1, d1 = found.x
    return {"B": [b1, b2], "C": [c1], "D": [d1], "F": [f1, f2], "se": list(se)}


def closed(b, f):
    den = np.convolve(f, KM) + np.convolve(b, KN)[:4]
    return lfilter(np.convolve(f, KM), den, r)


def output_error(v, y, nb, nf, start):
    def parts(t):
        b, f = np.concatenate([[0], t[:nb]]), np.concatenate([[1], t[nb:]])
        x, vf = lfilter(b, f, v), lfilter([1], f, v)
        xf = lfilter([1], f, x)
        return y - x, np.array([lag(vf, i + 1) for i in range(nb)] + [-lag(xf, i + 1) for i in range(nf)]).T

    t = np.array(start)
    for _ in range(60):
        e, J = parts(t)
        t = t + np.linalg.lstsq(J, e, rcond=None)[0]
    check = least_squares(lambda t: parts(t)[0], start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.max(np.abs(check.x - t)) < 1e-5
    e, J = parts(t)
    return t, e @ e / (N - len(t)) * np.linalg.inv(J.T @ J)


m = 10
cases = []
known = follows(u, m)
controller = "0.1/1,-0.5"
clriv_orders = "nb=2,nc=1,nd=1,nf=2,nk=1"
arguments = ["--orders", clriv_orders, "--controller", controller]
cases.append({"method": "clriv", "arguments": arguments, "expected": clriv(closed)})
arguments = ["--orders", clriv_orders, "--long", str(m)]
cases.append({"method": "clriv", "arguments": arguments, "expected": clriv(lambda b, f: known)})
oe = ["--orders", "nb=2,nf=2,nk=1"]
for method, target in [("two-stage", y), ("joint", follows(y, m))]:
    t, _ = output_error(known, target, 2, 2, [1, 0.5, -1.5, 0.7])
    cases.append({"method": method, "arguments": oe + ["--long", str(m)], "expected": {"B": list(t[:2]), "F": list(t[2:])}})

whole_b = np.convolve(B, KM)[1:]
whole_f = (np.convolve(F, KM) + np.convolve(B, KN)[:4])[1:]
t, P = output_error(r, y, 3, 3, np.concatenate([whole_b, whole_f]))
X = np.zeros((6, 4))
for j in range(2):
    unit = np.zeros(3)
    unit[1 + j] = 1
    X[:3, j] = np.convolve(unit, KM)[1:]
    X[3:, j] = np.convolve(unit, KN)[1:4]
    X[3:, 2 + j] = np.convolve(unit, KM)[1:]
target = t - np.concatenate([np.zeros(3), [KM[1], 0, 0]])
W = np.linalg.inv(P)
cov = np.linalg.inv(X.T @ W @ X)
theta = cov @ X.T @ W @ target
expected = {"B": list(theta[:2]), "F": list(theta[2:]), "se": list(np.sqrt(np.diag(cov)))}
cases.append({"method": "indirect", "arguments": oe + ["--controller", controller], "expected": expected})

rows = lambda s, n: np.array([s[2 - i:len(s) - i] for i in n]).T
phi = lambda y, u: np.hstack([-rows(y, [1, 2]), rows(u, [1, 2])])
target = y[2:]
theta = np.linalg.lstsq(phi(y, u), target, rcond=None)[0]
simulate = lambda theta: lfilter([0, *theta[2:]], [1, *theta[:2]], r)
z = phi(simulate(theta), r)
theta = np.linalg.solve(z.T @ phi(y, u), z.T @ target)
w = target - phi(y, u) @ theta
past4 = np.array([-w[4 - i:len(w) - i] for i in range(1, 5)]).T
L = np.concatenate([[1], np.linalg.lstsq(past4, w[4:], rcond=None)[0]])
yf, uf, rf, xf = (lfilter(L, 1, s) for s in (y, u, r, simulate(theta)))
z, p = phi(xf, rf), phi(yf, uf)
theta = np.linalg.solve(z.T @ p, z.T @ yf[2:])
e = yf[2:] - p @ theta
inverse = np.linalg.inv(z.T @ p)
cov = e @ e / (len(e) - 4) * inverse @ z.T @ z @ inverse.T
expected = {"A": list(theta[:2]), "B": list(theta[2:]), "se": list(np.sqrt(np.diag(cov)))}
arguments = ["--orders", "na=2,nb=2,nk=1", "--instruments", "r"]
cases.append({"method": "iv4", "arguments": arguments, "expected": expected})

json.dump({"about": __doc__.splitlines()[0], "cases": [{"data": "loop.csv"} | case for case in cases]}, open("loop.json", "w"), indent=1)
for case in cases:
    print(case["method"], {k: np.round(v, 5).tolist() for k, v in case["expected"].items()})
