"""Functions as methods, studies as objects, results as frames."""

import json
import os
import shutil
import sys
import tempfile
import time
import unittest
import warnings
from pathlib import Path
from unittest import mock

import numpy as np

import asobench as ab

MINE = Path(__file__).parent / "mine.py"
SETTINGS = {"window": 98, "eta": np.array([0, 10])}


def regression(u, y, na, nb, nk):
    k = np.arange(max(na, nb + nk - 1), len(y))[:, None]
    phi = np.hstack([-y[k - np.arange(1, na + 1)], u[k - nk - np.arange(nb)]])
    return phi, y[k[:, 0]]


@ab.method
def mine(u, y, na, nb, nk):
    phi, target = regression(u, y, na, nb, nk)
    theta = np.linalg.lstsq(phi, target, rcond=None)[0]
    return ab.Model(A=[1, *theta[:na]], B=theta[na:], nk=nk)


@ab.method
def ridge(u, y, na, nb, nk, *, weight=1.0):
    phi, target = regression(u, y, na, nb, nk)
    theta = np.linalg.solve(phi.T @ phi + weight * np.eye(na + nb), phi.T @ target)
    return {"A": theta[:na], "B": theta[na:], "nk": nk}


@ab.method(batch=4)
def failing(u, y, trial):
    if trial < 2:
        raise ValueError("too early")
    return ab.Model(B=[1.0], F=[1, -0.5], nk=1)


