"""Makes reference.json: observers of models A y = B/F u + C/D e on a record, by NumPy and SciPy.

The plant's state is x_i(k) = c A^(i-1) x, so that b is the impulse response of B/(A F). Gains of Kalman filters are by
scipy.linalg.solve_discrete_are, placed gains by comparing the coefficients of numpy.poly, covariances of their errors by
solve_discrete_lyapunov, poles by numpy.linalg.eigvals. Coloured noise C/(A D) is in innovations form.

    python3 reference.py > reference.json   # made with NumPy 2.4.6, SciPy 1.17.1
"""

import json

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov
from scipy.signal import lfilter

rng = np.random.default_rng(58)
SAMPLES = 80
AT = [0, 1, 2, 7, 30, 79, 80]


def plant(model):
    den = np.convolve(model["A"], model["F"])
    n = max(len(den), len(model["B"])) - 1
    den = np.pad(den, (0, n + 1 - len(den)))
    m = np.eye(n, k=1)
    m[-1] = -den[:0:-1]
    impulse = lfilter(model["B"], den, np.eye(1, n + 1)[0])
    return m, impulse[1:], impulse[0], den


def noise(model, coloured):
    """F, h and B of the noise in innovations form."""
    if not coloured:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0)
    num, den = np.array(model["C"]), np.convolve(model["A"], model["D"])
    m = max(len(num), len(den)) - 1
    num, den = np.pad(num, (0, m + 1 - len(num))), np.pad(den, (0, m + 1 - len(den)))
    f = np.eye(m, k=1)
    f[:, 0] = -den[1:]
    return f, np.eye(1, m)[0] if m else np.zeros(0), num[1:] - den[1:]


def order(poles):
    return [[p.real, p.imag] for p in sorted(poles, key=lambda p: (-round(abs(p), 9), -p.imag))]


def observe(case):
    model, kind = case["model"], case["kind"]
    m, b, d, _ = plant(model)
    n = len(m)
    fn, hn, bn = noise(model, kind == "kalman-coloured")
    k = len(fn)
    f = np.block([[m, np.zeros((n, k))], [np.zeros((k, n)), fn]])
    h, g = np.concatenate([np.eye(1, n)[0], hn]), np.concatenate([b, np.zeros(k)])
    q, r = np.zeros((n + k, n + k)), case["r"]
    q[:n, :n], q[n:, n:] = case["Q"], np.outer(bn, bn) * r
    s = np.concatenate([np.zeros(n), bn * r])
    gains, covariances = None, None
    if kind.startswith("kalman"):
        p = solve_discrete_are(f.T, h[:, None], q, [[r]], s=s[:, None])
        gain = (f @ p @ h + s) / (h @ p @ h + r)
        if kind == "kalman-varying":
            now, gains, covariances = np.array(case["P0"]), [], []
            for _ in range(SAMPLES + 1):
                v = h @ now @ h + r
                now_gain = f @ now @ h / v
                gains.append(now_gain)
                covariances.append(now)
                now = f @ now @ f.T + q - np.outer(now_gain, now_gain) * v
    else:
        own = np.linalg.eigvals(m)
        wanted = {
            "dead-beat": np.zeros(n),
            "scaled:0.5": 0.5 * own,
        }.get(kind)
        if wanted is None:
            wanted = [complex(part.replace("i", "j")) for part in kind.split(":")[1].split(",")]
        # The first column of A - g c': its polynomial is linear in g.
        columns = [np.poly(m - np.outer(np.eye(n)[i], h)) - np.poly(m) for i in range(n)]
        gain = np.linalg.solve(np.array(columns)[:, 1:].T, (np.poly(wanted) - np.poly(m)).real[1:])
        closed = m - np.outer(gain, h)
        p = solve_discrete_lyapunov(closed, q + r * np.outer(gain, gain))
    poles = wanted if not kind.startswith("kalman") else np.linalg.eigvals(f - np.outer(gain, h))
    x, states, deviations, predictions = np.concatenate([case["x0"], np.zeros(k)]), [], [], []
    for i in range(SAMPLES + 1):
        states.append(list(x[:n]))
        deviations.append(list(np.sqrt(np.diag(p if covariances is None else covariances[i])[:n])))
        if i == SAMPLES:
            break
        u, y = case["u"][i], case["y"][i]
        predictions.append(h @ x + d * u)
        x = f @ x + g * u + (gain if gains is None else gains[i]) * (y - predictions[-1])
    return {
        "gain": list(gain),
        "poles": order(poles),
        "covariance": p[:n, :n].tolist(),
        "innovation": h @ p @ h + r,
        "states": [states[i] for i in AT],
        "deviations": [deviations[i] for i in AT],
        "predictions": [predictions[i] for i in AT[:-1]],
    }


arx = {"A": [1.0, -1.5, 0.7], "B": [0.0, 1.0, 0.5], "C": [1.0], "D": [1.0], "F": [1.0]}
box = {"A": [1.0], "B": [0.0, 1.0, -0.4], "C": [1.0, 0.5], "D": [1.0, -0.9], "F": [1.0, -1.2, 0.61]}
maximum = {"A": [1.0, -0.8], "B": [0.0, 0.0, 2.0, 0.3], "C": [1.0, -0.3, 0.1], "D": [1.0], "F": [1.0, -0.6]}
direct = {"A": [1.0, -0.9, 0.2], "B": [0.7, 0.4], "C": [1.0, 0.4], "D": [1.0], "F": [1.0]}
full = [[0.3, 0.1], [0.1, 0.2]]
three = np.diag([0.05, 0.02, 0.04])
cases = []
for model, kind, q, r in [
    (arx, "kalman", full, 0.4),
    (arx, "kalman-coloured", full, 0.4),
    (arx, "kalman-varying", full, 0.4),
    (arx, "dead-beat", full, 0.4),
    (arx, "scaled:0.5", full, 0.4),
    (box, "kalman", 0.02 * np.eye(2), 1.5),
    (box, "kalman-coloured", 0.02 * np.eye(2), 1.5),
    (box, "poles:0.3+0.2i,0.3-0.2i", full, 0.1),
    (maximum, "kalman", three, 0.2),
    (maximum, "kalman-coloured", three, 0.2),
    (maximum, "poles:0.5,0.2,-0.1", three, 0.2),
    (direct, "kalman", full, 0.3),
    (direct, "kalman-varying", full, 0.3),
]:
    n = len(plant(model)[0])
    u = rng.choice([-1.0, 1.0], SAMPLES)
    y = 3 * rng.normal(size=SAMPLES) + lfilter(model["B"], plant(model)[3], u)
    start = np.eye(n) + 0.5
    case = {"model": model, "kind": kind, "Q": np.array(q).tolist(), "r": r, "P0": start.tolist()}
    case |= {"x0": list(rng.normal(size=n)), "u": list(u), "y": list(y)}
    cases.append(case | observe(case))
print(json.dumps({"at": AT, "cases": cases}, default=float))
