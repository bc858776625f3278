"""Fixed points of BJSM and MORSM by numpy, for the tests of morsm.rs: python3 morsm.py FOLDER > morsm.json

A long ARX model by lstsq, zeros before the record; u and y (or the model's output) filtered by its A; Steiglitz-McBride
by lstsq until theta rests to 1e-13. Standard errors from a gradient by central differences of B/F u filtered by that A. No
trend is removed. numpy 2, scipy 1.
"""
import json, sys
import numpy as np
from scipy.signal import lfilter

def case(folder, file, N, nb, nf, nk, m, method):
    lines = [line for line in open(f"{folder}/{file}") if not line.startswith("#")]
    d = np.genfromtxt(lines, delimiter=",", names=True)
    u, y = d["u"][:N], d["y"][:N]
    lag = lambda x, i: np.r_[np.zeros(i), x[:N - i]]
    Phi = np.column_stack([-lag(y, i) for i in range(1, m + 1)] + [lag(u, nk + i) for i in range(m)])
    long = np.linalg.lstsq(Phi, y, rcond=None)[0]
    A, B = np.r_[1, long[:m]], np.r_[np.zeros(nk), long[m:]]
    uf, yf = lfilter(A, [1], u), lfilter(A, [1], y) if method == "bjsm" else lfilter(B, [1], u)
    F, theta = np.array([1.0]), None
    for _ in range(5000):
        u_, y_ = lfilter([1], F, uf), lfilter([1], F, yf)
        Phi = np.column_stack([lag(u_, nk + i) for i in range(nb)] + [-lag(y_, i) for i in range(1, nf + 1)])
        new = np.linalg.lstsq(Phi, y_, rcond=None)[0]
        rest = theta is not None and abs(new - theta).max() < 1e-13
        theta, F = new, np.r_[1, new[nb:]]
        assert abs(np.roots(F)).max() < 1
        if rest:
            break
    assert rest
    output = lambda t, u: lfilter(np.r_[np.zeros(nk), t[:nb]], np.r_[1, t[nb:]], u)
    e = lfilter(A, [1], y - output(theta, u))
    step = 1e-5 * np.eye(nb + nf)
    psi = np.column_stack([(output(theta + s, uf) - output(theta - s, uf)) / 2e-5 for s in step])
    se = np.sqrt(np.diag(np.linalg.inv(psi.T @ psi)) * (e @ e) / (N - nb - nf))
    return dict(method=method, file=file, N=N, orders=f"nb={nb},nf={nf},nk={nk}", high_order=m, theta=theta.tolist(),
                se=se.tolist())

cases = [("sim_bj2.csv", 1500, 2, 2, 1, 12), ("sim_oe2.csv", 1000, 2, 2, 1, 8), ("epfl_laserbeam.csv", 500, 2, 2, 1, 10)]
print("[" + ",\n".join(json.dumps(case(sys.argv[1], *c, m)) for c in cases for m in ("bjsm", "morsm")) + "]")