class Studies(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = Path(place.name)

    def run_methods(self, methods, name="out", trials=30, **keys):
        keys = {"measures": ["e_a", "e_g"], "store": "trials", "settings": SETTINGS, **keys}
        return ab.Study(methods=methods, **keys).run(self.folder / name, trials=trials, progress=False)

    def columns(self, results, label):
        """What a method left in every trial, as bytes."""
        frame = results.trials("polars").filter(estimator=label)
        return [frame[name].to_numpy().tobytes() for name in ("cell", "trial", "e_a", "e_g")]

    def test_a_function_equals_the_same_function_as_a_program(self):
        shutil.copy(MINE, self.folder)
        program = {"name": "program", "command": [sys.executable, str(self.folder / "mine.py")]}
        of_program = ab.run({"settings": SETTINGS, "measures": ["e_a", "e_g"], "store": "trials", "methods": [program]},
                            self.folder / "program", trials=30, allow_commands=True)  # fmt: skip
        forked = ab.method(mine.function, name="forked", processes=2)
        of_function = self.run_methods([mine, forked])
        expected = self.columns(of_program, "program")
        self.assertEqual(self.columns(of_function, "mine"), expected)
        self.assertEqual(self.columns(of_function, "forked"), expected)
        self.assertEqual(len(of_function.trials("polars")), 2 * 2 * 30)

    def test_a_function_is_told_what_it_asks_for(self):
        told = []

        @ab.method(orders="na=2,nb=3,nk=2")
        def curious(u, y, r, na, nb, nc, nd, nf, nk, order, samples, sampling, loop, trial, seed):
            told.append((na, nb, nc, nd, nf, nk, order, samples, sampling, loop, trial))
            records.append((u, y, r, seed))
            return {"A": np.zeros(na), "B": np.ones(nb), "nk": nk}

        records = []
        settings = {"window": 98, "eta": 10, "feedback": "static"}
        feedbacks = {"static": {"numerator": [0.4]}}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            results = self.run_methods([curious], trials=5, settings=settings, feedbacks=feedbacks)
        # The order is that of what was asked for, max(na, nb + nk - 1), not that of the plant.
        self.assertEqual(told[:5], [(2, 3, 0, 0, 0, 2, 4, 98, 1.0, "closed", trial) for trial in range(5)])
        for u, y, r, _ in records:
            np.testing.assert_allclose(u, r - 0.4 * y, rtol=0, atol=1e-12)
        self.assertEqual(len({seed for *_, seed in records[:5]}), 5)
        # Of another order than the plant there are no errors of parameters; of the response there are.
        frame = results.trials("polars")
        self.assertEqual(frame["e_a"].drop_nulls().drop_nans().len(), 0)
        self.assertTrue(np.isfinite(frame["e_g"].to_numpy()).all())

    def test_covariance_and_noise_of_a_function_count_as_those_of_an_estimator(self):
        @ab.method(observer="kalman")
        def own(u, y, na, nb, nk):
            model = ab.estimate(u, y, "arx", na=na, nb=nb, nk=nk)
            return ab.Model(A=model.A, B=model.B, noise_variance=model.noise_variance, cov=model.cov)

        methods = [{"estimator": "arx", "observer": "kalman"}, own]
        settings = {"window": 98, "eta": 10, "process_noise": 0.1}
        results = self.run_methods(methods, settings=settings, measures=["e_a", "rms_x"], coverage=True)
        frame = results.trials("polars").drop("cell")
        arx, mine = (
            frame.filter(estimator=name).drop("estimator") for name in frame["estimator"].unique(maintain_order=True)
        )
        self.assertEqual(len(arx), 30)
        for name in (name for name in arx.columns if name.startswith(("se_", "rms_", "e_"))):
            np.testing.assert_allclose(mine[name].to_numpy(), arx[name].to_numpy(), rtol=1e-9, err_msg=name)
            self.assertTrue(np.isfinite(mine[name].to_numpy()).all(), name)

    def test_options_make_methods_of_their_own(self):
        results = self.run_methods([mine, ridge, ridge.having(weight=0.0), ridge.having("much", weight=1e9)])
        median = {row["output"]: row["q50"] for row in results.rows(eta=10) if row["measure"] == "e_a"}
        self.assertEqual(set(median), {"mine", "ridge", "ridge-weight-0.0", "much"})
        self.assertAlmostEqual(median["ridge-weight-0.0"], median["mine"], places=6)
        self.assertGreater(median["much"], 0.9)
        self.assertEqual(ridge(np.ones(9), np.ones(9), 1, 1, 1, weight=1.0)["nk"], 1)

    def test_models_of_any_orders_in_messages_of_one(self):
        @ab.method(batch=1)
        def varying(u, y, nk, trial):
            model = ab.estimate(u, y, "arx", na=2 + trial % 2, nb=2, nk=nk)
            return ab.Model(A=model.A, B=model.B)

        results = self.run_methods([varying], trials=6)
        self.assertEqual(results.failed(), [])
        together = ab.method(varying.function, name="together")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            slow = self.run_methods([together], "together", trials=6)
        self.assertIn("batch = 1", str(caught[-1].message))
        self.assertEqual(self.columns(slow, "together"), self.columns(results, "varying"))

    def test_reasons_and_the_first_traceback(self):
        @ab.method
        def picky(u, y, trial):
            if trial < 3:
                raise ab.Declined("too short")
            if trial == 3:
                raise ab.Declined
            if trial in (4, 7):
                raise ValueError("no root")
            return ab.Model(B=[1.0], F=[1, -0.5], nk=1)

        with self.assertWarnsRegex(UserWarning, r"(?s)method picky: trial 4 \(the first\).*ValueError: no root"):
            results = self.run_methods([picky], trials=10, settings={"eta": 10, "window": 98})
        failed = {row["kind"]: (row["count"], row["first"]) for row in results.failed("picky")}
        self.assertEqual(failed["declined"], (1, [3]))
        self.assertEqual(failed["external: declined, too short"], (3, [0, 1, 2]))
        self.assertEqual(failed["external: ValueError? no root"], (2, [4, 7]))
        with self.assertRaisesRegex(KeyError, "picky"):
            results.failed("other")

    def test_a_function_that_hangs_is_killed(self):
        @ab.method(processes=1, timeout=1, batch=1)
        def slow(u, y, trial):
            time.sleep(3600 if trial == 1 else 0)
            return ab.Model(B=[1.0], F=[1, -0.5], nk=1)

        results = self.run_methods([slow], trials=3, settings={"eta": 10, "window": 98})
        (failed,) = results.failed()
        self.assertEqual((failed["kind"], failed["first"]), ("timeout", [1]))

    def test_another_function_is_another_study(self):
        def make(weight):
            return ab.method(lambda u, y: ab.Model(B=[weight], nk=1), name="closed")

        keys = {"settings": {"eta": 10, "window": 98}}
        self.run_methods([make(1.0)], trials=5, **keys)
        self.run_methods([make(1.0)], trials=8, **keys)
        with self.assertRaises(ab.StudyError):
            self.run_methods([make(2.0)], trials=5, **keys)
        study = ab.Study(methods=[make(2.0)], **keys)
        self.assertEqual(len(study.run(self.folder / "out", trials=4, overwrite=True).rows()) > 0, True)

    def test_replays_call_the_function(self):
        results = self.run_methods([mine, "arx"])
        trial = results.replay(7, eta=10)
        records = ab.simulate(ab.Study(settings=SETTINGS), trials=8, eta=10)
        self.assertEqual(trial.u[:98].tolist(), records["u"][7].tolist())
        self.assertEqual(trial.y[:98].tolist(), records["y"][7].tolist())
        self.assertIsInstance(trial.truth, dict)
        self.assertIn("mine", json.dumps(trial.raw))
        with self.assertRaisesRegex(ValueError, "2 cells; expected one: eta=..."):
            results.replay(7)

    def test_a_function_is_no_consent_to_programs(self):
        started = self.folder / "started"
        source = f"open({str(started)!r}, 'w')\nexec(open({str(MINE)!r}).read())"
        foreign = {"name": "foreign", "command": [sys.executable, "-c", source], "batch": 10}
        study = ab.Study(methods=[foreign, mine], settings=SETTINGS, measures=["e_a"])
        with self.assertRaisesRegex(ab.StudyError, r"starts a program: \S+ \(method foreign\)") as caught:
            study.run(self.folder / "out", trials=3, progress=False)
        self.assertNotIn("method mine", str(caught.exception))
        self.assertFalse(started.exists())
        self.assertFalse((self.folder / "out").exists())
        results = study.run(self.folder / "out", trials=3, progress=False, allow_commands=True)
        self.assertTrue(started.exists())
        started.unlink()
        for methods in ([], [mine], [failing, mine]):
            with self.assertRaisesRegex(ab.StudyError, r"starts a program: \S+ \(method foreign\)|\(method mine\)"):
                ab.Results(results.folder, methods=methods).replay(1, eta=10)
        self.assertFalse(started.exists())
        self.assertEqual(results.replay(1, eta=10, allow_commands=True).trial, 1)
        self.assertTrue(started.exists())

    def test_nothing_is_imported_from_the_folder_of_a_file(self):
        place = self.folder / "theirs"
        place.mkdir()
        for name in ("socket", "select", "os", "numpy", "json"):
            (place / f"{name}.py").write_text(f"open({str(self.folder / 'started')!r}, 'w')\n")
        (place / "study.toml").write_text('[settings]\neta = 10\nwindow = 40\n[[methods]]\nestimator = "arx"\n')
        study = ab.Study.read(place / "study.toml")
        self.assertEqual(len(study.simulate(trials=3)["trial"]), 3)
        own = ab.Study(methods=[failing], settings={"eta": 10, "window": 40}, measures=["e_g"])
        own.folder = place
        with self.assertWarns(UserWarning):
            own.run(self.folder / "out", trials=4, progress=False)
        self.assertFalse((self.folder / "started").exists())

    def test_a_name_is_never_a_path(self):
        names = ["a/b", "../../esc", "..", ".hidden", "[x]*?", "a b", "-c", "ä", "x" * 150, "0", "0-error", "a\\b", "~"]
        for name in names:
            place = self.folder / "1/2/3"
            place.mkdir(parents=True, exist_ok=True)
            with (
                self.subTest(name),
                mock.patch.object(tempfile, "tempdir", str(place)),
                warnings.catch_warnings(record=True) as caught,
            ):
                warnings.simplefilter("always")
                results = self.run_methods([failing.having(name), failing], f"1/out{names.index(name)}", trials=4)
                failed = {(row["output"], row["kind"], row["count"]) for row in results.failed()}
                self.assertEqual(failed, {(label, "external: ValueError? too early", 2) for label in (name, "failing")})
                self.assertEqual({str(word.message).split(" failed:")[0] for word in caught},
                                 {f"method {label}: trial 0 (the first)" for label in (name, "failing")})  # fmt: skip
                self.assertEqual(list(place.iterdir()), [])
        made = {path.name for path in (self.folder / "1").iterdir()}
        self.assertEqual(made, {"2", *(f"out{at}" for at in range(len(names)))})
        self.assertEqual([path.name for path in self.folder.iterdir()], ["1"])

    def test_paths_of_any_bytes_and_length(self):
        for name in (b"long" * 50, b"a\xffb", "ä [x] %".encode()):
            with self.subTest(name):
                place = Path(os.fsdecode(os.path.join(os.fsencode(self.folder), name)))
                place.mkdir()
                study = ab.Study(settings={"window": 98, "eta": [2, 10]}, measures=["e_a"], methods=["arx"])
                path = study.save(place / place.name[:9])
                with mock.patch.object(tempfile, "tempdir", str(place)):
                    study = ab.Study.read(path)
                    study = ab.Study(**{**study.keys, "methods": [*study.keys["methods"], mine]})
                    study.folder = place
                    results = study.run(place / "out", trials=5, progress=False)
                    self.assertEqual(len(study.simulate(3, eta=10)["trial"]), 3)
                    self.assertEqual(results.replay(3, eta=10).trial, 3)
                    self.assertTrue(results.report().exists())
                    self.assertIn("<svg", results.plot("e_a", x="eta").svg)

    def test_frames_by_labels(self):
        results = self.run_methods(["iv", "arx"], compare=[["iv(4)", "arx"]])
        for kind in ("polars", "pandas"):
            try:
                frame = results.frame(kind, eta=10)
            except ImportError as error:
                self.assertIn(f"asobench[{kind}]", str(error))
                continue
            self.assertEqual(set(frame["output"]), {"ls", "iv(1)", "iv(2)", "iv(3)", "iv(4)", "arx"})
            self.assertEqual(set(frame["eta"]), {10})
            self.assertEqual(len(results.comparisons(kind)), 2 * 2)
            self.assertEqual(len(results.trials(kind)), 2 * 30 * 6)
        by_hand = np.median(results.trials("polars").filter(cell=1, estimator="arx")["e_a"].to_numpy())
        (row,) = [r for r in results.rows(eta=10) if r["output"] == "arx" and r["measure"] == "e_a"]
        self.assertAlmostEqual(row["q50"] / by_hand, 1, places=2)
        with self.assertRaisesRegex(KeyError, "eta: 3; expected one of 0, 10"):
            results.frame(eta=3)

    def test_verdicts_and_pictures(self):
        claim = {"id": "K", "text": "arx errs more with noise.",
                 "test": {"cells": "e_a", "of": "arx", "axis": "eta", "from": 2, "to": [10], "above": 1}}  # fmt: skip
        results = self.run_methods(["arx"], settings={"window": 98, "eta": [2, 10]}, claims=[claim], trials=300)
        (verdict,) = results.verdicts()
        self.assertEqual((verdict.id, verdict.text), ("K", claim["text"]))
        by_cell = [results.trials("polars").filter(cell=cell)["e_a"].to_numpy() for cell in (0, 1)]
        self.assertEqual(verdict.verdict, "holds")
        self.assertAlmostEqual(float(verdict.numbers[0]["value"]) / np.median(by_cell[1] / by_cell[0]), 1, places=2)
        picture = results.plot("e_a", x="eta")
        self.assertTrue(picture._repr_svg_().startswith("<svg"))
        try:
            import matplotlib

            matplotlib.use("Agg")
            from matplotlib.figure import Figure
        except ImportError:
            return
        axes = results.plot("e_a", x="eta", ax=Figure().subplots())
        self.assertEqual(axes.get_ylabel(), "median e_a")

    def test_a_study_writes_the_file_that_it_is(self):
        study = ab.Study(settings={"eta": range(3), "window": np.int64(98)}, methods=[{"estimator": "oe", "starts": 2}])
        path = study.save(self.folder / "study.toml")
        again = ab.Study.read(path)
        self.assertEqual(again.keys["settings"], {"eta": [0, 1, 2], "window": 98})
        self.assertEqual(again.keys["methods"], study.keys["methods"])
        self.assertIn("cells     3: eta 3", again.check())


if __name__ == "__main__":
    unittest.main()
