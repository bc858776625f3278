"""W98 (see workload.py) with NumPy: every step for a batch of trials at once, the algebra by LAPACK; a process per
thread, since NumPy computes such batches on one.

Signals are (samples, trials), states (samples, n, trials), parameters (n, trials), matrices (trials, rows, columns).
"""

import contextlib
import functools
import multiprocessing

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


def simulate(a, b, x0, u, gain=None, y=None):
    """The states of x(k+1) = A x(k) + b u(k) from x0; with a gain, of the observer: + gain (y(k) - x_1(k))."""
    states = np.empty((len(u), *x0.shape))
    states[0] = x0
    for k in range(len(u) - 1):
        now, after = states[k], states[k + 1]
        np.multiply(b, u[k], out=after)
        after[:-1] += now[1:]
        after[-1] += np.einsum("ib,ib->b", a, now)
        if gain is not None:
            after += gain * (y[k] - now[0])
    return states


def noise(rng, trials, start):
    """White noise through 1/A(q): f(k) = a_n f(k-1) + ... + a_1 f(k-n) + w(k)."""
    ahead = lead(start)
    f = rng.standard_normal((ahead + SAMPLES, trials))
    if start == "stationary":
        f[:ORDER] = stationary_factor() @ f[:ORDER]
    for k in range(ORDER if start == "stationary" else 1, len(f)):
        past = f[max(k - ORDER, 0) : k]
        f[k] += A_TRUE[ORDER - len(past) :] @ past
    return f[ahead:]


def lagged(s):
    """The Toeplitz blocks with the rows s(k-1), ..., s(k-n), k = n, ..., N-1."""
    windows = np.lib.stride_tricks.sliding_window_view(s[: WINDOW - 1], ORDER, axis=0)
    return windows.transpose(1, 0, 2)[:, :, ::-1]


def or_nan(operation, *matrices):
    """The operation for every trial; NaN for one whose matrix is exactly singular (an unstable estimate's may be, in
    some trial of ten thousand), where NumPy gives none of the batch."""
    try:
        return operation(*matrices)
    except np.linalg.LinAlgError:
        if len(matrices[0]) == 1:
            return np.full_like(matrices[-1], np.nan)
        halves = zip(*(np.array_split(m, 2) for m in matrices))
        return np.concatenate([or_nan(operation, *half) for half in halves])


def solve_partitioned(G, r):
    """p of G p = r by the partitioned inverse (stages 3, 4, 10)."""
    n = ORDER
    G11, G12, G21, G22 = G[:, :n, :n], G[:, :n, n:], G[:, n:, :n], G[:, n:, n:]
    M1 = or_nan(np.linalg.inv, G11)
    M2 = or_nan(np.linalg.inv, G22 - G21 @ M1 @ G12)
    P = M1 @ G12 @ M2
    Q = M2 @ G21 @ M1
    C = np.block([[M1 + P @ G21 @ M1, -P], [-Q, M2]])
    return (C @ r)[:, :, 0].T


def parameters(p):
    """a from p, and b from T b = h (stages 4, 5)."""
    a, h = -p[ORDER - 1 :: -1], p[ORDER:]
    b = np.empty_like(h)
    for i in range(ORDER):
        b[i] = h[i] + sum(a[ORDER - i + j] * b[j] for j in range(i))
    return a, b


def initial_state(a, b, y, u):
    """x0 from the output less the zero-state response, by the normal equations (stage 6)."""
    D = np.zeros((WINDOW, *a.shape))
    D[0, 0] = 1.0
    for k in range(WINDOW - 1):
        np.multiply(D[k, -1], a, out=D[k + 1])
        D[k + 1, 1:] += D[k, :-1]
    D = np.ascontiguousarray(D.transpose(2, 0, 1))
    z = (y - simulate(a, b, np.zeros_like(a), u)[:, 0]).T[:, :, None]
    Dt = D.transpose(0, 2, 1)
    return or_nan(np.linalg.solve, Dt @ D, Dt @ z)[:, :, 0].T


def one_pass(Z, Phi, target, y, u):
    """a, b and x0 with the instruments Z; those of least squares are Phi itself."""
    Zt = Z.transpose(0, 2, 1)
    a, b = parameters(solve_partitioned(Zt @ Phi, Zt @ target))
    return a, b, initial_state(a, b, y, u)


def estimate(y, u):
    """a, b and x0 after the last pass (stages 1 to 11); y and u are the window's."""
    U, target = lagged(u), y[ORDER:].T[:, :, None]
    Phi = np.concatenate([-lagged(y), U], axis=2)
    a, b, x0 = one_pass(Phi, Phi, target, y, u)
    for _ in range(PASSES):
        Z = np.concatenate([-lagged(simulate(a, b, x0, u)[:, 0]), U], axis=2)
        a, b, x0 = one_pass(Z, Phi, target, y, u)
    return a, b, x0


def dead_beat(a):
    """g = A^n e_n: Ackermann's formula, where the observability matrix is I (stage 12)."""
    x = np.zeros_like(a)
    x[-1] = 1.0
    for _ in range(ORDER):
        x = np.concatenate([x[1:], np.einsum("ib,ib->b", a, x)[None]])
    return x


def relative(truth, found):
    """|truth - found| / |truth| along the second axis from the right."""
    return np.linalg.norm(truth - found, axis=-2) / np.linalg.norm(truth, axis=-2)


@np.errstate(all="ignore")
def batch_of_trials(seed, trials, start):
    """e_a, e_b and max e_x of so many trials, (trials, 3)."""
    rng = np.random.default_rng(seed)
    a_true, b_true = A_TRUE[:, None], B_TRUE[:, None]
    u = AMPLITUDE * rng.choice([-1.0, 1.0], (SAMPLES, trials))
    states = simulate(a_true, b_true, np.ones((ORDER, trials)), u)
    output = states[:, 0]
    f = noise(rng, trials, start)
    y = output + f * (NOISE_LEVEL * output[:WINDOW].std(axis=0) / f[:WINDOW].std(axis=0))
    a, b, x0 = estimate(y[:WINDOW], u[:WINDOW])
    observed = simulate(a, b, x0, u, dead_beat(a), y)
    e_x = relative(states[WINDOW:], observed[WINDOW:]).max(axis=0)
    return np.stack([relative(a_true, a), relative(b_true, b), e_x], axis=1)


def main():
    given = options(__doc__, trials=4000, batch=500)
    batch = functools.partial(batch_of_trials, trials=given.batch, start=given.start)

    def run(trials, seed, pool):
        # At least a batch for each process, so that the first run warms all of them.
        batches = max(-(-trials // given.batch), given.threads)
        seeds = np.random.SeedSequence(seed).spawn(batches)
        return np.concatenate(list(pool.imap(batch, seeds)) if pool else [batch(s) for s in seeds])

    with multiprocessing.Pool(given.threads) if given.threads > 1 else contextlib.nullcontext() as pool:
        measure("numpy", np.__version__, given, functools.partial(run, pool=pool))


if __name__ == "__main__":
    main()
