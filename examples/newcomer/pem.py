"""A newcomer to the reference suite, in Python with SciPy: the prediction error method of the structure that it is told,
A(q) y = B(q)/F(q) u + C(q)/D(q) e, from its own starts. The method of the package `asobench` serves it."""
import json, os
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")

def answer(header, blocks=None):
    replies.write(json.dumps(header).encode() + b"\n")
    if blocks is not None:
        replies.write(b"".join(block.tobytes() for block in blocks) + b"\n")
    replies.flush()

def inside(polynomial, radius=0.999):
    """The monic polynomial with its zeros reflected into the unit circle."""
    zeros = np.roots(polynomial)
    if len(zeros) == 0:
        return np.ones(1)
    out = np.abs(zeros) > 1
    zeros[out] = 1 / np.conj(zeros[out])
    zeros *= np.minimum(1, radius / np.maximum(np.abs(zeros), 1e-300))
    return np.real(np.poly(zeros))

def lagged(x, lags):
    return np.column_stack([np.concatenate([np.zeros(k), x[:len(x) - k]]) for k in lags])

def plant_start(u, y, order, nb, nk):
    """Steiglitz-McBride from least squares: B and the denominator of the plant."""
    denominator = np.array([1.0])
    for _ in range(10):
        uf, yf = lfilter([1.0], denominator, u), lfilter([1.0], denominator, y)
        phi = np.hstack([-lagged(yf, range(1, order + 1)), lagged(uf, range(nk, nk + nb))])
        theta = np.linalg.lstsq(phi, yf, rcond=None)[0]
        denominator = inside(np.concatenate([[1.0], theta[:order]]), 0.995)
    return denominator[1:], theta[order:]

def noise_start(v, nc, nd):
    """C and D of v = C/D e from a long autoregression (Hannan and Rissanen)."""
    if nc + nd == 0:
        return np.zeros(0), np.zeros(0)
    long = min(20, len(v) // 10)
    phi = lagged(v, range(1, long + 1))
    e = v - phi @ np.linalg.lstsq(phi, v, rcond=None)[0]
    phi = np.hstack([lagged(e, range(1, nc + 1)) if nc else np.zeros((len(v), 0)),
                     -lagged(v, range(1, nd + 1)) if nd else np.zeros((len(v), 0))])
    theta = np.linalg.lstsq(phi, v, rcond=None)[0]
    return inside(np.concatenate([[1.0], theta[:nc]]))[1:], inside(np.concatenate([[1.0], theta[nc:]]))[1:]

def fit(u, y, na, nb, nc, nd, nf, nk, random):
    ends = np.cumsum([na, nb, nc, nd, nf])
    def parts(theta):
        a, b, c, d, f = np.split(theta, ends[:-1])
        return [np.concatenate([[1.0], part]) for part in (a, c, d, f)], np.concatenate([np.zeros(nk), b])
    def errors(theta):
        (a, c, d, f), b = parts(theta)
        if any(len(p) > 1 and np.abs(np.roots(p)).max() >= 1 for p in (c, f)):
            return np.full(len(y), 1e3 * np.sqrt(np.mean(y * y)))
        v = lfilter(a, [1.0], y) - lfilter(b, f, u)
        return lfilter(d, c, v)
    # The linear start: the plant's denominator is A, or F where there is one.
    plant, b = plant_start(u, y, na + nf, nb, nk)
    a, f = (np.zeros(na), plant[:nf]) if nf else (plant, np.zeros(0))
    (long_a, *_, long_f), long_b = parts(np.concatenate([a, b, np.zeros(nc + nd), f]))
    v = lfilter(long_a, [1.0], y) - lfilter(long_b, inside(long_f), u)
    starts = [np.concatenate([a, b, *noise_start(v, nc, nd), f])]
    # Three more are drawn around it.
    for _ in range(3):
        start = starts[0] * (1 + 0.2 * random.standard_normal(len(starts[0])))
        (_, c, _, f), _ = parts(start)
        start[ends[1]:ends[2]], start[ends[3]:] = inside(c)[1:], inside(f)[1:]
        starts.append(start)
    found = [least_squares(errors, start, x_scale="jac", xtol=1e-10, ftol=1e-12, max_nfev=200) for start in starts]
    return min(found, key=lambda of: of.cost).x

while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        hello = head
        answer({"frame": "ready", "protocol": 1, "name": "pem-scipy", "version": "1.0", "returns": "polynomials",
                "deterministic": True})
        continue
    m, n = head["trials"], head["samples"]
    numbers = np.frombuffer(requests.read(head["bytes"]), dtype="<f8")
    seeds = numbers[m:2 * m]
    u, y, _ = numbers[2 * m:].reshape(3, m, n)
    orders = [hello[key] for key in ("na", "nb", "nc", "nd", "nf")]
    status, theta = np.zeros(m), np.zeros((m, sum(orders)))
    for i in range(m):
        try:
            theta[i] = fit(u[i], y[i], *orders, hello["nk"], np.random.default_rng(int(seeds[i])))
        except (np.linalg.LinAlgError, ValueError):
            status[i] = 2.0
    blocks = [status, np.full(m, np.nan), theta]
    answer({"frame": "reply", "number": head["number"], "trials": m, "nk": hello["nk"], "reasons": ["no start"],
            "bytes": sum(block.nbytes for block in blocks)} | dict(zip(("na", "nb", "nc", "nd", "nf"), orders)), blocks)
