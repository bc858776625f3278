"""Models with an offset of y and a start as parameters by scipy, for tests.rs: python3 offset.py FOLDER > offset.json

A (y - mu) = B/F u + C/D e. e is run sample by sample in the predictor's state space: w = A (y - mu), x = B/F u and
e = D/C (w - x) are three direct-form filters whose states at k = 0 are free, or zero. scipy's least_squares over all of these and mu, from
several starts, with the derivatives of the filters; Gauss-Newton steps by lstsq (SVD, since the states have redundant
directions) take what it leaves. The standard errors are s^2 pinv(J'J), s^2 = RSS/(N - rank J). Constants are added to the
columns of each record first. numpy 2, scipy 1.
"""
import json, sys
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

KEYS = ("na", "nb", "nc", "nd", "nf")
lag = lambda x, i: np.r_[np.zeros(i), x[: len(x) - i]] if i < len(x) else np.zeros(len(x))


def polynomials(theta, orders):
    na, nb, nc, nd, nf = (orders.get(key, 0) for key in KEYS)
    a, b, c, d, f = np.split(theta[: na + nb + nc + nd + nf], np.cumsum([na, nb, nc, nd]))
    one = lambda p: np.r_[1.0, p]
    return one(a), np.r_[np.zeros(orders["nk"]), b], one(c), one(d), one(f)


def parts(theta, orders, records, start):
    """The errors and their derivatives; theta is the parameters, an offset of each record, the states of each record."""
    A, B, C, D, F = polynomials(theta, orders)
    n = sum(orders.get(key, 0) for key in KEYS)
    nb, nk = orders["nb"], orders["nk"]
    e_all, rows = [], []
    states = theta[n + len(records) :]
    free = [len(A) - 1, max(len(B), len(F)) - 1, max(len(C), len(D)) - 1] if start else [0, 0, 0]
    for i, (u, y) in enumerate(records):
        N, ones = len(y), np.ones(len(y))
        z = np.split(states[i * sum(free) : (i + 1) * sum(free)], np.cumsum(free)[:2])
        def run(num, den, s, z):
            order = max(len(num), len(den)) - 1
            return lfilter(num, den, s, zi=z if len(z) else np.zeros(order))[0]
        v = y - theta[n + i]
        w, x = run(A, [1.0], v, z[0]), run(B, F, u, z[1])
        e = run(D, C, w - x, z[2])
        by = lambda s: lfilter(D, C, s)
        columns = [by(lag(v, j)) for j in range(1, len(A))]
        columns += [-by(lfilter([1.0], F, lag(u, nk + j))) for j in range(nb)]
        columns += [-lfilter([1.0], C, lag(e, j)) for j in range(1, len(C))]
        columns += [lfilter([1.0], C, lag(w - x, j)) for j in range(1, len(D))]
        columns += [by(lfilter([1.0], F, lag(x, j))) for j in range(1, len(F))]
        zero = np.zeros(N)
        columns += [-by(lfilter(A, [1.0], ones)) if j == i else zero for j in range(len(records))]
        impulses = []
        for part, (num, den, sign) in enumerate([(A, [1.0], 1), (B, F, -1), (D, C, 1)]):
            for j in range(free[part]):
                unit = np.eye(free[part])[j]
                h = run(num, den, zero, unit)
                impulses.append(sign * by(h) if part < 2 else h)
        for j in range(len(records)):
            columns += impulses if j == i else [zero] * len(impulses)
        e_all.append(e)
        rows.append(np.column_stack(columns))
    return np.concatenate(e_all), np.vstack(rows)


def errors_of(J, e):
    """Standard errors by all directions that the columns of J have, and how many they are."""
    s = np.linalg.norm(J, axis=0)
    rank = np.linalg.matrix_rank(J / s, tol=1e-9 * np.sqrt(len(s)))
    _, sigma, V = np.linalg.svd(J / s, full_matrices=False)
    V = V[:rank] / sigma[:rank, None]
    return np.sqrt(e @ e / (len(e) - rank) * (V**2).sum(0)) / s, rank


def beside(theta, orders, record, start, offset):
    """The offset and the start of one record that fit it best at the parameters theta: the offset, the errors, and the
    standard errors of theta and the offset."""
    na, nb, nc, nd, nf = (orders.get(key, 0) for key in KEYS)
    n = len(theta)
    free = na + max(nb + orders["nk"] - 1, nf) + max(nc, nd) if start else 0
    x = np.r_[theta, 0.0, np.zeros(free)]
    for _ in range(3):
        e, J = parts(x, orders, [record], start)
        keep = np.r_[np.arange(n), np.arange(n if offset else n + 1, len(x))]
        s = np.linalg.norm(J, axis=0)
        x[keep[n:]] -= np.linalg.lstsq((J / s)[:, keep[n:]], e, rcond=1e-10)[0] / s[keep[n:]]
    se, _ = errors_of(J[:, keep], e)
    return x[n], e, se[: n + 1 if offset else n]


