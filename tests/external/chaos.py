"""A worker that does something wrong, or only something odd, in a trial whose seed says so: argument 1 is of how many
seeds one does each; argument 2, where given, a file in which the numbers of all processes are kept."""
import json, os, signal, struct, sys, time

requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")
period = int(sys.argv[1])


def remember(number):
    if len(sys.argv) > 2:
        with open(sys.argv[2], "a") as file:
            file.write(f"{number}\n")


def send(header, body=b""):
    replies.write(json.dumps(header).encode() + b"\n" + body)
    replies.flush()


def fork(leave):
    child = os.fork()
    if child == 0:
        if leave:
            os.setsid()
        time.sleep(1000)
        os._exit(0)
    remember(child)


def hang():
    time.sleep(1000)


remember(os.getpid())
while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        order = head["order"]
        send({"frame": "ready", "protocol": 1, "name": "chaos", "version": "1", "returns": "polynomials",
              "deterministic": True})
        continue
    m, n = head["trials"], head["samples"]
    numbers = struct.unpack(f"<{m * (2 + 3 * n)}d", requests.read(head["bytes"]))
    seeds = [int(seed) for seed in numbers[m:2 * m]]
    status = [0.0] * m
    theta = [[seed / 2.0**53 - 0.5] * (2 * order) for seed in seeds]
    after = []
    reply = {"frame": "reply", "number": head["number"], "trials": m, "na": order, "nb": order,
             "bytes": 8 * m * (2 + 2 * order), "reasons": ["no minimum", "no luck: <b>"]}
    body = None
    for i, seed in enumerate(seeds):
        what = seed % period
        if what == 0:
            print("{\"frame\":\"reply\"}" * 100)
        elif what == 1:
            hang()
        elif what == 2:
            os._exit(3)
        elif what == 3:
            fork(leave=False)
        elif what == 4:
            send(reply, struct.pack("<d", 0.0))
            os._exit(0)
        elif what == 5:
            replies.write(b'{"frame":"re')
            replies.flush()
            hang()
        elif what == 6:
            theta[i][0] = float("nan")
        elif what == 7:
            reply["trials"] += 1
        elif what == 8:
            replies.write(b"{" + b" " * 10_000_000)
            replies.flush()
            hang()
        elif what == 9:
            for _ in range(50):
                os.write(2, b"x" * 1_000_000)
        elif what == 10:
            status[i] = 1.0
        elif what == 11:
            status[i] = 3.0
        elif what == 12:
            fork(leave=True)
        elif what == 13:
            body = b"\x00" * (reply["bytes"] + 8) + b"\n"
        elif what == 14:
            after.append(lambda: send(reply, body))
        elif what == 15:
            os.kill(os.getpid(), signal.SIGSTOP)
        elif what == 16:
            os.killpg(0, signal.SIGKILL)
        elif what == 17:
            replies.close()
            hang()
        elif what == 18:
            after.append(lambda: os._exit(1))
        elif what == 19:
            after.append(hang)
        elif what == 20:
            status[i] = 4.0
        elif what == 21:
            reply["bytes"] = 8 * 10**12
        elif what == 22:
            reply = {"frame": "reply", "number": head["number"], "trials": m, "na": 10**9, "bytes": 0}
        elif what == 23:
            send(["reply"])
            hang()
    body = body or struct.pack(f"<{m}d", *status) + struct.pack(f"<{m}d", *[0.0] * m) + b"".join(
        struct.pack(f"<{2 * order}d", *row) for row in theta) + b"\n"
    send(reply, body)
    for act in after:
        act()
