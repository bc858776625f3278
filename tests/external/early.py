"""A worker whose models are its trials' seeds; with an argument it answers the next message before it has read it: a child
sends the reply a moment after the next message was sent, with wrong models and the number that counting would give."""
import json, os, struct, sys, time

requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")


def frame(number, models):
    header = {"frame": "reply", "number": number, "trials": len(models), "na": order, "nb": order,
              "bytes": 8 * len(models) * (2 + 2 * order)}
    blocks = [0.0] * (2 * len(models)) + [value for model in models for value in [model] * (2 * order)]
    return json.dumps(header).encode() + b"\n" + struct.pack(f"<{len(blocks)}d", *blocks) + b"\n"


while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        order = head["order"]
        replies.write(b'{"frame":"ready","protocol":1,"name":"early","version":"1","returns":"polynomials",'
                      b'"deterministic":true}\n')
        replies.flush()
        continue
    m = head["trials"]
    numbers = struct.unpack(f"<{m * (2 + 3 * head['samples'])}d", requests.read(head["bytes"]))
    replies.write(frame(head["number"], [seed / 2.0**53 - 0.5 for seed in numbers[m:2 * m]]))
    replies.flush()
    if len(sys.argv) > 1:
        if os.fork() == 0:
            time.sleep(0.1)
            os.write(replies.fileno(), frame(head["number"] + 1, [0.25] * m))
            os._exit(0)
        time.sleep(0.3)
