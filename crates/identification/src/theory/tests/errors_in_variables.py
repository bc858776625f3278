"""The information of a record whose input is measured with noise, in time: `1/2 tr(S^-1 S_i S^-1 S_j)` with S the covariance
of all samples of (u, y) and S_i its central differences. The information of N samples more is the difference of two records.

    python3 crates/identification/src/theory/tests/errors_in_variables.py
"""

import numpy as np


def covariance(alpha, beta, variances, count):
    """Of u = r + w and y = B/A r + e, with r, w and e white."""
    s_r, s_w, s_e = variances
    impulse = np.zeros(4000)
    for k in range(len(impulse)):
        impulse[k] = beta[k - 1] if 1 <= k <= len(beta) else 0.0
        impulse[k] -= sum(a * impulse[k - 1 - i] for i, a in enumerate(alpha) if k - 1 - i >= 0)
    lags = np.array([impulse[: len(impulse) - t] @ impulse[t:] for t in range(count)])
    t = np.arange(count)
    apart = t[:, None] - t[None, :]
    yy = s_r * lags[abs(apart)] + s_e * np.eye(count)
    yu = s_r * np.where(apart >= 0, impulse[abs(apart)], 0.0)
    uu = (s_r + s_w) * np.eye(count)
    return np.block([[uu, yu.T], [yu, yy]])


def information(alpha, beta, variances, count):
    parameters = np.array([*alpha, *beta, *variances])
    n = len(alpha)

    def of(p):
        return covariance(p[:n], p[n : 2 * n], p[2 * n :], count)

    inverse = np.linalg.inv(of(parameters))
    slopes = []
    for i in range(len(parameters)):
        step = np.zeros(len(parameters))
        step[i] = 1e-5
        slopes.append(inverse @ (of(parameters + step) - of(parameters - step)) / 2e-5)
    return np.array([[0.5 * np.sum(x * y.T) for y in slopes] for x in slopes])


def main():
    # Order 2, and the lag of ControlSystemIdentification.jl, each with the variances of r, w and e.
    cases = [
        ([-1.5, 0.7], [1.0, 0.5], (1.0, 0.1, 1.0)),
        ([-0.9], [0.8], (1.0, 0.25, 1.0)),
    ]
    for alpha, beta, variances in cases:
        more = information(alpha, beta, variances, 400) - information(alpha, beta, variances, 300)
        each = more / 100
        p = 2 * len(alpha)
        schur = each[:p, :p] - each[:p, p:] @ np.linalg.solve(each[p:, p:], each[p:, :p])
        print(np.array2string(schur.ravel(), precision=9, separator=", ", max_line_width=100))


main()
