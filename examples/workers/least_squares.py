"""A worker in Python without any package: least squares of A(q) y = B(q) u + e by Householder reflections."""
import json, os, struct

requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")

def least_squares(u, y, na, nb, nk):
    first = max(na, nb + nk - 1)
    rows = [[-y[k - i] for i in range(1, na + 1)] + [u[k - nk - i] for i in range(nb)] + [y[k]]
            for k in range(first, len(y))]
    columns = [list(column) for column in zip(*rows)]
    p = na + nb
    size = max(abs(x) for column in columns for x in column)
    for j in range(p):
        v = columns[j][j:]
        v[0] += (1 if v[0] >= 0 else -1) * sum(x * x for x in v) ** 0.5
        square = sum(x * x for x in v)
        if not square > (1e-13 * size) ** 2:
            return 2.0, [0.0] * p
        for column in columns[j:]:
            scale = 2 * sum(x * c for x, c in zip(v, column[j:])) / square
            column[j:] = [c - scale * x for x, c in zip(v, column[j:])]
    theta = [0.0] * p
    for i in reversed(range(p)):
        theta[i] = (columns[p][i] - sum(columns[j][i] * theta[j] for j in range(i + 1, p))) / columns[i][i]
    return 0.0, theta

while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        hello = head
        ready = {"frame": "ready", "protocol": 1, "name": "least squares in Python", "version": "1.0",
                 "returns": "polynomials", "deterministic": True}
        replies.write(json.dumps(ready).encode() + b"\n")
    else:
        m, n = head["trials"], head["samples"]
        numbers = struct.unpack(f"<{m * (2 + 3 * n)}d", requests.read(head["bytes"]))
        signal = lambda which, i: numbers[2 * m + (which * m + i) * n:][:n]
        na, nb, nk = hello["na"], hello["nb"], hello["nk"]
        found = [least_squares(signal(0, i), signal(1, i), na, nb, nk) for i in range(m)]
        blocks = [status for status, _ in found] + [float("nan")] * m + [x for _, theta in found for x in theta]
        reply = {"frame": "reply", "number": head["number"], "trials": m, "na": na, "nb": nb, "nk": nk,
                 "reasons": ["no full rank"], "bytes": 8 * len(blocks)}
        replies.write(json.dumps(reply).encode() + b"\n" + struct.pack(f"<{len(blocks)}d", *blocks) + b"\n")
    replies.flush()
