"""Records of plants that are sampled fast, and the lowest minima of their prediction errors: minima.json.

numpy and scipy alone: python3 make.py > first.json; python3 recheck.py first.json > minima.json. y is stored in counts, as a converter has it, and u, a random
binary sequence, as + and -. Losses are mean squares of e = (A y - B/F u) D/C in counts, with zeros before the record.

A search is scipy's least_squares from the truth, from 11 points about it, from 4 far from it and from 8 with the true
gain and random real poles, in coordinates in which poles near 1 are harmless: polynomials in (1 - q^-1) / (1 - slowest pole). A case is kept if its lowest point is a
minimum, not at the boundary: zeros of C and F inside the unit circle, a scaled gradient below 1e-6.
"""

import json
import sys

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

rng = np.random.default_rng(58)


def sampled(num, den, ts):
    """The plant num/den under zero-order hold: B (with its leading 0) and F."""
    n = len(den) - 1
    den, num = np.array(den, float) / den[0], np.array(num, float) / den[0]
    a = np.zeros((n, n))
    a[:-1, 1:] = np.eye(n - 1)
    a[-1] = -den[:0:-1]
    b = np.zeros((n, 1))
    b[-1] = 1
    c = np.zeros(n)
    c[: len(num)] = num[::-1]
    whole = expm(np.block([[a, b], [np.zeros((1, n + 1))]]) * ts)
    f = np.real(np.poly(whole[:n, :n]))
    x, response = whole[:n, n], [0.0]
    for _ in range(n):
        response.append(c @ x)
        x = whole[:n, :n] @ x
    return np.convolve(f, response)[: n + 1], f


def plant():
    """A random plant whose slowest pole lies between 0.99 and 0.99999."""
    slow = 10 ** rng.uniform(-5, -2)
    kind = rng.integers(5)
    if kind == 0:
        den = [1, 1]
    elif kind == 1:
        den = np.poly([-1, -rng.uniform(1.5, 30)])
    elif kind == 2:
        damping = rng.uniform(0.05, 0.9)
        den = [1, 2 * damping, 1]
        slow /= damping
    elif kind == 3:
        den = np.poly([-1, -rng.uniform(1.5, 5), -rng.uniform(6, 30)])
    else:
        den = np.convolve([1, 1], [1, 2 * 0.2 * 8, 64])
    num = np.array([1.0])
    if kind != 0 and rng.random() < 0.4:
        num = np.array([rng.uniform(0.1, 3) * rng.choice([-1, 1]), 1])
    ts = -np.log(1 - slow)
    return sampled(num, den, ts), f"kind {kind}, 1 - |pole| = {slow:.2e}"


SUITE = [
    ("P08 of the suite", ([0, -0.0010506646973587053, -0.003086271238086802, 0.0031264933379064885,
                           0.0010259961935277229],
                          [1, -3.911361242916607, 5.774371922334963, -3.8142245503230807, 0.9512294245007125])),
    ("P12 of the suite", ([0, 0.18220261945331417, -0.17859530116723954], [1, -1.80878058682715, 0.8105842459701871])),
    ("P09 of the suite at 1 ms", sampled([2], [1, 4, 3], 1e-3)),
]


