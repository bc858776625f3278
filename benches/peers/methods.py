#!/usr/bin/env python3
"""Times of estimators on W98's record beside what one would run instead: a table of ratios from one run.

    cargo bench --bench methods -- W98
    asobench replay results/nikolov2023 C2:0 --data target/w98.csv
    benches/peers/methods.py target/w98.csv

Needs numpy, scipy, statsmodels and sippy_unipi; a peer that is not there is skipped with a line. Ours are criterion's
medians in target/criterion; a peer's time is the median of as many runs as fit in a second, at least five. Import is not
in the times.
"""

import contextlib
import csv
import io
import json
import statistics
import sys
import time
import warnings
from pathlib import Path

CRITERION = Path(__file__).resolve().parents[2] / "target" / "criterion" / "methods"
N, ORDER = 98, 6


def read(path):
    """u and y of the window."""
    with open(path) as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        rows = list(rows)[:N]
    return [float(row["u"]) for row in rows], [float(row["y"]) for row in rows]


def ours(name):
    """Criterion's median, microseconds; None where it was not run."""
    file = CRITERION / name / "W98" / "new" / "estimates.json"
    if not file.exists():
        return None
    return json.loads(file.read_text())["median"]["point_estimate"] / 1e3


def timed(run):
    """The median time of a run, microseconds."""
    # SIPPY prints warnings.
    with contextlib.redirect_stdout(io.StringIO()):
        return median_time(run)


def median_time(run):
    run()
    times, start = [], time.perf_counter()
    while len(times) < 5 or time.perf_counter() - start < 1.0:
        before = time.perf_counter()
        run()
        times.append(time.perf_counter() - before)
    return statistics.median(times) * 1e6


