#!/usr/bin/env python3
"""What a method that is a program costs beside the same loop alone: a table by the records in a message.

    cargo build --release
    benches/peers/worker_overhead.py

Columns of microseconds for each trial of W98's least squares, in turn in every round, medians of the rounds:

- script: what one would write without asobench (numpy_batched.py without its instrumental variables): so many records at a
  time drawn, estimated by least squares, and scored with the dead-beat observer over 400 samples;
- loop: `least_squares` of examples/workers/least_squares_numpy.py alone, on arrays that are there;
- worker: `asobench run --threads 1` with that worker: drawing records, sending, estimating, scoring, storing;
- empty: the same with a worker that answers at once, always the same model.

Of a run the time is that of 3 M trials less that of M, over 2 M: what starts once is not in it. `ratio` and `to loop` are the
medians over the rounds of worker / script and worker / loop. The columns `CPU` are processor time, of all processes together, which other load of the
machine hardly changes. `script` and `loop` run in a process of their own for each number. Needs NumPy.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402 (reads the variables above)
import numpy_batched  # noqa: E402 (the same)

ROOT = Path(__file__).resolve().parents[2]
WORKER = ROOT / "examples/workers/least_squares_numpy.py"
ORDER, SAMPLES = 6, 98
BATCHES = (1, 16, 64, 256, 1024)

EMPTY = """
import os, json
requests = open(os.environ["ASOBENCH_REQUESTS"], "rb")
replies = open(os.environ["ASOBENCH_REPLIES"], "wb")
ready = {"frame": "ready", "protocol": 1, "name": "empty", "version": "1", "returns": "polynomials", "deterministic": True}
while line := requests.readline():
    head = json.loads(line)
    if head["frame"] == "hello":
        p = head["na"] + head["nb"]
        replies.write(json.dumps(ready).encode() + b"\\n")
    else:
        m = head["trials"]
        requests.read(head["bytes"])
        reply = {"frame": "reply", "number": head["number"], "trials": m, "na": p // 2, "nb": p // 2,
                 "bytes": 8 * m * (2 + p)}
        replies.write(json.dumps(reply).encode() + b"\\n" + bytes(reply["bytes"]) + b"\\n")
    replies.flush()
"""

STUDY = """
measures = ["e_a", "e_b", "e_x_max"]
[settings]
window = {samples}
eta = 10.018
horizon = 400
[[methods]]
name = "worker"
batch = {batch}
command = {command}
"""


def clocks():
    """Wall time, and processor time of this process and of all that it waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return np.array([time.perf_counter(), sum(of.ru_utime + of.ru_stime for of in used)])


def loop(batch, trials):
    """Seconds of a trial by the loop alone."""
    estimate = least_squares()
    random = np.random.default_rng(1)
    u = random.choice([-10.0, 10.0], (trials, SAMPLES))
    y = random.standard_normal((trials, SAMPLES))
    estimate(u[:batch], y[:batch])
    begin = clocks()
    for first in range(0, trials, batch):
        estimate(u[first : first + batch], y[first : first + batch])
    return (clocks() - begin) / trials


def alone(what, batch, trials):
    """A function of this file in a new process, whose memory no other measurement has shaped."""
    command = [sys.executable, __file__, "--alone", what, str(batch), str(trials)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return np.array([float(word) for word in done.stdout.split()])


def script(batch, trials):
    """Seconds of a trial by a script that draws and scores too."""
    numpy_batched.PASSES = 0
    numpy_batched.batch_of_trials(0, batch, "stationary")
    begin = clocks()
    for first in range(0, trials, batch):
        numpy_batched.batch_of_trials(first, batch, "stationary")
    return (clocks() - begin) / trials


def run(program, folder, worker, batch, trials):
    """Seconds of a trial by `asobench run`."""
    study = folder / "study.toml"
    study.write_text(STUDY.format(samples=SAMPLES, batch=batch, command=[sys.executable, str(worker)]))

    def seconds(count):
        out = tempfile.mkdtemp(dir=folder)
        command = [program, "run", str(study), "--allow-commands", "--threads", "1", "--trials", str(count), "--out", out]
        begin = clocks()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"asobench failed: {done.stderr.strip()}")
        return clocks() - begin

    return (seconds(3 * trials) - seconds(trials)) / (2 * trials)


def least_squares():
    """The worker's function, without the worker."""
    source = WORKER.read_text()
    scope = {"np": np, "hello": {"na": ORDER, "nb": ORDER, "nk": 1}}
    exec(source[source.index("def least_squares") : source.index("while line")], scope)  # noqa: S102 (our own file)
    return scope["least_squares"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--asobench", default=str(ROOT / "target/release/asobench"), help="the program")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trials", type=int, default=16384, help="M, a multiple of 1024; fewer where messages are short")
    parser.add_argument("--alone", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.alone:
        what, batch, trials = given.alone
        print(*{"script": script, "loop": loop}[what](int(batch), int(trials)))
        return
    if given.trials < 1024 or given.trials % 1024 or given.rounds < 1:
        parser.error("--trials: expected a multiple of 1024; --rounds: at least 1")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        empty = folder / "empty.py"
        empty.write_text(EMPTY)
        found = {batch: [] for batch in BATCHES}
        loads = []
        for _ in range(given.rounds):
            for batch in BATCHES:
                loads.append(os.getloadavg()[0])
                trials = min(given.trials, 2048 * batch)
                found[batch].append([
                    alone("script", batch, min(trials, 64 * batch)),
                    alone("loop", batch, trials),
                    run(given.asobench, folder, WORKER, batch, trials),
                    run(given.asobench, folder, empty, batch, trials),
                ])
    print(f"W98 least squares, µs for each trial, medians of {given.rounds} rounds; load {min(loads):.1f} to {max(loads):.1f}\n")
    names = ("script", "loop", "worker", "empty")
    print("| batch | " + " | ".join(f"{name}{clock}" for clock in ("", " CPU") for name in (*names, "ratio", "to loop")) + " |")
    print("|" + "--:|" * 13)
    for batch, rounds in found.items():
        cells = []
        for clock in range(2):
            times = {name: [1e6 * of[i][clock] for of in rounds] for i, name in enumerate(names)}
            cells += [f"{statistics.median(times[name]):.0f}" for name in names]
            for other in ("script", "loop"):
                ratio = statistics.median(a / b for a, b in zip(times["worker"], times[other]))
                cells.append(f"{ratio:.2f}")
        print(f"| {batch} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
