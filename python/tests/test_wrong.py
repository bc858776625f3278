"""Wrong uses: each has one clear line."""

import functools
import itertools
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

import numpy as np

import asobench as ab

U = np.sign(np.sin(np.arange(60.0) ** 2))
Y = ab.Model(A=[1, -1.2, 0.5], B=[1, 0.3], nk=1).simulate(U) + 0.1 * np.cos(np.arange(60.0) ** 2)


def arx(u=U, y=Y, **options):
    return ab.estimate(u, y, "arx", **(options or {"na": 2, "nb": 2}))


def spoilt(value, dtype=float):
    other = Y.astype(dtype)
    other[17] = value
    return other


CASES = [
    (lambda: arx(U[:, None]), ValueError, "u: shape (60, 1); expected one dimension; one column is such as x[:, 0]"),
    (lambda: arx(U[None]), ValueError, "u: shape (1, 60); expected one dimension; one row is such as x[0]"),
    (lambda: arx(U[:50]), ValueError, "u has 50 samples and y has 60; expected equal lengths"),
    (lambda: arx(y=spoilt(np.nan)), ValueError, "y: sample 17 is NaN; expected finite numbers"),
    (lambda: arx(y=spoilt(np.inf)), ValueError, "y: sample 17 is inf; expected finite numbers"),
    (lambda: arx(y=Y + 0j), TypeError, "y: complex numbers; expected an array of real numbers"),
    (lambda: arx("1, 2, 3"), TypeError, "u: str; expected an array of real numbers"),
    (lambda: arx(["1"] * 60), TypeError, "u: strings; expected an array of real numbers"),
    (lambda: arx(None), TypeError, "u: None; expected an array of real numbers"),
    (lambda: arx(x for x in U), TypeError, "u: generator; expected an array of real numbers, such as list(u)"),
    (lambda: arx([[1.0], [1.0, 2.0]]), ValueError, "u, y: several records; expected two lists of as many arrays"),
    (lambda: arx([None] * 60), TypeError, "u: objects; expected an array of real numbers"),
    (lambda: arx(np.ma.masked_less(U, 0)), ValueError, "masked samples; expected all samples"),
    (lambda: arx(U.astype("M8[s]")), TypeError, "u: datetime64[s]; expected an array of real numbers"),
    (lambda: arx(y=spoilt(np.longdouble("1e4000"), np.longdouble)), ValueError, "y: sample 17 is inf"),
    (lambda: arx([], []), ValueError, "window of 0 samples is too short"),
    (lambda: arx(0 * U), ab.EstimateFailed, "arx: singular"),
    (lambda: arx(na=40, nb=40), ValueError, "arx: a window of 60 samples is too short for orders na=40,nb=40,nk=1"),
    (lambda: arx(na=2000, nb=1), ValueError, "'na' must be a whole number from 0 to 1000"),
    (lambda: arx(na=2.0, nb=2), TypeError, "na: 2.0; expected a whole number"),
    (lambda: arx(na=-1, nb=2), ValueError, "na: -1; expected a whole number of at least 0"),
    (lambda: arx(na=True, nb=2), TypeError, "na: True; expected a whole number"),
    (lambda: arx(na=2, nb=2, nc=1), ValueError, "expected na, nb, nk"),
    (lambda: arx(na=2, nb=2, order=2), TypeError, "expected one of the three ways"),
    (lambda: arx(row="complete", na=2, nb=2), TypeError, "arx: unknown option 'row'; did you mean rows? arx takes"),
    (lambda: arx(rows="all", na=2, nb=2), ValueError, "unknown choice of rows 'all'"),
    (lambda: arx(orders=[2, 2, 1]), TypeError, "orders: [2, 2, 1]; expected text such as 'na=2,nb=2,nk=1'"),
    (lambda: ab.estimate(U, Y, "arx"), TypeError, "arx: expected orders such as na=2, nb=2, nk=1"),
    (lambda: ab.estimate(U, Y, "ls", na=2, nb=3), TypeError, "ls: expected order=n"),
    (lambda: ab.estimate(U, Y, "oee", order=2), ValueError, "unknown estimator 'oee'; did you mean 'oe'?"),
    (lambda: ab.estimate(U, Y, "ARX", na=2, nb=2), ValueError, "did you mean 'arx'?"),
    (lambda: ab.estimate(U, Y, "kalman", order=2), ValueError, "unknown estimator 'kalman'"),
    (lambda: arx().bse, AttributeError, "Model has no attribute 'bse'; here it is se"),
    (lambda: ab.method(type("Solver", (), {})), TypeError, "expected a function"),
    (lambda: ab.Results("/nowhere").rows(), FileNotFoundError, "/nowhere: no results"),
    (lambda: ab.estimate(U, Y, "known", order=2), ValueError, "a record has no known plant"),
    (lambda: ab.estimate(U, Y, 3, order=2), TypeError, "estimator: 3; expected a name"),
    (lambda: ab.estimators.kalman, AttributeError, "no estimator 'kalman'; expected one of iv, ls, arx"),
    (lambda: ab.Model(A=[-1.5, 0.7], B=[1], nk=1), ValueError, "A: begins with -1.5; expected [1, a_1, ...]"),
    (lambda: ab.Model(B=[0, 1.0], nk=1), ValueError, "B: begins with zero beside nk = 1"),
    (lambda: ab.Model(B=[1.0], cov=np.eye(2)), ValueError, "cov: shape (2, 2); expected (1, 1)"),
    (lambda: arx().predict(U, Y, 0), ValueError, "k: 0; expected a whole number of at least 1"),
    (lambda: arx().step_response(10**12), ValueError, "samples: 1000000000000; expected a whole number of at most"),
    (lambda: arx().step_response(10**30), ValueError, "expected a whole number of at most"),
    (lambda: arx().equation(10**6), ValueError, "digits: 1000000; expected a whole number of at most 100"),
    (lambda: ab.Model(B=[1.0], nk=10**12), ValueError, "nk: 1000000000000; expected a whole number of at most 10000"),
    (lambda: ab.Model(B=np.ones(10**6)), ValueError, "B: 1000000 coefficients; expected at most 10000"),
    (lambda: ab.Model(A=np.eye(1, 10**6)[0], B=[1]), ValueError, "A: 1000000 coefficients; expected at most 10000"),
    (lambda: ab.orders(U, Y, range(1, 10**12)), ValueError, "n, nk: more than 10000 models"),
    (lambda: ab.orders(U, Y, 2, itertools.count()), ValueError, "n, nk: more than 10000 models"),
    (lambda: ab.orders(U, Y, 10**30), ValueError, "expected a whole number of at most"),
    (lambda: ab.Study(settings={"eta": range(10**12)}).to_toml(), ValueError, "settings.eta: more than 1000000 values"),
    (lambda: ab.simulate({"settings": {"eta": range(10**30)}}, eta=1), ValueError, "settings.eta: more than 1000000"),
    (lambda: ab.simulate({"settings": {"eta": 1}}, trials=10**12), ValueError, "GiB; expected at most half of the"),
    (lambda: ab.Study(title="\udcff").to_toml(), ValueError, "title: '\\udcff'; an experiment file has text in UTF-8"),
    (lambda: arx().fit(U), TypeError, "expected both u and y, or neither"),
    (lambda: ab.observer(arx(), "fast"), ValueError, "unknown gain 'fast'; expected dead-beat"),
    (lambda: arx().observer("kalman", Q=1.0), TypeError, "Q, r: expected both, or neither"),
    (lambda: arx().observer("kalman", Q=[1.0] * 3, r=1.0), ValueError, "Q: shape (3,); expected a number, (2,)"),
    (lambda: arx().observer("kalman", Q=1.0, r=-1.0), ValueError, "variance must be positive"),
    (lambda: arx().observer("kalman-varying"), ValueError, "needs Q, r and the covariance P(0)"),
    (lambda: arx().observer("fast"), ValueError, "unknown observer 'fast'; expected kalman"),
    (lambda: ab.observer("arx"), TypeError, "model: str; expected a Model"),
    (lambda: ab.orders(U, Y, "1:8"), TypeError, "n: '1:8'; expected a whole number, or several such as range(1, 9)"),
    (lambda: ab.Study(methods="arx"), TypeError, "methods: expected a list"),
    (lambda: ab.Study(methods=[arx]), TypeError, "decorate the function: @asobench.method"),
    (lambda: ab.Study(settings={"eta": {1, 2}}).to_toml(), TypeError, "settings.eta: {1, 2}; expected text"),
    (lambda: ab.method(lambda u, y, w: None), TypeError, "argument w has no default and is none of u, y"),
    (lambda: ab.method(arx.__call__)(1), TypeError, "expected arguments with names"),
    (lambda: ab.method(functools.partial(arx)), TypeError, "method: partial; expected name="),
    (lambda: ab.method(arx, name=3), TypeError, "name: 3; expected text"),
    (lambda: ab.method(command=["true"])(arx), TypeError, "method arx: key 'command'; a function sets it itself"),
]