def peers(u, y):
    """(our estimator, the peer's name, a function that runs it once)."""
    found = []
    try:
        import numpy as np
    except ImportError:
        sys.exit("methods.py: numpy is not installed")
    u, y = np.array(u), np.array(y)

    def regressors(signal):
        rows = range(ORDER, N)
        past = [[-signal[k - i] for i in range(1, ORDER + 1)] for k in rows]
        inputs = [[u[k - i] for i in range(1, ORDER + 1)] for k in rows]
        return np.hstack([np.array(past), np.array(inputs)])

    phi, right = regressors(y), y[ORDER:]
    found.append(("arx", "numpy lstsq", lambda: np.linalg.lstsq(regressors(y), right, rcond=None)))

    def recursion():
        theta, p = np.zeros(2 * ORDER), 1e4 * np.eye(2 * ORDER)
        for row, target in zip(regressors(y), right, strict=True):
            gain = p @ row / (1 + row @ p @ row)
            theta = theta + gain * (target - row @ theta)
            p = p - np.outer(gain, row @ p)
        return theta

    def smallest():
        z = np.column_stack([right, regressors(y)])
        return np.linalg.svd(z)[2][-1]

    found.append(("rls", "numpy, a loop over samples", recursion))
    found.append(("tls", "numpy svd", smallest))
    try:
        from scipy.linalg import toeplitz
        from scipy.optimize import least_squares, minimize
        from scipy.signal import lfilter

        def output_error(theta):
            b, f = theta[:ORDER], theta[ORDER:]
            e = y - lfilter(np.r_[0.0, b], np.r_[1.0, f], u)
            return np.nan_to_num(e, nan=1e6, posinf=1e6, neginf=-1e6)

        theta = np.linalg.lstsq(phi, right, rcond=None)[0]
        start = np.r_[theta[ORDER:], theta[:ORDER]]
        innovations = np.r_[theta, np.zeros(ORDER)]

        def prediction_error(theta):
            a, b, c = np.r_[1.0, theta[:ORDER]], np.r_[0.0, theta[ORDER : 2 * ORDER]], np.r_[1.0, theta[2 * ORDER :]]
            e = lfilter(a, c, y) - lfilter(b, c, u)
            return np.nan_to_num(e, nan=1e6, posinf=1e6, neginf=-1e6)

        found.append(("pem", "scipy least_squares, one start", lambda: least_squares(prediction_error, innovations)))
        taps = N // 2
        lagged = toeplitz(np.r_[0.0, u[:-1]], np.zeros(taps))
        index = np.arange(taps)

        def evidence(hyper):
            kernel = np.exp(hyper[0]) * (1 / (1 + np.exp(-hyper[1]))) ** np.maximum.outer(index, index)
            factor = np.linalg.cholesky(lagged @ kernel @ lagged.T + np.exp(hyper[2]) * np.eye(N))
            return np.sum(np.linalg.solve(factor, y) ** 2) + 2 * np.sum(np.log(np.diag(factor)))

        smooth = [np.log(np.var(y)), 2.0, np.log(np.var(y) / 100)]
        search = {"method": "Nelder-Mead"}
        found.append(("kernel-fir", "scipy minimize, TC kernel", lambda: minimize(evidence, smooth, **search)))
        found.append(("oe", "scipy least_squares, one start", lambda: least_squares(output_error, start)))
    except ImportError:
        print("scipy is not installed: skipped", file=sys.stderr)
    try:
        from statsmodels.sandbox.regression.gmm import IV2SLS

        delays = range(2 * ORDER + 5, N)
        z = np.array([[u[k - i] for i in range(1, 2 * ORDER + 6)] for k in delays])
        x, target = phi[ORDER + 5 :], y[2 * ORDER + 5 :]
        found.append(("iv-delayed", "statsmodels IV2SLS", lambda: IV2SLS(target, x, z).fit()))
    except ImportError:
        print("statsmodels is not installed: skipped", file=sys.stderr)
    try:
        import sippy_unipi as sippy
    except ImportError:
        print("sippy_unipi is not installed: skipped", file=sys.stderr)
        return found

    def identify(method, **options):
        return lambda: sippy.system_identification(y, u, method, **options)

    n = [ORDER]
    for name, method, options in [
        ("arx", "ARX", {"ARX_orders": [ORDER, ORDER, 1]}),
        ("armax", "ARMAX", {"ARMAX_orders": [ORDER, ORDER, 1, 1]}),
        ("oe", "OE", {"OE_orders": [ORDER, ORDER, 1]}),
        ("bj", "BJ", {"BJ_orders": [ORDER, 1, 1, ORDER, 1]}),
        ("n4sid", "N4SID", {"SS_fixed_order": ORDER, "SS_f": 10, "SS_p": 10}),
        ("cva", "CVA", {"SS_fixed_order": ORDER, "SS_f": 10, "SS_p": 10}),
        ("parsim-k", "PARSIM-K", {"SS_fixed_order": ORDER, "SS_f": 10, "SS_p": 10}),
        ("moesp", "MOESP", {"SS_fixed_order": ORDER, "SS_f": 10, "SS_p": 10}),
    ]:
        found.append((name, f"SIPPY {method}", identify(method, **options)))
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: methods.py RECORD.csv")
    warnings.simplefilter("ignore")
    u, y = read(sys.argv[1])
    if len(y) < N:
        sys.exit(f"methods.py: {sys.argv[1]}: expected at least {N} samples")
    print(f"| estimator | \u00b5s | peer | \u00b5s | ratio |\n|---|--:|---|--:|--:|")
    for name, peer, run in peers(u, y):
        own = ours(name)
        try:
            other = timed(run)
        except Exception as error:  # a peer that cannot do it is a line of the table
            print(f"| `{name}` | {own:.0f} | {peer} | failed: {type(error).__name__} | |")
            continue
        if own is None:
            print(f"| `{name}` | not run | {peer} | {other:.0f} | |")
        else:
            print(f"| `{name}` | {own:.0f} | {peer} | {other:.0f} | {other / own:.1f} |")


if __name__ == "__main__":
    main()
