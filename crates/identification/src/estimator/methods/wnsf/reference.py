"""Weighted null-space fitting by numpy, for tests.rs: python3 reference.py FOLDER > reference.json

A long model by lstsq, zeros before the record: ARX, or FIR for output-error structures. With its coefficients eta and
R = Phi'Phi, theta solves the linear equations of the structure by least squares, and then with the weight
inverse(T inverse(R) T'), T the derivative of the equations by eta at the theta before, as a whole matrix: Galrinho, Rojas and
Hjalmarsson (2019), section IV. Of the weighted solutions the one with the least sum of squared prediction errors counts.
With a start or an offset the long model has the equations within the record alone, with a constant, which R is about; sums are
those of the best start and offset, and standard errors those of all by the gradient, both of ../../prediction_error/offset.py.
numpy 2, scipy 1.
"""
import json, pathlib, sys
import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter

sys.path.append(str(pathlib.Path(__file__).parents[2] / "prediction_error"))
from offset import beside


def lower(c, m):
    """The product with the polynomial c, cut to m coefficients."""
    return toeplitz(np.r_[c, np.zeros(m)][:m], np.zeros(m))


def case(folder, file, N, kind, orders, m, iterations, added=(0, 0), start=False, offset=False):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    d = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = d["u"][:N] + added[0], d["y"][:N] + added[1]
    na, nb, nc, nd, nf, nk = (orders.get(key, 0) for key in ("na", "nb", "nc", "nd", "nf", "nk"))
    lag = lambda x, i: np.r_[np.zeros(i), x[: N - i]]
    of_u = [lag(u, nk + i) for i in range(m)]
    Phi = np.column_stack(of_u if kind == "oe" else [-lag(y, i) for i in range(1, m + 1)] + of_u)
    first = max(0 if kind == "oe" else m, nk + m - 1) if start or offset else 0
    Phi, target = Phi[first:], y[first:]
    if offset:
        Phi, target = Phi - Phi.mean(0), target - target.mean()
    eta, R = np.linalg.lstsq(Phi, target, rcond=None)[0], Phi.T @ Phi
    Ah, Bh = np.r_[1, eta[:-m]], eta[-m:]
    columns = lambda c, count: lower(np.r_[0, c], m + 1)[1:, :count]  # c q^-1, c q^-2, ... from q^-1 on
    one = np.eye(m)
    shifted = lower(np.r_[0, Bh], m)  # q^-1 Bh, q^-2 Bh, ... from q^-nk on
    zero = lambda count: np.zeros((m, count))
    if kind == "oe":
        Q, fixed = np.hstack([-one[:, :nb], shifted[:, :nf]]), Bh
    elif kind == "armax":
        Q = np.block([[-one[:, :na], zero(nb), columns(Ah, nc)], [zero(na), -one[:, :nb], shifted[:, :nc]]])
        fixed = np.r_[Ah[1:], Bh]
    else:
        Q = np.block([[zero(nb), columns(Ah, nc), -one[:, :nd], zero(nf)],
                      [-lower(Ah, m)[:, :nb], zero(nc), zero(nd), shifted[:, :nf]]])
        fixed = np.r_[Ah[1:], Bh]
    theta, least = np.linalg.lstsq(Q, -fixed, rcond=None)[0], np.inf
    split = lambda t: np.split(t, np.cumsum([na, nb, nc, nd]))
    for _ in range(iterations):
        _, b, c, _, f = split(theta)
        C, F = np.r_[1, c], np.r_[1, f]
        assert all(abs(np.roots(p)).max(initial=0) < 1 for p in (C, F))
        if kind == "oe":
            T = lower(F, m)
        elif kind == "armax":
            T = np.kron(np.eye(2), lower(C, m))
        else:
            T = np.block([[lower(C, m), np.zeros((m, m))], [-lower(np.r_[0, b], m), lower(F, m)]])
        I = np.linalg.inv(T)
        W = I.T @ R @ I
        theta = np.linalg.solve(Q.T @ W @ Q, -Q.T @ W @ fixed)
        a, b, c, d_, f = (np.r_[1, p] for p in split(theta))
        e = lfilter(np.convolve(d_, a), c, y) - lfilter(np.convolve(d_, np.r_[np.zeros(nk), b[1:]]), np.convolve(c, f), u)
        if start or offset:
            mu, e, joint = beside(theta, orders, (u, y), start, offset)
        if e @ e < least:
            least, best = e @ e, theta
            se = np.sqrt(np.diag(np.linalg.inv(Q.T @ W @ Q)) * least / (N - len(theta)))
            extra = dict(offset=mu if offset else None, se=joint.tolist()) if start or offset else {}
    return dict(file=file, N=N, orders=",".join(f"{k}={v}" for k, v in orders.items()), high_order=m, iterations=iterations,
                theta=best.tolist(), se=se.tolist(), loss=least / N, added=added, initial="estimate" if start else "zero") | extra


cases = [("sim_oe2.csv", 1000, "oe", dict(nb=2, nf=2, nk=1), 25, 4), ("epfl_laserbeam.csv", 500, "oe", dict(nb=2, nf=2, nk=1), 30, 3),
         ("sim_armax2.csv", 800, "armax", dict(na=2, nb=2, nc=2, nk=1), 12, 4),
         ("daisy_dryer.csv", 900, "armax", dict(na=2, nb=2, nc=1, nk=3), 15, 2),
         ("sim_bj2.csv", 1500, "bj", dict(nb=2, nc=2, nd=2, nf=2, nk=1), 14, 5), ("sim_bj2.csv", 700, "bj", dict(nb=2, nd=1, nf=2, nk=1), 10, 3),
         ("sim_oe2.csv", 1000, "oe", dict(nb=2, nf=2, nk=1), 25, 4, (0, 7), False, True),
         ("daisy_dryer.csv", 900, "armax", dict(na=2, nb=2, nc=1, nk=3), 15, 2, (0, 0), True, True),
         ("sim_bj2.csv", 1500, "bj", dict(nb=2, nc=2, nd=2, nf=2, nk=1), 14, 5, (3, 100), True, True),
         ("sim_bj2.csv", 700, "bj", dict(nb=2, nd=1, nf=2, nk=1), 10, 3, (0, 0), True, False)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c)) for c in cases) + "]")