class WrongUses(unittest.TestCase):
    def test_each_has_one_clear_line(self):
        for use, kind, part in CASES:
            with self.subTest(part):
                with self.assertRaises(kind) as caught:
                    use()
                self.assertIn(part, str(caught.exception))
                self.assertEqual(len(str(caught.exception).splitlines()), 1)

    def test_of_studies(self):
        with tempfile.TemporaryDirectory() as folder:
            for keys, part in [
                ({"setings": {}}, "unknown"),
                ({"settings": {"eta": -1}}, "eta"),
                ({"settings": {"eta": 1}, "methods": ["arks"]}, "arks"),
            ]:
                with self.subTest(part):
                    with self.assertRaises(ab.StudyError) as caught:
                        ab.Study(**keys).run(folder + "/out", trials=2)
                    self.assertIn(part, str(caught.exception))

    def test_ctrl_c_stops_a_run_that_goes_on_later(self):
        source = """
            import asobench as ab, sys
            study = ab.Study(settings={"window": [500, 998], "eta": 10}, methods=["oe"], measures=["e_g"])
            print("begin", flush=True)
            study.run(sys.argv[1], trials=int(sys.argv[2]), progress=False)
        """
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "out")
            call = [sys.executable, "-c", textwrap.dedent(source), str(out), "100000"]
            child = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
            child.stdout.readline()
            until = time.monotonic() + 60
            while not list(out.glob("blocks/*")) and time.monotonic() < until:
                time.sleep(0.1)
            child.send_signal(signal.SIGINT)
            _, errors = child.communicate(timeout=60)
            self.assertNotEqual(child.returncode, 0)
            self.assertIn("KeyboardInterrupt", errors.decode())
            self.assertTrue(list(out.glob("blocks/*")))

    def test_ctrl_c_between_fits(self):
        source = """
            import asobench as ab, numpy as np
            u = np.sign(np.sin(np.arange(500.0) ** 2))
            print("begin", flush=True)
            while True:
                ab.estimate(u, u + 0.1 * np.cos(np.arange(500.0) ** 2), "arx", na=1, nb=1, nk=0)
        """
        call = [sys.executable, "-c", textwrap.dedent(source)]
        child = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        child.stdout.readline()
        os.kill(child.pid, signal.SIGINT)
        _, errors = child.communicate(timeout=30)
        self.assertIn("KeyboardInterrupt", errors.decode())


if __name__ == "__main__":
    unittest.main()