def record(noise, which):
    (name, (b, f)) = SUITE[which] if which < len(SUITE) else plant()[::-1]
    b, f = np.array(b, float), np.array(f, float)
    slowest = 1 - max(abs(np.roots(f)))
    n = int(rng.choice([400, 600, 800])) if slowest > 1e-3 else 1000
    hold = int(rng.integers(1, 40))
    u = np.repeat(rng.choice([-1.0, 1.0], n // hold + 1), hold)[:n]
    clean = lfilter(b, f, u)
    c, d = np.array([1.0]), np.array([1.0])
    if noise == "armax":
        c, d = np.array([1, rng.uniform(-0.9, 0.5)]), f
    elif noise == "bj":
        c, d = np.array([1, rng.uniform(-0.6, 0.6)]), np.array([1, rng.uniform(-0.95, 0.3)])
    v = lfilter(c, d, rng.standard_normal(n))
    share = 10 ** rng.uniform(-2, -0.7)
    v *= share * clean.std() / v.std()
    y = clean + v
    unit = 2000 / abs(y).max()
    counts = np.round(y * unit)
    return name, u, counts, (b * unit, f, c, d)


class Model:
    """e and its derivatives for a structure; theta is in powers of (1 - q^-1)/step, scaled."""

    def __init__(self, estimator, orders, u, y, step):
        self.o, self.u, self.y, self.step = orders, u, y, step
        self.estimator = estimator
        self.names = [name for name in ("na", "nb", "nc", "nd", "nf") if orders.get(name, 0)]

    def basis(self, name):
        """Rows: coefficients of q^-1 ... q^-n for a unit of each coordinate; and those of the monic part."""
        n = self.o[name]
        step = self.step if name in ("na", "nb", "nf") else 1.0
        difference = lambda k: np.array([1.0]) if k == 0 else np.convolve(difference(k - 1), [1, -1])
        if name == "nb":
            rows = [difference(n - 1 - i) * step ** (i + 1) for i in range(n)]
            return np.array([np.pad(r, (0, n - len(r))) for r in rows]), np.zeros(n)
        if name in ("nc", "nd"):
            return np.eye(n), np.zeros(n)
        rows = [np.convolve(difference(n - 1 - i), [0, 1])[1:] * step ** (i + 1) for i in range(n)]
        return np.array([np.pad(r, (0, n - len(r))) for r in rows]), difference(n)[1:]

    def parts(self, theta):
        found = {"na": [1.0], "nb": [0.0], "nc": [1.0], "nd": [1.0], "nf": [1.0]}
        at = 0
        for name in self.names:
            n = self.o[name]
            matrix, monic = self.basis(name)
            own = theta[at : at + n] @ matrix + monic
            found[name] = np.concatenate([[0.0 if name == "nb" else 1.0], own])
            at += n
        return found

    def inverse(self, polynomials):
        theta = []
        for name in self.names:
            matrix, monic = self.basis(name)
            own = np.zeros(self.o[name])
            given = np.array(polynomials[name])[1 : 1 + self.o[name]]
            own[: len(given)] = given
            theta.append(np.linalg.solve(matrix.T, own - monic))
        return np.concatenate(theta)

    def stable(self, p):
        return all(max(abs(np.roots(p[name])), default=0) < 1 for name in ("nc", "nf"))

    def residuals(self, theta):
        p = self.parts(theta)
        if not self.stable(p):
            return np.full(len(self.y), 1e3 * self.y.std())
        w = lfilter(p["nb"], p["nf"], self.u)
        return lfilter(p["nd"], p["nc"], lfilter(p["na"], [1.0], self.y) - w)

    def jacobian(self, theta):
        p = self.parts(theta)
        w = lfilter(p["nb"], p["nf"], self.u)
        inner = lfilter(p["na"], [1.0], self.y) - w
        e = lfilter(p["nd"], p["nc"], inner)
        dc = lambda x: lfilter(p["nd"], p["nc"], x)
        of = {"na": dc(self.y), "nb": -dc(lfilter([1.0], p["nf"], self.u)), "nc": -lfilter([1.0], p["nc"], e),
              "nd": lfilter([1.0], p["nc"], inner), "nf": dc(lfilter([1.0], p["nf"], w))}
        columns = []
        for name in self.names:
            lagged = [np.concatenate([np.zeros(i), of[name][:-i]]) for i in range(1, self.o[name] + 1)]
            columns.extend(self.basis(name)[0] @ np.array(lagged))
        return np.array(columns).T

    def search(self, theta):
        if not self.stable(self.parts(theta)):
            return None
        try:
            found = least_squares(self.residuals, theta, self.jacobian, method="trf", x_scale="jac", ftol=1e-15,
                                  xtol=1e-15, gtol=1e-15, max_nfev=400)
        except (ValueError, np.linalg.LinAlgError):
            return None
        jacobian = self.jacobian(found.x)
        scales = np.linalg.norm(jacobian, axis=0)
        gradient = abs(jacobian.T @ found.fun) / scales / np.linalg.norm(found.fun)
        return np.mean(found.fun**2), gradient.max(), found.x


def minimum(estimator, orders, u, y, truth):
    b, f, c, d = truth
    step = 1 - max(abs(np.roots(f)))
    model = Model(estimator, orders, u, y, max(step, 1e-6))
    own = {"nb": b, "nf": f, "na": f, "nc": c if orders.get("nc") else [1.0], "nd": d if len(d) == 2 else [1.0]}
    start = model.inverse(own)
    starts = [start]
    for i in range(11):
        starts.append(start * (1 + rng.normal(0, [0.02, 0.1, 0.3][i % 3], len(start))))
    for factor in (3, 10):
        for sign in (1, -1):
            far = start.copy()
            far *= np.where(np.arange(len(far)) % 2 == 0, factor, 1 / factor)
            far[orders.get("na", 0) : orders.get("na", 0) + orders["nb"]] *= sign
            starts.append(far)
    for _ in range(8):
        slow = np.poly(1 - 10 ** rng.uniform(-4, -0.3, len(f) - 1))
        gain = [0.0, sum(b) / sum(f) * sum(slow)]
        starts.append(model.inverse({**own, "nb": gain, "nf": slow, "na": slow}))
    found = [model.search(start) for start in starts]
    found = sorted((of for of in found if of is not None), key=lambda of: of[0])
    if not found:
        return None
    loss, gradient, theta = found[0]
    p = model.parts(theta)
    largest = max(max(abs(np.roots(p[name])), default=0) for name in ("nc", "nf"))
    others = len({f"{of[0]:.6e}" for of in found if of[1] < 1e-6})
    return loss, gradient < 1e-6 and largest < 1 - 1e-7, largest, others


def orders_of(noise, n):
    if noise == "armax":
        return [("armax", dict(na=n, nb=n, nc=1)), ("oe", dict(nb=n, nf=n))]
    if noise == "bj":
        return [("bj", dict(nb=n, nc=1, nd=1, nf=n)), ("oe", dict(nb=n, nf=n))]
    return [("oe", dict(nb=n, nf=n)), ("bj", dict(nb=n, nc=0, nd=1, nf=n))]



def main():
    records, dropped, most = [], 0, 25
    for noise in ("oe", "armax", "bj"):
        count = which = 0
        while count < most:
            name, u, y, truth = record(noise, which)
            which += 1
            cases = []
            for estimator, orders in orders_of(noise, len(truth[1]) - 1):
                found = minimum(estimator, orders, u, y, truth)
                if found is None or not found[1]:
                    dropped += 1
                    continue
                cases.append({"estimator": estimator, "orders": orders, "best": float(found[0])})
                print(noise, count, name, estimator, f"{found[0]:.6g} largest {found[2]:.7f} minima {found[3]}",
                      file=sys.stderr, flush=True)
            if cases:
                count += 1
                records.append({"plant": name, "noise": noise, "u": "".join("+" if x > 0 else "-" for x in u),
                                "y": [int(value) for value in y], "cases": cases})
    print("kept", sum(len(of["cases"]) for of in records), "dropped", dropped, file=sys.stderr)
    print("[" + ",\n".join(json.dumps(of, separators=(",", ":")) for of in records) + "]")


if __name__ == "__main__":
    main()
