"""Least squares as a method, by the decorator."""

import numpy as np

import asobench


@asobench.worker(version="1.0", single=True)
def least_squares(u, y, r, setting):
    na, nb, nk = setting["na"], setting["nb"], setting["nk"]
    if not np.isfinite(y).all():
        raise asobench.Declined
    k = np.arange(max(na, nb + nk - 1), len(y))[:, None]
    phi = np.hstack([-y[k - np.arange(1, na + 1)], u[k - nk - np.arange(nb)]])
    theta = np.linalg.lstsq(phi, y[k[:, 0]], rcond=None)[0]
    return {"A": theta[:na], "B": theta[na:], "nk": nk}


if __name__ == "__main__":
    least_squares.serve()
