"""Poles of N4SID and CVA models of recorded data, straight from the definitions, for tests/recorded_data/methods.rs.

python3 subspace.py FILE N n s prints a JSON object. Projections are explicit (least squares), no QR of the Hankel
matrices: P = I - U_f' (U_f U_f')^-1 U_f; O is the part in W_p of the least-squares fit of Y_f by [W_p; U_f], W_p = [U_p; Y_p]
(Van Overschee and De Moor, Subspace Identification for Linear Systems, 1996, chapter 4 and table 4.1). u and y less their
means; A by least-squares shift invariance of the first n left singular vectors (of the weighted O, weight undone).
"""
import json, sys
import numpy as np

name, N, n, s = sys.argv[1], *map(int, sys.argv[2:5])
lines = [line for line in open(name) if not line.startswith("#")]
d = np.genfromtxt(lines, delimiter=",", names=True)
u, y = (d[k][:N] - d[k][:N].mean() for k in "uy")
j = N - 2 * s + 1
hankel = lambda x, first: np.array([x[first + i:first + i + j] for i in range(s)])
Up, Uf, Yp, Yf = hankel(u, 0), hankel(u, s), hankel(y, 0), hankel(y, s)
Wp = np.vstack([Up, Yp])
both = np.vstack([Wp, Uf])
O = np.linalg.lstsq(both.T, Yf.T, rcond=None)[0].T[:, :2 * s] @ Wp
apart = lambda x: x - (np.linalg.lstsq(Uf.T, x.T, rcond=None)[0].T @ Uf)
w, v = np.linalg.eigh(apart(Yf) @ apart(Yf).T)
root = v * np.sqrt(w) @ v.T
result = {}
for weights, weighted, undo in [("n4sid", O, np.eye(s)), ("moesp", apart(O), np.eye(s)),
                                ("cva", np.linalg.solve(root, apart(O)), root)]:
    G = undo @ np.linalg.svd(weighted, full_matrices=False)[0][:, :n]
    A = np.linalg.lstsq(G[:-1], G[1:], rcond=None)[0]
    poles = sorted(np.linalg.eigvals(A), key=lambda z: (abs(z), z.imag))
    result[weights] = [[p.real, p.imag] for p in poles]
print(json.dumps({"file": name.split("/")[-1], "N": N, "n": n, "block_rows": s, "poles": result}))
