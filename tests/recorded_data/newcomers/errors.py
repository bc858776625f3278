"""A record whose input has noise, and methods for it by numpy and scipy, for tests/recorded_data/newcomers.rs.

python3 errors.py (numpy 2, scipy 1) writes errors.csv and errors.json.

A y0 = B u0 with A = 1 - 1.5/q + 0.7/q^2, B = 1/q + 0.5/q^2, u0 = Gaussian white noise through 1/(1 - 0.7/q); white noise of
variance 1 on y0 and 0.25 on u0.

tls: the last right singular vector of the data matrix (y(k), y(k-1), y(k-2), u(k-1), u(k-2)), columns of y over
sqrt(ratio). bels, iv-compensated: scipy.optimize.least_squares of (S - D) c over the roots of S's diagonal, and lstsq of the
linear problem; where a variance is unknown twice more, weighted with the inverse covariance of the lines at the model before,
with Bartlett's weights. Standard errors: the scores of each sample, times the pseudo-inverse of the derivatives, with Bartlett's weights
up to lag floor(4 (M/100)^(2/9)), times M/(M - d).
"""
import json
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

rng = np.random.default_rng(33)
N = 2000
u0 = lfilter([1], [1, -0.7], rng.standard_normal(N))
y0 = lfilter([0, 1, 0.5], [1, -1.5, 0.7], u0)
with open("errors.csv", "w") as to:
    to.write("u,y\n")
    for a, b in zip(u0 + 0.5 * rng.standard_normal(N), y0 + rng.standard_normal(N)):
        to.write(f"{a:.4f},{b:.4f}\n")
data = np.genfromtxt("errors.csv", delimiter=",", names=True)
u, y = data["u"], data["y"]


def signals(earlier):
    first = 2 + earlier
    lags = [y[first - i:N - i] for i in (0, 1, 2)] + [u[first - i:N - i] for i in range(1, 3 + earlier)]
    return np.array(lags).T


def bartlett(influence, d):
    M = len(influence)
    lags = int(4 * (M / 100) ** (2 / 9))
    P = influence.T @ influence
    for lag in range(1, lags + 1):
        S = influence[lag:].T @ influence[:-lag]
        P = P + (1 - lag / (lags + 1)) * (S + S.T)
    return np.sqrt(np.diag(P * M / (M - d)))[:4]


def weight_of(scores):
    M = len(scores)
    lags = int(4 * (M / 100) ** (2 / 9))
    P = scores.T @ scores
    for lag in range(1, lags + 1):
        S = scores[lag:].T @ scores[:-lag]
        P = P + (1 - lag / (lags + 1)) * (S + S.T)
    return np.linalg.inv(np.linalg.cholesky(P / M))


def c_of(x, earlier):
    return np.concatenate([[1], x[:2], -x[2:4], np.zeros(earlier)])


def answer(x, se):
    return {"A": list(x[:2]), "B": list(x[2:4]), "se": list(se)}


cases = []
Z = signals(0)
scale = np.array([2.0, 2.0, 2.0, 1, 1])
c = np.linalg.svd(Z / scale)[2][-1] / scale
c = c / c[0]
x = np.concatenate([c[1:3], -c[3:]])
S = Z.T @ Z / len(Z)
D = scale**2
v = (c @ S @ c) / (c @ (D * c))
e = Z @ c
sign = np.array([1, 1, -1, -1])
J = (S - v * np.diag(D))[1:, 1:] * sign
scores = (Z * e[:, None] - np.outer(e**2, D * c) / (c @ (D * c)))[:, 1:]
se = bartlett(scores @ np.linalg.inv(J).T / len(Z), 4)
cases.append({"method": "tls", "arguments": ["--ratio", "4"], "expected": answer(x, se)})


def moments(earlier, known, present):
    Z = signals(earlier)
    S = Z.T @ Z / len(Z)
    size = np.sqrt(np.diag(S))
    n = Z.shape[1]
    keep = slice(0 if present else 1, n)
    unknown = [i for i in (0, 1) if known[i] is None]

    def d_of(x):
        v = list(known)
        for i, value in zip(unknown, x[4:]):
            v[i] = value
        return np.concatenate([[v[0]] * 3, [v[1]] * 2, np.zeros(earlier)])

    def lines(x):
        c = c_of(x, earlier)
        return ((S @ c - d_of(x) * c) / size)[keep]

    def jacobian(x):
        c, d = c_of(x, earlier), d_of(x)
        J = ((S - np.diag(d))[:, 1:5] * sign) / size[:, None]
        masks = [np.concatenate([np.ones(3), np.zeros(n - 3)]), np.concatenate([np.zeros(3), np.ones(2), np.zeros(earlier)])]
        more = [-(masks[i] * c / size)[:, None] for i in unknown]
        return np.hstack([J, *more])[keep]

    def scores(x):
        c, d = c_of(x, earlier), d_of(x)
        return ((Z * (Z @ c)[:, None] - d * c) / size)[:, keep]

    x = np.concatenate([[-1.5, 0.7, 1, 0.5], [(1.0, 0.25)[i] for i in unknown]])
    weight = np.eye(n)[keep, keep]
    for turn in range(3 if unknown else 1):
        if turn > 0:
            weight = weight_of(scores(x) - lines(x))
        found = least_squares(lambda x: weight @ lines(x), x, jac=lambda x: weight @ jacobian(x), method="lm",
                              xtol=1e-15, ftol=1e-15, gtol=1e-15)
        x = found.x
        for _ in range(50):
            x = x - np.linalg.lstsq(weight @ jacobian(x), weight @ lines(x), rcond=None)[0]
        assert np.max(np.abs(x - found.x)) < 1e-6
    se = bartlett(scores(x) @ weight.T @ np.linalg.pinv(weight @ jacobian(x)).T / len(Z), len(x))
    return answer(x, se)


cases.append({"method": "bels", "arguments": [], "expected": moments(12, [None, None], True)})
cases.append({"method": "bels", "arguments": ["--earlier", "6", "--input-noise", "0.25"], "expected": moments(6, [None, 0.25], True)})
cases.append({"method": "iv-compensated", "arguments": ["--output-noise", "1", "--input-noise", "0.25"], "expected": moments(0, [1, 0.25], False)})
more = ["--earlier", "4", "--output-noise", "1", "--input-noise", "0.25"]
cases.append({"method": "iv-compensated", "arguments": more, "expected": moments(4, [1, 0.25], False)})
Phi = signals(0)[:, 1:] * [-1, -1, 1, 1]
theta = np.linalg.lstsq(Phi, y[2:], rcond=None)[0]
cases.append({"method": "iv-compensated", "arguments": [], "expected": {"A": list(theta[:2]), "B": list(theta[2:])}})
orders = ["--orders", "na=2,nb=2,nk=1"]
cases = [{"data": "errors.csv"} | case | {"arguments": orders + case["arguments"]} for case in cases]
json.dump({"about": __doc__.splitlines()[0], "cases": cases}, open("errors.json", "w"), indent=1)
for case in cases:
    print(case["method"], {k: np.round(v, 5).tolist() for k, v in case["expected"].items()})
