"""A worker that does something wrong, or only something odd, in a trial whose seed says so: argument 1 is of how many
seeds one does each, none where it is 0; argument 2, where given, a file in which the numbers of all processes are kept."""
import json, os, shutil, signal, struct, sys, time

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


def daemon(holds):
    """A process of a session of its own, whose parent is gone, with no surroundings; it keeps one of the pipes open."""
    end, start = os.pipe()
    if os.fork() == 0:
        os.setsid()
        child = os.fork()
        if child:
            os.write(start, str(child).encode())
            os._exit(0)
        for number in {0, 1, 2} - {holds}:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
        os.set_inheritable(holds, True)
        os.execve("/bin/sleep", ["sleep", "1000"], {})
    remember(int(os.read(end, 20)))
    os.wait()


def fill():
    """Fills the folder for temporary files where that is a small one, made for this."""
    place = os.environ.get("TMPDIR", "/tmp")
    size = os.statvfs(place)
    if size.f_blocks * size.f_frsize > 1 << 26:
        return
    try:
        with open(os.path.join(place, f"full-{os.getpid()}"), "wb") as file:
            while True:
                file.write(b"x" * 100_000)
    except OSError:
        pass


def later(seconds, what):
    """Something that a child writes to the replies after some time."""
    child = os.fork()
    if child == 0:
        time.sleep(seconds)
        os.write(replies.fileno(), what)
        os._exit(0)
    remember(child)


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
        what = seed % period if period else None
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
        elif what == 24:
            for byte in json.dumps(reply).encode():
                os.write(replies.fileno(), bytes([byte]))
                time.sleep(1)
        elif what == 25:
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGPIPE):
                signal.signal(number, signal.SIG_IGN)
            hang()
        elif what == 26:
            daemon(holds=1)
        elif what == 27:
            daemon(holds=replies.fileno())
        elif what == 28:
            os.execvp("sleep", ["sleep", "1000"])
        elif what == 29:
            after.append(lambda: send({**reply, "number": reply["number"] + 1}, body))
        elif what == 30:
            after.append(requests.close)
        elif what == 31:
            send({"frame": "ready", "protocol": 1, "name": "chaos", "version": "1", "returns": "polynomials",
                  "deterministic": True})
            hang()
        elif what == 32:
            after.append(lambda: [os.write(replies.fileno(), b"x" * 65536) for _ in range(10_000)])
        elif what == 33:
            status[i] = float("nan")
        elif what == 34:
            shutil.rmtree(os.path.dirname(os.environ["ASOBENCH_REPLIES"]), ignore_errors=True)
        elif what == 35:
            later(0.1, b"stray")
        elif what == 36:
            os.write(replies.fileno(), b'{"frame":"\xff"}\n')
            hang()
        elif what == 37:
            os.write(replies.fileno(), b'{"a":' + b"[" * 60_000 + b"\n")
            hang()
        elif what == 38:
            for number in range(3, 100):
                if number != replies.fileno():
                    try:
                        os.close(number)
                    except OSError:
                        pass
            hang()
        elif what == 39:
            fill()
    body = body or struct.pack(f"<{m}d", *status) + struct.pack(f"<{m}d", *[0.0] * m) + b"".join(
        struct.pack(f"<{2 * order}d", *row) for row in theta) + b"\n"
    send(reply, body)
    for act in after:
        act()
