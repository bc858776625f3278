"""Least squares of examples/workers/least_squares.py, its model as matrices in other coordinates."""
import json, os, struct, sys

source = open(os.path.join(os.path.dirname(__file__), "../../examples/workers/least_squares.py")).read()
scope = {}
exec(source[source.index("def least_squares"):source.index("while line")], scope)
requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")


def matrices(theta, n):
    """Controllability coordinates, the states doubled."""
    alpha, beta = theta[:n], theta[n:]
    a = [[-x for x in alpha]] + [[float(i == j) for j in range(n)] for i in range(n - 1)]
    b = [2.0] + [0.0] * (n - 1)
    c = [x / 2 for x in beta]
    return sum(a, []), b, c, [0.0], [float("nan")] * n


while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        n = head["order"]
        head = {"frame": "ready", "protocol": 1, "name": "matrices", "version": "1", "returns": "matrices",
                "deterministic": True}
        replies.write(json.dumps(head).encode() + b"\n")
    else:
        m, samples = head["trials"], head["samples"]
        numbers = struct.unpack(f"<{m * (2 + 3 * samples)}d", requests.read(head["bytes"]))
        signal = lambda which, i: numbers[2 * m + (which * m + i) * samples:][:samples]
        models = [matrices(scope["least_squares"](signal(0, i), signal(1, i), n, n, 1)[1], n) for i in range(m)]
        blocks = [0.0] * 2 * m + [x for part in range(5) for model in models for x in model[part]]
        reply = {"frame": "reply", "number": head["number"], "trials": m, "order": n, "bytes": 8 * len(blocks)}
        replies.write(json.dumps(reply).encode() + b"\n" + struct.pack(f"<{len(blocks)}d", *blocks) + b"\n")
    replies.flush()
