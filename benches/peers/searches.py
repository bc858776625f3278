#!/usr/bin/env python3
"""Times of the whole default search of oe, armax and bj beside scipy's least_squares from one start, on the same records.

    cargo bench --bench methods
    benches/peers/searches.py

scipy gets the exact Jacobian by lfilter, and starts from five passes of refined instrumental variables (reflected), which
are in its time. Ours are criterion's medians in target/criterion, of the records in target/records; a peer's time is the
median of five runs or more, on one thread. Above 1, the whole search is quicker than one start of scipy.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

TARGET = Path(__file__).resolve().parents[2] / "target"


def delayed(x, lag):
    return np.r_[np.zeros(lag), x[: len(x) - lag]]


def refined(u, y, n):
    """F and B of five reflected passes of refined IV, from least squares."""
    f, b = np.zeros(n), None
    for _ in range(6):
        whole = np.r_[1.0, f]
        uf, yf = lfilter([1.0], whole, u), lfilter([1.0], whole, y)
        x = yf if b is None else lfilter(np.r_[0.0, b], whole, uf)
        rows = lambda signal: np.array(
            [-delayed(signal, i + 1) for i in range(n)] + [delayed(uf, i + 1) for i in range(n)]
        )
        theta = np.linalg.solve(rows(x) @ rows(yf).T, rows(x) @ yf)
        zeros = np.roots(np.r_[1.0, theta[:n]])
        zeros = np.where(abs(zeros) > 1, 1 / zeros.conj(), zeros)
        f, b = np.real(np.poly(zeros))[1:], theta[n:]
    return f, b


def search(u, y, name, n):
    """One search from refined IV; theta = [a, b, c, d, f]."""
    na, nc, nd, nf = {"oe": (0, 0, 0, n), "armax": (n, 1, 0, 0), "bj": (0, 1, 1, n)}[name]

    def parts(theta):
        a, b, c, d, f = np.split(theta, np.cumsum([na, n, nc, nd]))
        one = lambda x: np.r_[1.0, x]
        return one(a), np.r_[0.0, b], one(c), one(d), one(f)

    def residuals(theta):
        a, b, c, d, f = parts(theta)
        with np.errstate(all="ignore"):
            e = lfilter(d, c, lfilter(a, [1.0], y) - lfilter(b, f, u))
        return np.where(abs(e) < 1e100, e, 1e100)

    def jacobian(theta):
        a, b, c, d, f = parts(theta)
        x = lfilter(b, f, u)
        w = lfilter(a, [1.0], y) - x
        signals = [
            (lfilter(d, c, y), na),
            (-lfilter(d, c, lfilter([1.0], f, u)), n),
            (-lfilter([1.0], c, lfilter(d, c, w)), nc),
            (lfilter([1.0], c, w), nd),
            (lfilter(d, c, lfilter([1.0], f, x)), nf),
        ]
        return np.array([delayed(s, i + 1) for s, count in signals for i in range(count)]).T

    f, b = refined(u, y, n)
    start = np.r_[f, b, 0.0] if na else np.r_[b, np.zeros(nc + nd), f]
    return least_squares(residuals, start, jacobian, method="lm")


def main():
    print("| method | record | whole search, ms | scipy, one start, ms | ratio |\n|---|---|--:|--:|--:|")
    for n in (2, 4, 6):
        for window in (98, 998, 5000):
            record = f"n={n},N={window}"
            file = TARGET / "records" / f"{record}.csv"
            if not file.exists():
                sys.exit(f"searches.py: {file}: run cargo bench --bench methods first")
            u, y = np.loadtxt(file, delimiter=",", skiprows=1).T
            for name in ("oe", "armax", "bj"):
                own = TARGET / "criterion" / "methods" / name / record / "new" / "estimates.json"
                own = json.loads(own.read_text())["median"]["point_estimate"] / 1e6
                times, start = [], time.perf_counter()
                while len(times) < 5 or time.perf_counter() - start < 0.5:
                    before = time.perf_counter()
                    search(u, y, name, n)
                    times.append((time.perf_counter() - before) * 1e3)
                other = statistics.median(times)
                print(f"| `{name}` | {record} | {own:.2f} | {other:.2f} | {other / own:.1f} |", flush=True)


if __name__ == "__main__":
    main()
