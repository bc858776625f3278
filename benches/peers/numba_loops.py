"""W98 (see workload.py) with Numba: scalar loops compiled to machine code, parallel over trials; what is probably the
fastest that a Python user writes in an afternoon."""

import numba
import numpy as np
from workload import (
    A_TRUE,
    AMPLITUDE,
    B_TRUE,
    NOISE_LEVEL,
    ORDER,
    PASSES,
    SAMPLES,
    WINDOW,
    lead,
    measure,
    options,
    stationary_factor,
)

n = ORDER
# With NumPy's errors a division by zero gives inf or NaN, which `measure` counts as a failed trial.
OPTIONS = {"fastmath": True, "error_model": "numpy", "cache": True}
compiled = numba.njit(**OPTIONS)


@compiled
def step(a, x):
    """x becomes A x, in place."""
    last = 0.0
    for i in range(n):
        last += a[i] * x[i]
    for i in range(n - 1):
        x[i] = x[i + 1]
    x[n - 1] = last


@compiled
def simulate(a, b, x0, u, outputs):
    """The outputs x_1(k) of x(k+1) = A x(k) + b u(k) from x0."""
    x = x0.copy()
    for k in range(len(outputs)):
        outputs[k] = x[0]
        step(a, x)
        for i in range(n):
            x[i] += b[i] * u[k]


@compiled
def solve(G, r):
    """r becomes p of G p = r: Gaussian elimination with partial pivoting, in place."""
    size = len(r)
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(G[j, i]) > abs(G[pivot, i]):
                pivot = j
        if pivot != i:
            for c in range(i, size):
                G[i, c], G[pivot, c] = G[pivot, c], G[i, c]
            r[i], r[pivot] = r[pivot], r[i]
        for j in range(i + 1, size):
            factor = G[j, i] / G[i, i]
            for c in range(i, size):
                G[j, c] -= factor * G[i, c]
            r[j] -= factor * r[i]
    for i in range(size - 1, -1, -1):
        rest = r[i]
        for c in range(i + 1, size):
            rest -= G[i, c] * r[c]
        r[i] = rest / G[i, i]


@compiled
def estimate_parameters(z, y, u, a, b):
    """a and b from instruments formed of z and u (stages 1 to 5 and 8 to 10); z = y is least squares."""
    G = np.zeros((2 * n, 2 * n))
    p = np.zeros(2 * n)
    regressor = np.empty(2 * n)
    instrument = np.empty(2 * n)
    for k in range(n, WINDOW):
        for i in range(n):
            regressor[i] = -y[k - 1 - i]
            instrument[i] = -z[k - 1 - i]
            regressor[n + i] = u[k - 1 - i]
            instrument[n + i] = u[k - 1 - i]
        for i in range(2 * n):
            for j in range(2 * n):
                G[i, j] += instrument[i] * regressor[j]
            p[i] += instrument[i] * y[k]
    solve(G, p)
    for i in range(n):
        a[n - 1 - i] = -p[i]
    for i in range(n):
        b[i] = p[n + i]
        for j in range(i):
            b[i] += a[n - i + j] * b[j]


@compiled
def estimate_initial_state(a, b, y, u, x0):
    """x0 from the output less the zero-state response, by the normal equations (stage 6)."""
    response = np.empty(WINDOW)
    simulate(a, b, np.zeros(n), u, response)
    G = np.zeros((n, n))
    x0[:] = 0.0
    row = np.zeros(n)
    row[0] = 1.0
    for k in range(WINDOW):
        rest = y[k] - response[k]
        for i in range(n):
            for j in range(n):
                G[i, j] += row[i] * row[j]
            x0[i] += row[i] * rest
        last = row[n - 1]
        for i in range(n - 1, 0, -1):
            row[i] = row[i - 1] + last * a[i]
        row[0] = last * a[0]
    solve(G, x0)


@compiled
def noise(start, ahead, factor):
    """White noise through 1/A(q), after so many numbers ahead of it: a burn-in (start 0) or the stationary draw (1)."""
    f = np.empty(ahead + SAMPLES)
    for k in range(len(f)):
        f[k] = np.random.standard_normal()
    first = 0
    if start == 1:
        f[:n] = factor @ f[:n]
        first = n
    for k in range(first, len(f)):
        for j in range(1, min(k, n) + 1):
            f[k] += A_TRUE[n - j] * f[k - j]
    return f[ahead:]


@compiled
def relative(truth, found):
    """|truth - found| / |truth|."""
    difference = 0.0
    size = 0.0
    for i in range(n):
        difference += (truth[i] - found[i]) ** 2
        size += truth[i] ** 2
    return np.sqrt(difference / size)


@compiled
def trial(seed, start, ahead, factor, errors):
    """e_a, e_b and max e_x of one trial."""
    np.random.seed(seed)
    u = np.empty(SAMPLES)
    states = np.empty((SAMPLES, n))
    x = np.ones(n)
    for k in range(SAMPLES):
        u[k] = AMPLITUDE if np.random.random() < 0.5 else -AMPLITUDE
        states[k] = x
        step(A_TRUE, x)
        for i in range(n):
            x[i] += B_TRUE[i] * u[k]
    f = noise(start, ahead, factor)
    output = states[:, 0]
    y = output + f * (NOISE_LEVEL * output[:WINDOW].std() / f[:WINDOW].std())

    a = np.empty(n)
    b = np.empty(n)
    x0 = np.empty(n)
    auxiliary = np.empty(WINDOW)
    estimate_parameters(y, y, u, a, b)
    estimate_initial_state(a, b, y, u, x0)
    for _ in range(PASSES):
        simulate(a, b, x0, u, auxiliary)
        estimate_parameters(auxiliary, y, u, a, b)
        estimate_initial_state(a, b, y, u, x0)

    # Stage 12: g = A^n e_n, Ackermann's formula, where the observability matrix is I.
    gain = np.zeros(n)
    gain[n - 1] = 1.0
    for _ in range(n):
        step(a, gain)
    worst = 0.0
    for k in range(SAMPLES):
        if k >= WINDOW:
            worst = max(worst, relative(states[k], x0))
        innovation = y[k] - x0[0]
        step(a, x0)
        for i in range(n):
            x0[i] += b[i] * u[k] + gain[i] * innovation
    errors[0] = relative(A_TRUE, a)
    errors[1] = relative(B_TRUE, b)
    errors[2] = worst


@numba.njit(parallel=True, **OPTIONS)
def sweep(trials, seed, start, ahead, factor):
    """All trials; each has a generator of its own, seeded with its number."""
    errors = np.empty((trials, 3))
    for s in numba.prange(trials):
        trial((seed * 100_000_000 + s) % 2**32, start, ahead, factor, errors[s])
    return errors


def main():
    given = options(__doc__, trials=20000)
    numba.set_num_threads(given.threads)
    start = int(given.start == "stationary")
    factor = stationary_factor()

    def run(trials, seed):
        return sweep(trials, seed, start, lead(given.start), factor)

    measure("numba", numba.__version__, given, run)


if __name__ == "__main__":
    main()
