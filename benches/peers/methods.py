#!/usr/bin/env python3
"""Times of estimators on W98's record beside what one would run instead: a table of ratios.

    benches/peers/methods.py target/records/W98.csv            criterion's last medians, which another run left
    benches/peers/methods.py target/records/W98.csv --rounds 3

With --rounds the benchmark and the peers run in turn, so that what else the machine does meets both; the table has the medians
of the rounds, the range of the ratios, and the load. Needs numpy, scipy, statsmodels and sippy_unipi; a peer that is not there
is skipped with a line. Ours are criterion's medians in target/criterion; a peer's time in a round is the median of as many runs
as fit in a second, at least five. Import is not in the times. "numpy" and "scipy" are the method's formula as one would write it.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import contextlib
import argparse
import csv
import io
import json
import statistics
import subprocess
import sys
import time
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CRITERION = ROOT / "target" / "criterion" / "methods"
N, ORDER = 98, 6
# Nothing on PyPI, and no formula of a few lines.
WITHOUT = "ssarx rivc clriv clrivc indirect zhang kreisselmeier joint-ekf recursive-sriv riv".split()


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


def written(u, y):
    """Formulas of methods in numpy and scipy, as one would write them."""
    import numpy as np
    from scipy.linalg import toeplitz
    from scipy.optimize import least_squares
    from scipy.signal import cont2discrete, lfilter

    u, y = np.array(u), np.array(y)
    n, one = ORDER, lambda x: np.r_[1.0, x]
    fit = lambda rows, right: np.linalg.lstsq(rows, right, rcond=None)[0]

    def delayed(signal, lags):
        return np.column_stack([np.r_[np.zeros(lag), signal[: N - lag]] for lag in lags])

    def phi(of_y, of_u, m=n):
        return np.hstack([-delayed(of_y, range(1, m + 1)), delayed(of_u, range(1, m + 1))])

    def simulated(theta, signal):
        return lfilter(np.r_[0.0, theta[n:]], one(theta[:n]), signal)

    def search(na, nc, nd, nf, u=u, y=y):
        """e = D/C (A y - B/F u); B is between A and C."""

        def e(theta):
            a, b, c, d, f = np.split(theta, np.cumsum([na, n, nc, nd]))
            w = lfilter(one(a), 1.0, y) - lfilter(np.r_[0.0, b], one(f), u)
            return np.nan_to_num(lfilter(one(d), one(c), w), nan=1e6, posinf=1e6, neginf=-1e6)

        first = fit(phi(y, u), y)
        start = np.r_[first[:na], first[n:], np.zeros(nc + nd), first[:nf]]
        return lambda: least_squares(e, start)

    def solve(x, of_y, of_u):
        z = phi(x, of_u)
        return np.linalg.solve(z.T @ phi(of_y, of_u), z.T @ of_y)

    def passes():
        theta = fit(phi(y, u), y)
        for _ in range(4):
            theta = solve(simulated(theta, u), y, u)
        return theta

    def four_steps():
        theta = fit(phi(y, u), y)
        theta = solve(simulated(theta, u), y, u)
        w = y - phi(y, u) @ theta
        ar = one(fit(-delayed(w, range(1, 2 * n + 1)), w))
        x, of_y, of_u = (lfilter(ar, 1.0, signal) for signal in (simulated(theta, u), y, u))
        return solve(x, of_y, of_u)

    def iterated(of_y, of_u, refined, most=400):
        """Steiglitz and McBride, or with B/F u in the instruments; zeros are reflected."""
        theta = fit(phi(of_y, of_u), of_y)
        for _ in range(most):
            zeros = np.roots(one(theta[:n]))
            zeros = np.where(abs(zeros) > 1, 1 / zeros.conj(), zeros)
            theta = np.r_[np.real(np.poly(zeros))[1:], theta[n:]]
            f = one(theta[:n])
            yf, uf = lfilter([1.0], f, of_y), lfilter([1.0], f, of_u)
            found = solve(simulated(theta, uf) if refined else yf, yf, uf)
            if np.max(abs(found - theta)) < 1e-9 * np.max(abs(found)):
                break
            theta = found
        return theta

    def long_model(most=N // 6, first=0):
        """The ARX model of the order by AIC, over the equations from `first` on."""
        best, right = None, y[first:]
        for m in range(1, most + 1):
            rows = phi(y, u, m)[first:]
            theta = fit(rows, right)
            criterion = len(right) * np.log(np.mean((right - rows @ theta) ** 2)) + 4 * m
            if best is None or criterion < best[0]:
                best = criterion, one(theta[:m]), np.r_[0.0, theta[m:]]
        return best[1:]

    def bjsm():
        a, _ = long_model()
        return iterated(lfilter(a, 1.0, y), lfilter(a, 1.0, u), False)

    def morsm():
        a, b = long_model()
        return iterated(lfilter(b, 1.0, u), lfilter(a, 1.0, u), False)

    def null_space(m=N // 4):
        rows = delayed(u, range(1, m + 1))
        taps = fit(rows, y)
        factor = np.linalg.qr(rows, mode="r")
        past = np.array([[taps[i - j] if i >= j else 0.0 for j in range(1, n + 1)] for i in range(m)])
        whole = np.hstack([-past, np.eye(m)[:, :n]])
        theta = fit(whole, taps)
        for _ in range(3):
            weight = factor @ np.linalg.inv(toeplitz(np.r_[one(theta[:n]), np.zeros(m - n - 1)], np.r_[1.0, np.zeros(m - 1)]))
            theta = fit(weight @ whole, weight @ taps)
        return theta

    def two_stages(joint):
        """The reference is u, as in the benchmark: what of u (and of y) follows from it, then an output-error model."""
        rows = delayed(u, range(2 * n))
        of_r = [rows @ fit(rows, signal) for signal in (u, y)]
        return search(0, 0, 0, n, of_r[0], of_r[1] if joint else y)()

    z = np.column_stack([delayed(y, range(n + 1)), delayed(u, range(1, 3 * n + 1))])[3 * n :]
    s = z.T @ z / len(z)
    signs = np.r_[np.ones(n), -np.ones(n)]

    def bias_eliminated():
        def g(x):
            c = np.r_[1.0, signs * x[: 2 * n], np.zeros(2 * n)]
            d = np.r_[np.full(n + 1, x[-2]), np.full(n, x[-1]), np.zeros(2 * n)]
            return (s @ c - d * c) / np.sqrt(np.diag(s))

        start = np.r_[fit(s[2 * n + 1 :, 1 : 2 * n + 1] * signs, -s[2 * n + 1 :, 0]), 0.0, 0.0]
        return least_squares(g, start)

    def compensated():
        size = 2 * n + 1
        m = s[1:size, 1:size] - np.diag(np.r_[np.full(n, 0.01), np.zeros(n)])
        return np.linalg.solve(m * signs, -s[1:size, 0])

    def in_time():
        def e(theta):
            b, a, _ = cont2discrete((theta[:n], one(theta[n:])), 1.0)[:3]
            return np.nan_to_num(y - lfilter(b.ravel(), a, u), nan=1e6, posinf=1e6, neginf=-1e6)

        start = np.r_[np.zeros(n - 1), 1.0, np.poly(-np.ones(n))[1:]]
        return least_squares(e, start, max_nfev=100)

    def recursion(kind):
        """The recursive form with instruments, with residuals, or with the gradient of the prediction."""
        d = 2 * n if kind == "iv" else 3 * n
        theta, p = np.zeros(d), 1e4 * np.eye(d)
        inputs, whole, e = delayed(u, range(1, 3 * n + 1)), phi(y, u), np.zeros(N + n)
        psi = np.zeros((N + n, d))
        for k in range(N):
            row = whole[k] if kind == "iv" else np.r_[whole[k], e[k : k + n][::-1]]
            if kind == "rpem":
                psi[k + n] = row - theta[2 * n :] @ psi[k : k + n][::-1]
            left = inputs[k, n:] if kind == "iv" else psi[k + n] if kind == "rpem" else row
            right = psi[k + n] if kind == "rpem" else row
            gain = p @ left / (1 + right @ p @ left)
            e[k + n] = y[k] - row @ theta
            theta = theta + gain * e[k + n]
            p = p - np.outer(gain, right @ p)
        return theta

    return [
        ("arx-choose", "numpy lstsq, orders 1 to 8", lambda: long_model(8, 8)),
        ("iv", "numpy, four passes", passes),
        ("iv4", "numpy", four_steps),
        ("sriv", "numpy, with lfilter", lambda: iterated(y, u, True)),
        ("stmcb", "numpy, with lfilter", lambda: iterated(y, u, False)),
        ("armax", "scipy least_squares, one start", search(n, 1, 0, 0)),
        ("bj", "scipy least_squares, one start", search(0, 1, 1, n)),
        ("srivc", "scipy least_squares, 100 steps", in_time),
        ("wnsf", "numpy", null_space),
        ("bjsm", "numpy, with lfilter", bjsm),
        ("morsm", "numpy, with lfilter", morsm),
        ("two-stage", "numpy and scipy least_squares", lambda: two_stages(False)),
        ("joint", "numpy and scipy least_squares", lambda: two_stages(True)),
        ("bels", "scipy least_squares", bias_eliminated),
        ("iv-compensated", "numpy solve", compensated),
        ("recursive-iv", "numpy, a loop over samples", lambda: recursion("iv")),
        ("rels", "numpy, a loop over samples", lambda: recursion("rels")),
        ("rpem", "numpy, a loop over samples", lambda: recursion("rpem")),
    ]


def load():
    return os.getloadavg()[0]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("record")
    parser.add_argument("--rounds", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    u, y = read(given.record)
    if len(y) < N:
        sys.exit(f"methods.py: {given.record}: expected at least {N} samples")
    rows = peers(u, y) + written(u, y)
    times, alone, loads = [[] for _ in rows], {name: [] for name in WITHOUT}, []
    for _ in range(max(given.rounds, 1)):
        if given.rounds:
            bench = ["cargo", "bench", "--quiet", "--bench", "methods", "--", "W98"]
            subprocess.run(bench, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        loads.append(load())
        for name in WITHOUT:
            alone[name].append(ours(name))
        for (name, _, run), of_row in zip(rows, times, strict=True):
            try:
                of_row.append((ours(name), timed(run)))
            except Exception as error:  # a peer that cannot do it is a line of the table
                of_row.append((ours(name), f"failed: {type(error).__name__}: {error}"))
    print("| estimator | \u00b5s | peer | \u00b5s | ratio | rounds |\n|---|--:|---|--:|--:|--:|")
    for (name, peer, _), of_row in sorted(zip(rows, times, strict=True), key=lambda row: row[0][0]):
        if any(own is None for own, _ in of_row):
            print(f"| `{name}` | | {peer} | ours was not run | | |")
            continue
        failed = [other for _, other in of_row if isinstance(other, str)]
        if failed:
            own = statistics.median(own for own, _ in of_row)
            print(f"| `{name}` | {own:.0f} | {peer} | {failed[0]} | | |")
            continue
        own, other = (statistics.median(part) for part in zip(*of_row, strict=True))
        ratios = sorted(other / own for own, other in of_row)
        print(f"| `{name}` | {own:.0f} | {peer} | {other:.0f} | {other / own:.1f} | {ratios[0]:.1f} to {ratios[-1]:.1f} |")
    print("\nno peer: " + ", ".join(f"`{name}` {statistics.median(t):.0f}" for name, t in alone.items() if None not in t))
    print(f"load: {min(loads):.1f} to {max(loads):.1f}")


if __name__ == "__main__":
    main()
