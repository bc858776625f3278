"""Reference values of `family.rs`: estimators of GPEBO's theta in the paper's example, integrated in their own variables.

Plant x' = A x + B u, y = C'x + delta with A = [0 1; -9 0], B = (0, 1), C = (5, 0), u = 1, x(0) = (1, 2), xi(0) = 0,
delta = 0.3 sin t. Least squares is integrated as theta' = alpha F phi (z - phi'theta), F' = -alpha F phi phi'F,
F(0) = I / f0 (no closed form), mixed as det(I - f0 F) and adj(I - f0 F) theta (arXiv 2205.00099, Eqs. (8) to (12) without
forgetting). The finite-time estimate (IEEE TAC 66 (2021) 2265) is of the gradient on DREM with the lag 1 / (p + 1),
w' = -gamma Delta^2 w. By scipy's DOP853.

    python3 tests/gpebo/family.py      # made with NumPy 2.4.6, SciPy 1.17.1
"""

import numpy as np
from scipy.integrate import solve_ivp

A = np.array([[0.0, 1.0], [-9.0, 0.0]])
B = np.array([0.0, 1.0])
C = np.array([5.0, 0.0])
F0, ALPHA = 0.05, 2.0  # r / p0 = f0 / alpha
LS_GAINS = np.array([3.0, 0.5])
GAINS, SHARE = np.array([0.1, 0.02]), 0.5
TIMES = [0.5, 1.0, 2.0, 5.0, 20.0]


def adjugate(m):
    return np.array([[m[1, 1], -m[0, 1]], [-m[1, 0], m[0, 0]]])


def slope(t, s):
    x, xi, squares, mixed, gradient, w, filtered = np.split(s[:15], [2, 4, 6, 8, 10, 12])
    phi_matrix, f = s[15:19].reshape(2, 2), s[19:23].reshape(2, 2)
    z_filtered, phi_filtered = filtered[0], filtered[1:]
    y = C @ x + 0.3 * np.sin(t)
    z, phi = y - C @ xi, C @ phi_matrix
    h = np.eye(2) - F0 * f
    delta_ls = np.linalg.det(h)
    y_ls = adjugate(h) @ squares
    m = np.array([phi, phi_filtered])
    delta, mbar = np.linalg.det(m), adjugate(m) @ np.array([z, z_filtered])
    return np.concatenate(
        [
            A @ x + B,
            A @ xi + B,
            ALPHA * f @ phi * (z - phi @ squares),
            LS_GAINS * delta_ls * (y_ls - delta_ls * mixed),
            GAINS * delta * (mbar - delta * gradient),
            -GAINS * delta**2 * w,
            [z - z_filtered],
            phi - phi_filtered,
            (A @ phi_matrix).ravel(),
            (-ALPHA * f @ np.outer(phi, phi) @ f).ravel(),
        ]
    )


start = np.concatenate([[1, 2, 0, 0], np.zeros(6), [1, 1], np.zeros(3), np.eye(2).ravel(), np.eye(2).ravel() / F0])
run = solve_ivp(slope, (0, 20), start, "DOP853", t_eval=TIMES, rtol=1e-12, atol=1e-13, max_step=0.01)
for t, s in zip(run.t, run.y.T):
    finite = s[8:10] / np.maximum(1 - s[10:12], SHARE)
    print([t, *(float(f"{v:.10g}") for v in [*s[4:6], *s[6:8], *finite])])