def case(folder, file, lengths, added, orders, start):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    data = np.genfromtxt(lines, delimiter=",", names=True)
    records, first = [], 0
    for length, (of_u, of_y) in zip(lengths, added):
        part = slice(first, first + length)
        records.append((data["u"][part] + of_u, data["y"][part] + of_y))
        first += length
    n = sum(orders.get(key, 0) for key in KEYS)
    na, nb, nc, nd, nf = (orders.get(key, 0) for key in KEYS)
    free = (na + max(nb + orders["nk"] - 1, nf) + max(nc, nd)) * len(records) if start else 0
    # A long enough ARX model with a constant, of deviations, gives A or F and B.
    p = na or nf
    Phi, target = [], []
    for u, y in records:
        u, y = u - u.mean(), y - y.mean()
        rows = np.column_stack([-lag(y, j) for j in range(1, p + 1)] + [lag(u, orders["nk"] + j) for j in range(nb)])
        Phi.append(rows[30:]), target.append(y[30:])
    t = np.linalg.lstsq(np.vstack(Phi), np.concatenate(target), rcond=None)[0]
    a, b = t[:p], t[p:]
    rng, best = np.random.default_rng(1), None
    for attempt in range(8):
        den = np.r_[1, a]
        if attempt:
            roots = np.roots(den) * (1 - 0.1 * attempt * rng.random(p))
            den = np.real(np.poly(roots)) if np.allclose(np.imag(np.poly(roots)), 0) else den
        theta = np.r_[den[1:] if na else [], b, np.zeros(nc + nd), den[1:] if nf else []]
        gain = b.sum() / den.sum()
        mu = [y.mean() - gain * u.mean() if start else y[0] for u, y in records]
        theta = np.r_[theta, mu, np.zeros(free)]
        def inside(t):
            A, B, C, D, F = polynomials(t, orders)
            return all(len(q) == 1 or np.abs(np.roots(q)).max() < 1 for q in (C, F))
        big = np.full(sum(lengths), 1e3)
        errors = lambda t: parts(t, orders, records, start)[0] if inside(t) else big
        found = least_squares(errors, theta, lambda t: parts(t, orders, records, start)[1], method="trf",
                              x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=500)
        print(file, start, attempt, 2 * found.cost / sum(lengths), file=sys.stderr)
        if inside(found.x) and (best is None or found.cost < best.cost * (1 - 1e-9)):
            best = found
    theta = best.x
    scale = lambda J: np.linalg.norm(J, axis=0)
    for _ in range(300):
        e, J = parts(theta, orders, records, start)
        s = scale(J)
        theta = theta - np.linalg.lstsq(J / s, e, rcond=1e-10)[0] / s
    print("moved", np.abs(theta - best.x)[: n + len(records)].max(), file=sys.stderr)
    e, J = parts(theta, orders, records, start)
    se, rank = errors_of(J, e)
    print("rank", rank, J.shape[1], file=sys.stderr)
    m = n + len(records)
    return dict(file=file, lengths=lengths, added=added, orders=",".join(f"{k}={v}" for k, v in orders.items()),
                initial="estimate" if start else "zero", theta=theta[:n].tolist(), offsets=theta[n:m].tolist(), se=se[:m].tolist(), loss=e @ e / len(e))


oe = dict(nb=2, nf=2)
armax = dict(na=2, nb=2, nc=2)
bj = dict(nb=2, nc=1, nd=1, nf=2)
cases = [
    ("daisy_dryer.csv", [1000], [[0, 0]], oe | dict(nk=3), True),
    ("daisy_dryer.csv", [1000], [[0, 0]], armax | dict(nk=3), True),
    ("daisy_dryer.csv", [1000], [[0, 0]], bj | dict(nk=3), True),
    ("sim_oe2.csv", [800], [[0, 7]], oe | dict(nk=1), False),
    ("sim_armax2.csv", [1000], [[0, -30]], armax | dict(nk=1), False),
    ("sim_bj2.csv", [1000], [[0, 100]], bj | dict(nk=1), False),
    ("sim_bj2.csv", [1000], [[3, 100]], bj | dict(nk=1), True),
    ("daisy_dryer.csv", [400, 600], [[0, 0], [1, 3]], oe | dict(nk=3), True),
    ("sim_armax2.csv", [300, 500], [[0, 5], [0, -30]], armax | dict(nk=1), False),
]
if __name__ == "__main__":
    print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c)) for c in cases) + "]")
