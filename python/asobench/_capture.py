"""A worker that keeps the records of a cell; its arguments are a file and the cell's number."""

import sys

import numpy as np

from ._worker import worker

seen = 0


@worker(name="records", version="1", deterministic=True)
def capture(u, y, r, setting):
    # One batch of each cell, in their order.
    global seen
    if seen == int(sys.argv[2]):
        np.save(sys.argv[1], np.stack([u, y, r]))
    seen += 1
    return {"A": np.zeros((len(u), setting["na"])), "B": np.zeros((len(u), setting["nb"]))}


capture.serve()
