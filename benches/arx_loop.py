"""Microseconds of a fit of ARX models in a Python loop, beside NumPy's least squares and SIPPY, and the growth of memory.
Of ten parts of the fits the fastest counts.

    python benches/arx_loop.py [FITS]
"""

import resource
import sys
import time

import asobench as ab
import numpy as np

FITS = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
rng = np.random.default_rng(1)
u = rng.choice([-1.0, 1.0], 500)
y = ab.Model(A=[1, -1.5, 0.7], B=[1.0, 0.5], nk=1).simulate(u) + 0.1 * rng.standard_normal(500)


def regression(u, y):
    return np.column_stack([-y[1:-1], -y[:-2], u[1:-1], u[:-2]]), y[2:]


def lstsq():
    return np.linalg.lstsq(*regression(u, y), rcond=None)[0]


def lstsq_with_covariance():
    phi, target = regression(u, y)
    theta, rss, *_ = np.linalg.lstsq(phi, target, rcond=None)
    return theta, rss / (len(phi) - 4) * np.linalg.inv(phi.T @ phi)


def timed(name, function, fits):
    function()
    before, times = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, []
    for _ in range(10):
        begin = time.perf_counter()
        for _ in range(fits // 10):
            function()
        times.append(time.perf_counter() - begin)
    micro = 1e6 * min(times) / (fits // 10)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(f"{name:<44}{micro:>9.1f} us a fit{grown:>8} KiB more after {fits} fits")


timed("asobench.estimate", lambda: ab.estimate(u, y, "arx", na=2, nb=2, nk=1), FITS)
timed("asobench.estimate, params and se", lambda: ab.estimate(u, y, "arx", na=2, nb=2, nk=1).se, FITS)
timed("asobench.estimate of lists", lambda a=u.tolist(), b=y.tolist(): ab.estimate(a, b, "arx", na=2, nb=2, nk=1), FITS)
timed("numpy.linalg.lstsq", lstsq, FITS)
timed("numpy.linalg.lstsq with covariance", lstsq_with_covariance, FITS)
try:
    from sippy_unipi import system_identification
except ImportError:
    print("SIPPY: not installed (pip install sippy-unipi)")
else:
    timed("SIPPY", lambda: system_identification(y, u, "ARX", ARX_orders=[2, 2, 1]), FITS // 50)
