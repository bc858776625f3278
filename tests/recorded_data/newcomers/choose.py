"""Orders chosen among 1 to 3 by numpy and scipy, for tests/recorded_data/newcomers.rs: python3 choose.py (numpy 2, scipy 1)
writes choose.json.

oe, armax and bj: the least sum of squares of e = D/C (A y - B/F u) by least_squares, all signals zero before the record,
zeros of C and F inside the unit circle; the lowest of searches from least squares, from the model one order below with
each of 13 common poles and zeros added, and from random zeros. cva, ssarx, parsim-k: their definitions of
crates/identification/src/estimator/methods/state_sequence/reference.py, e by the innovations form. pem: its model is that of
armax with three equal orders, whose minima it has. V is the mean squared
prediction error over the N samples, d the number of parameters: aic = N ln V + 2 d, aicc = aic + 2 d (d+1)/(N-d-1),
bic = N ln V + d ln N, fpe = V (1 + d/N)/(1 - d/N); cross-validation: V over the last third, of the model of the first N - N/3
samples. The margin is by how much the second best exceeds the best.
"""
import json
import sys
from pathlib import Path
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

HERE = Path(__file__).resolve().parent
sys.dont_write_bytecode = True
MOST = 3
SHIFT = ("moesp", "n4sid")
FILE = HERE.parents[2] / "crates/identification/src/estimator/methods/state_sequence/reference.py"
REFERENCE = {}
exec(FILE.read_text().split("\ncases =")[0], REFERENCE)
one = lambda x: np.r_[1.0, x]

def read(file, N):
    lines = [line for line in open(HERE.parent / "data" / file) if not line.startswith("#")]
    data = np.genfromtxt(lines, delimiter=",", names=True)
    return data["u"][:N], data["y"][:N]

def parts(theta, method, n):
    """A, B, C, D, F."""
    cut = {"oe": [0, n, 0, 0, n], "armax": [n, n, n, 0, 0], "bj": [0, n, n, n, n]}[method]
    a, b, c, d, f = np.split(theta, np.cumsum(cut)[:-1])
    return one(a), np.r_[0.0, b], one(c), one(d), one(f)

def errors(model, u, y):
    a, b, c, d, f = model
    return lfilter(d, c, lfilter(a, [1.0], y) - lfilter(b, f, u))

def is_stable(model, radius=1.0):
    return all(len(p) < 2 or np.all(abs(np.roots(p)) < radius) for p in (model[2], model[4]))

