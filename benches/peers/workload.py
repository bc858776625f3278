"""What the Python peers share: W98's constants, the noise's start, options, timing and the line of JSON.

W98 is claim C2 of Nikolov et al. (2023), for each trial anew:

- plant: order n = 6, x(k+1) = A x(k) + b u(k), y(k) = x_1(k) + f(k), x(0) = (1, ..., 1), k = 0, ..., K-1, K = 400;
  A is the companion matrix whose last row is a;
- input: independent random signs, times 10;
- noise: f is white Gaussian noise through 1/A(q), scaled so that 100 std(f) / std(x_1) = 10.018 over the window, the
  first N = 98 samples;
- estimates: least squares and four passes of instrumental variables in the window, b and x(0) renewed in each;
- observer: dead beat, from the estimated x(0), over all K samples;
- errors: e_a = |a - a^| / |a|, e_b likewise, and the largest |x(k) - x^(k)| / |x(k)| over k >= N.
"""

import argparse
import json
import math
import os
import time

# Trials run in parallel, never the algebra inside of one: its matrices are 12 x 12.
for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402 (reads the variables above)

A_TRUE = np.array([-0.00009, 0.002835, -0.035525, 0.2275, -0.7875, 1.4])
B_TRUE = np.array([0.6, 0.2, 0.1, 0.3, 0.4, 0.5])
ORDER = len(A_TRUE)
WINDOW = 98
SAMPLES = 400
PASSES = 4
AMPLITUDE = 10.0
NOISE_LEVEL = 0.10018
BURN_IN = 200
STARTS = ("burn-in", "stationary")


def stationary_factor():
    """The lower triangular L with L L' = P = F P F' + e_n e_n', F the companion matrix of the noise filter: L z with
    z ~ N(0, I) is a draw of (f(k-n), ..., f(k-1)) that is stationary from the first sample on."""
    F = np.eye(ORDER, k=1)
    F[-1] = A_TRUE
    drive = np.zeros((ORDER, ORDER))
    drive[-1, -1] = 1.0
    P = np.linalg.solve(np.eye(ORDER**2) - np.kron(F, F), drive.ravel()).reshape(ORDER, ORDER)
    return np.linalg.cholesky(P)


def lead(start):
    """How many normal numbers are drawn before those of the K samples: the burn-in, or z of `stationary_factor`."""
    return BURN_IN if start == "burn-in" else ORDER


def available_cpus():
    """The CPUs that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def median_and_error(values):
    """The median and its standard error, from the order statistics that bound it with 95 % (ranks M/2 +- 0.98 sqrt M):
    their distance over 2 * 1.96."""
    ordered = np.sort(values)
    count = len(ordered)
    if count == 0:
        return math.nan, math.nan
    reach = 0.98 * math.sqrt(count)
    low = max(math.floor(count / 2 - reach), 0)
    high = min(math.ceil(count / 2 + reach), count - 1)
    return float(np.median(ordered)), float(ordered[high] - ordered[low]) / (2 * 1.96)


def options(about, trials, batch=None):
    """The command line of a peer: `trials` and `batch` are its defaults."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--trials", type=int, default=trials, help="trials to time; whole batches [%(default)s]")
    parser.add_argument("--threads", type=int, default=available_cpus(), help="threads or processes [%(default)s]")
    parser.add_argument("--seed", type=int, default=1, help="another seed, other trials [%(default)s]")
    parser.add_argument("--start", choices=STARTS, default="burn-in", help="how the noise begins: 200 samples that are "
                        "thrown away, or an exact draw of its stationary distribution [%(default)s]")
    if batch:
        parser.add_argument("--batch", type=int, default=batch, help="trials computed together [%(default)s]")
    given = parser.parse_args()
    for name in ("trials", "threads", "batch"):
        if getattr(given, name, 1) < 1:
            parser.error(f"--{name} must be at least 1")
    if not 0 <= given.seed < 2**31:
        parser.error("--seed must be between 0 and 2^31 - 1")
    if given.threads > available_cpus():
        parser.error(f"--threads {given.threads}: this process may use {available_cpus()} CPUs")
    return given


def measure(tool, version, given, run):
    """Times `run(trials, seed)`, which returns an array of at least `trials` rows (e_a, e_b, max e_x), and prints the
    line of JSON. A short run before makes compilers and pools ready."""
    run(1, given.seed + 1)
    began = time.perf_counter()
    errors = run(given.trials, given.seed)
    seconds = time.perf_counter() - began
    finite = errors[np.isfinite(errors).all(axis=1)]
    line = {
        "tool": tool,
        "version": version,
        "threads": given.threads,
        "start": given.start,
        "seed": given.seed,
        "trials": len(errors),
        "failed": len(errors) - len(finite),
        "seconds": seconds,
        "trials_per_second": len(errors) / seconds,
    }
    for name, values in zip(("e_a", "e_b", "e_x_max"), finite.T):
        line[name], line[f"{name}_se"] = median_and_error(values)
    print(json.dumps(line))
