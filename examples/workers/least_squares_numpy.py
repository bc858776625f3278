"""A worker in Python with NumPy: least squares of A(q) y = B(q) u + e, all records of a message at once."""
import json, os
import numpy as np

requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")

def answer(header, blocks=None):
    replies.write(json.dumps(header).encode() + b"\n")
    if blocks is not None:
        replies.write(b"".join(block.tobytes() for block in blocks) + b"\n")
    replies.flush()

def least_squares(u, y):
    na, nb, nk = hello["na"], hello["nb"], hello["nk"]
    first = max(na, nb + nk - 1)
    columns = [-y[:, first - i:-i] for i in range(1, na + 1)]
    columns += [u[:, first - nk - i:u.shape[1] - nk - i] for i in range(nb)]
    phi = np.stack(columns, axis=2)
    q, r = np.linalg.qr(phi)
    diagonal = np.abs(np.diagonal(r, axis1=1, axis2=2))
    full = diagonal.min(1) > 1e-13 * diagonal.max(1)
    r[~full] = np.eye(na + nb)
    return np.where(full, 0.0, 2.0), np.linalg.solve(r, np.swapaxes(q, 1, 2) @ y[:, first:, None])[:, :, 0]

while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        hello = head
        answer({"frame": "ready", "protocol": 1, "name": "least squares in NumPy", "version": "1.0",
                "returns": "polynomials", "deterministic": True})
        continue
    m, n = head["trials"], head["samples"]
    numbers = np.frombuffer(requests.read(head["bytes"]), dtype="<f8")
    u, y, r = numbers[2 * m:].reshape(3, m, n)
    status, theta = least_squares(u, y)
    blocks = [status, np.full(m, np.nan), theta]
    answer({"frame": "reply", "number": head["number"], "trials": m, "na": hello["na"], "nb": hello["nb"],
            "nk": hello["nk"], "reasons": ["no full rank"], "bytes": sum(block.nbytes for block in blocks)}, blocks)