def zeros(rng, n):
    """A polynomial with random zeros inside the unit circle."""
    pairs = [r * np.exp(1j * p) for r, p in zip(rng.uniform(0, 0.95, n // 2), rng.uniform(0, np.pi, n // 2))]
    all_zeros = [z for pair in pairs for z in (pair, pair.conj())] + list(rng.uniform(-0.95, 0.95, n % 2))
    return np.real(np.poly(all_zeros))

def join(model, method):
    a, b, c, d, f = (p[1:] for p in model)
    return np.concatenate({"oe": [b, f], "armax": [a, b, c], "bj": [b, c, d, f]}[method])

def lagged(x, lags):
    return np.column_stack([np.r_[np.zeros(i), x[: len(x) - i]] for i in lags])

def search(u, y, method, n, below, rng):
    """The lowest minimum, as (V, theta)."""
    def e(theta):
        model = parts(theta, method, n)
        if not is_stable(model):
            return np.full(len(y), 1e3 * np.std(y))
        return errors(model, u, y)
    def with_b(a, c, d, f):
        """B by least squares."""
        of_y = lfilter(d, c, lfilter(a, [1.0], y))
        of_u = lfilter(d, c, lfilter([1.0], f, u))
        b = np.linalg.lstsq(lagged(of_u, range(1, n + 1)), of_y, rcond=None)[0]
        return join((a, np.r_[0.0, b], c, d, f), method)
    arx = np.linalg.lstsq(np.hstack([-lagged(y, range(1, n + 1)), lagged(u, range(1, n + 1))]), y, rcond=None)[0]
    flat = np.r_[1.0, np.zeros(n)]
    first = one(arx[:n])
    starts = [with_b(*((first, flat, flat, flat) if method == "armax" else (one([]) if method == "oe" else flat, flat, flat, first)))]
    if below is not None:
        for zero in np.linspace(-0.9, 0.9, 13):
            longer = [np.convolve(p, [1.0, -zero]) for p in parts(below, method, n - 1)]
            starts.append(join(longer, method))
    for _ in range(40):
        draws = [zeros(rng, n) for _ in range(4)]
        if method == "armax":
            draws[2:] = [flat, flat]
        elif method == "oe":
            draws[:3] = [flat, flat, flat]
        else:
            draws[0] = flat
        starts.append(with_b(*draws))
    best = None
    for start in starts:
        if not np.all(np.isfinite(start)) or not is_stable(parts(start, method, n)):
            continue
        found = least_squares(e, start, method="lm", xtol=1e-12, ftol=1e-12, max_nfev=400 * len(start))
        V = np.mean(found.fun ** 2)
        # A search that ends at the border of stability is at no minimum.
        if is_stable(parts(found.x, method, n), 0.9995) and (best is None or V < best[0]):
            best = V, found.x
    return best

def subspace(u, y, method, n, s):
    """The innovations form, its errors with zeros before the record."""
    found = (REFERENCE["parsim_k"](u, y, len(y), n, 1, s) if method == "parsim-k"
             else REFERENCE["states"](u, y, len(y), n, 1, s, method))
    flat = np.r_[1.0, np.zeros(n)]
    model = np.array(found["A"]), np.r_[0.0, found["B"]], np.array(found["C"]), flat, flat
    return np.mean(errors(model, u, y) ** 2), model

def shift(u, y, method, n, s):
    """moesp and n4sid: A and C from the shift of the first left singular vectors of the oblique projection, by MOESP less what
    future inputs explain; B and the initial state, whose n numbers count as parameters, by least squares of y."""
    j = len(y) - 2 * s + 1
    hankel = lambda x, first: np.array([x[first + i:first + i + j] for i in range(s)])
    past, Uf, Yf = np.vstack([hankel(u, 0), hankel(y, 0)]), hankel(u, s), hankel(y, s)
    O = np.linalg.lstsq(np.vstack([past, Uf]).T, Yf.T, rcond=None)[0].T[:, :2 * s] @ past
    if method == "moesp":
        O = O - np.linalg.lstsq(Uf.T, O.T, rcond=None)[0].T @ Uf
    G = np.linalg.svd(O, full_matrices=False)[0][:, :n]
    A, C = np.linalg.lstsq(G[:-1], G[1:], rcond=None)[0], G[0]
    free = np.array([C @ np.linalg.matrix_power(A, k) for k in range(len(y))])
    forced = np.array([lfilter(np.r_[0.0, column[:-1]], [1.0], u) for column in free.T]).T
    regressors = np.hstack([forced, free])
    theta = np.linalg.lstsq(regressors, y, rcond=None)[0]
    f = np.poly(A)
    h = np.r_[0.0, [C @ np.linalg.matrix_power(A, i) @ theta[:n] for i in range(n)]]
    flat = np.r_[1.0, np.zeros(n)]
    return np.mean((y - regressors @ theta) ** 2), (flat, np.convolve(f, h)[: n + 1], flat, flat, f)

def models(u, y, method, rows, rng):
    below, found = None, []
    for n in range(1, MOST + 1):
        if rows:
            V, model = (shift if method in SHIFT else subspace)(u, y, method, n, rows)
        else:
            V, below = search(u, y, method, n, below, rng)
            model = parts(below, method, n)
        found.append((V, model, n * {"oe": 2, "bj": 4}.get(method, 3)))
    return found

cases = []
for file, method, N, rows in [
    ("sim_oe2.csv", "oe", 300, None),
    ("sim_armax2.csv", "armax", 300, None),
    ("sim_bj2.csv", "bj", 400, None),
    ("sim_armax2.csv", "cva", 400, 8),
    ("sim_armax2.csv", "ssarx", 400, 8),
    ("sim_armax2.csv", "parsim-k", 400, 8),
    ("sim_oe2.csv", "moesp", 100, 8),
    ("sim_oe2.csv", "n4sid", 100, 8),
]:
    u, y = read(file, N)
    rng = np.random.default_rng(5)
    whole = models(u, y, method, rows, rng)
    first = N - N // 3
    early = models(u[:first], y[:first], method, rows, rng)
    rules = {
        "aic": [N * np.log(V) + 2 * d for V, _, d in whole],
        "aicc": [N * np.log(V) + 2 * d + 2 * d * (d + 1) / (N - d - 1) for V, _, d in whole],
        "bic": [N * np.log(V) + d * np.log(N) for V, _, d in whole],
        "fpe": [V * (1 + d / N) / (1 - d / N) for V, _, d in whole],
        "cross-validation": [np.mean(errors(model, u, y)[first:] ** 2) for _, model, _ in early],
    }
    for rule, values in rules.items():
        n = int(np.argmin(values)) + 1
        V, model, _ = whole[n - 1]
        margin = sorted(values)[1] - min(values)
        arguments = ["--orders", f"n={MOST},nk=1", "--block-rows", str(rows)] if rows else ["--order", str(MOST)]
        denominator = model[0] if method not in ("oe", "bj", *SHIFT) else model[4]
        case = dict(data=file, method=method, arguments=[*arguments, "--choose", rule, "--window", str(N)], order=n,
                    margin=margin, loss=V, B=model[1][1:].tolist(), denominator=denominator[1:].tolist())
        cases.append(case)
        if method == "armax":
            options = ["--orders", f"n={MOST},nk=1", *case["arguments"][2:]]
            cases.append(dict(case, method="pem", arguments=options))
        print(method, rule, n, f"{margin:.3g}", [f"{v:.6g}" for v in values])
(HERE / "choose.json").write_text(json.dumps(dict(cases=cases), indent=1) + "\n")
