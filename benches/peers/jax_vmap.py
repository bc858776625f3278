"""W98 (see workload.py) with JAX: one trial as a function, made a batch of trials by `vmap` and compiled by XLA in
double precision, for the CPU or the GPU that JAX finds. XLA parallelises little of such a program, so that on a CPU
each thread computes batches of its own."""

import os
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
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

# Of row k - n, the samples k-1, ..., k-n: the Toeplitz blocks are s[LAGS].
LAGS = np.arange(ORDER, WINDOW)[:, None] - 1 - np.arange(ORDER)


def step(a, x):
    """A x."""
    return jnp.append(x[1:], a @ x)


def simulate(a, b, x0, u):
    """The states of x(k+1) = A x(k) + b u(k) from x0."""
    return jax.lax.scan(lambda x, u_k: (step(a, x) + b * u_k, x), x0, u)[1]


def noise(key, start):
    """White noise through 1/A(q), scanned with its last n values as state."""
    w = jax.random.normal(key, (lead(start) + SAMPLES,))
    past = jnp.zeros(ORDER)
    if start == "stationary":
        past, w = stationary_factor() @ w[:ORDER], w[ORDER:]

    def next_value(past, w_k):
        f_k = A_TRUE @ past + w_k
        return jnp.append(past[1:], f_k), f_k

    return jax.lax.scan(next_value, past, w)[1][-SAMPLES:]


def solve_partitioned(G, r):
    """p of G p = r by the partitioned inverse (stages 3, 4, 10)."""
    n = ORDER
    G11, G12, G21, G22 = G[:n, :n], G[:n, n:], G[n:, :n], G[n:, n:]
    M1 = jnp.linalg.inv(G11)
    M2 = jnp.linalg.inv(G22 - G21 @ M1 @ G12)
    P = M1 @ G12 @ M2
    Q = M2 @ G21 @ M1
    return jnp.block([[M1 + P @ G21 @ M1, -P], [-Q, M2]]) @ r


def parameters(p):
    """a from p, and b from T b = h (stages 4, 5)."""
    a, h = -p[:ORDER][::-1], p[ORDER:]
    b = []
    for i in range(ORDER):
        b.append(h[i] + sum(a[ORDER - i + j] * b[j] for j in range(i)))
    return a, jnp.stack(b)


def initial_state(a, b, y, u):
    """x0 from the output less the zero-state response, by the normal equations (stage 6)."""

    def next_row(row, _):
        return jnp.append(0.0, row[:-1]) + row[-1] * a, row

    D = jax.lax.scan(next_row, jnp.eye(ORDER)[0], length=WINDOW)[1]
    z = y - simulate(a, b, jnp.zeros(ORDER), u)[:, 0]
    return jnp.linalg.solve(D.T @ D, D.T @ z)


def estimate(y, u):
    """a, b and x0 after the last pass (stages 1 to 11); y and u are the window's."""
    U, target = u[LAGS], y[ORDER:]
    Phi = jnp.concatenate([-y[LAGS], U], axis=1)

    def one_pass(Z):
        a, b = parameters(solve_partitioned(Z.T @ Phi, Z.T @ target))
        return a, b, initial_state(a, b, y, u)

    a, b, x0 = one_pass(Phi)
    for _ in range(PASSES):
        auxiliary = simulate(a, b, x0, u)[:, 0]
        a, b, x0 = one_pass(jnp.concatenate([-auxiliary[LAGS], U], axis=1))
    return a, b, x0


def dead_beat(a):
    """g = A^n e_n: Ackermann's formula, where the observability matrix is I (stage 12)."""
    x = jnp.eye(ORDER)[-1]
    for _ in range(ORDER):
        x = step(a, x)
    return x


def relative(truth, found):
    """|truth - found| / |truth| along the last axis."""
    return jnp.linalg.norm(truth - found, axis=-1) / jnp.linalg.norm(truth, axis=-1)


def trial(key, start):
    """e_a, e_b and max e_x of one trial."""
    input_key, noise_key = jax.random.split(key)
    u = AMPLITUDE * jax.random.rademacher(input_key, (SAMPLES,), dtype=float)
    states = simulate(A_TRUE, B_TRUE, jnp.ones(ORDER), u)
    output = states[:, 0]
    f = noise(noise_key, start)
    y = output + f * (NOISE_LEVEL * output[:WINDOW].std() / f[:WINDOW].std())
    a, b, x0 = estimate(y[:WINDOW], u[:WINDOW])
    gain = dead_beat(a)

    def observe(x, sample):
        u_k, y_k = sample
        return step(a, x) + b * u_k + gain * (y_k - x[0]), x

    observed = jax.lax.scan(observe, x0, (u, y))[1]
    e_x = relative(states[WINDOW:], observed[WINDOW:]).max()
    return jnp.stack([relative(A_TRUE, a), relative(B_TRUE, b), e_x])


def main():
    given = options(__doc__, trials=8000, batch=500)
    if hasattr(os, "sched_setaffinity"):
        # XLA's own threads too: it starts one for each CPU of the process.
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: given.threads])
    jax.config.update("jax_enable_x64", True)
    # A batch is computed in the thread that asks for it.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    batch = jax.jit(jax.vmap(lambda key: trial(key, given.start)))
    pool = ThreadPoolExecutor(given.threads)

    def run(trials, seed):
        keys = jax.random.split(jax.random.key(seed), (-(-trials // given.batch), given.batch))
        return np.concatenate(list(pool.map(lambda keys_of_batch: np.asarray(batch(keys_of_batch)), keys)))

    platform = jax.devices()[0].platform
    measure("jax" if platform == "cpu" else f"jax {platform}", jax.__version__, given, run)


if __name__ == "__main__":
    main()
