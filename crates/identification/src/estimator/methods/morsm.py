"""Fixed points of BJSM and MORSM by numpy, for the tests of morsm.rs: python3 morsm.py FOLDER > morsm.json

A long ARX model by lstsq, zeros before the record; u and y (or the model's output) filtered by its A; Steiglitz-McBride
by lstsq until theta rests to 1e-13. Standard errors from a gradient by central differences of B/F u filtered by that A. No
trend is removed. With a start or an offset the long model has the equations within the record alone, with a constant, and the
first m filtered samples are left out; lstsq has columns of the filtered start and the constant. numpy 2, scipy 1.
"""
import json, pathlib, sys
import numpy as np
from scipy.signal import lfilter

sys.path.append(str(pathlib.Path(__file__).parents[1] / "prediction_error"))
from offset import beside

def case(folder, file, N, nb, nf, nk, m, method, added=(0, 0), start=False, offset=False):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    d = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = d["u"][:N] + added[0], d["y"][:N] + added[1]
    lag = lambda x, i: np.r_[np.zeros(i), x[:len(x) - i]]
    extra = start or offset
    Phi = np.column_stack([-lag(y, i) for i in range(1, m + 1)] + [lag(u, nk + i) for i in range(m)])
    first = max(m, nk + m - 1) if extra else 0
    if offset:
        Phi = np.column_stack([Phi, np.ones(N)])
    long = np.linalg.lstsq(Phi[first:], y[first:], rcond=None)[0]
    A, B = np.r_[1, long[:m]], np.r_[np.zeros(nk), long[m:2 * m]]
    cut = m if extra and method == "bjsm" else 0
    # From rest about the mean of u where the start and the offset take up any constant.
    v = u - u.mean() if start and offset and method == "morsm" else u
    uf, yf = lfilter(A, [1], v), lfilter(A, [1], y) if method == "bjsm" else lfilter(B, [1], v)
    uf, yf = uf[cut:], yf[cut:]
    F, theta = np.array([1.0]), None
    for _ in range(5000):
        u_, y_ = lfilter([1], F, uf), lfilter([1], F, yf)
        Phi = np.column_stack([lag(u_, nk + i) for i in range(nb)] + [-lag(y_, i) for i in range(1, nf + 1)])
        if cut:
            pulse = lfilter([1], F, np.eye(1, len(uf))[0])
            columns = [lag(pulse, i) for i in range(max(nf, nb + nk - 1))] + [np.ones(len(uf))] * offset
            Phi = np.column_stack([Phi] + columns)
        new = np.linalg.lstsq(Phi, y_, rcond=None)[0][:nb + nf]
        rest = theta is not None and abs(new - theta).max() < 1e-13
        theta, F = new, np.r_[1, new[nb:]]
        assert abs(np.roots(F)).max() < 1
        if rest:
            break
    assert rest
    given = dict(method=method, file=file, N=N, orders=f"nb={nb},nf={nf},nk={nk}", high_order=m, theta=theta.tolist())
    if extra:
        record = lfilter(A, [1], u)[m:], lfilter(A, [1], y)[m:]
        mu, _, se = beside(theta, dict(nb=nb, nf=nf, nk=nk), record, True, offset)
        se[nb + nf:] /= A.sum()
        return given | dict(se=abs(se).tolist(), offset=mu / A.sum() if offset else None, added=added,
                            initial="estimate" if start else "zero")
    output = lambda t, u: lfilter(np.r_[np.zeros(nk), t[:nb]], np.r_[1, t[nb:]], u)
    e = lfilter(A, [1], y - output(theta, u))
    step = 1e-5 * np.eye(nb + nf)
    psi = np.column_stack([(output(theta + s, uf) - output(theta - s, uf)) / 2e-5 for s in step])
    se = np.sqrt(np.diag(np.linalg.inv(psi.T @ psi)) * (e @ e) / (N - nb - nf))
    return given | dict(se=se.tolist())

more = [("sim_bj2.csv", 1500, 2, 2, 1, 12, (3, 100), True, True), ("daisy_dryer.csv", 1000, 2, 2, 3, 14, (0, 0), True, True),
        ("sim_oe2.csv", 1000, 2, 2, 1, 8, (0, 7), False, True), ("sim_bj2.csv", 900, 2, 2, 1, 10, (0, 0), True, False)]
cases = [("sim_bj2.csv", 1500, 2, 2, 1, 12), ("sim_oe2.csv", 1000, 2, 2, 1, 8), ("epfl_laserbeam.csv", 500, 2, 2, 1, 10)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c[:6], m, *c[6:])) for c in cases + more for m in ("bjsm", "morsm")) + "]")
