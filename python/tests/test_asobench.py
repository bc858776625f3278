"""The package: python -m unittest discover python/tests"""

import json
import os
import shutil
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

import asobench

STUDY = {
    "trials": 20,
    "store": "trials",
    "measures": ["e_a", "e_x_max"],
    "settings": {"window": 98, "eta": [0, 10]},
    "methods": [{"estimator": "arx"}],
}
#: What a program finds in its environment where MKL_NUM_THREADS alone was set.
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "3",
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(256 << 20),
}


class Package(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.folder = Path(self.place.name)
        self.addCleanup(self.place.cleanup)

    def test_a_function_as_a_method(self):
        shutil.copy(Path(__file__).parent / "mine.py", self.folder)
        command = [sys.executable, str(self.folder / "mine.py")]
        study = {**STUDY, "methods": [*STUDY["methods"], {"name": "mine", "command": command, "batch": 10}]}
        results = asobench.run(study, self.folder / "out", allow_commands=True)
        self.assertIn("mine", results.text)
        for cell in results.summary["cells"]:
            arx, mine = (output["figures"]["e_a"]["q50"]["value"] for output in cell["outputs"])
            self.assertLess(abs(arx - mine), 1e-9)
        self.assertTrue(results.report().exists())

    def test_programs_need_a_word(self):
        study = {**STUDY, "methods": [{"name": "mine", "command": ["true"]}]}
        with self.assertRaisesRegex(RuntimeError, "--allow-commands"):
            asobench.run(study, self.folder / "out")

    def test_what_a_program_is_told(self):
        source = f"""
            import asobench, json, numpy as np, os, sys
            @asobench.worker(name="told")
            def f(u, y, r, setting):
                told = {{key: setting[key] for key in ("method", "loop", "noise") if key in setting}}
                told |= {{key: setting[key].tolist() for key in ("trials", "seeds")}}
                told |= {{"place": [os.getcwd(), sys.stdin.read(), *sys.argv[1:]]}}
                told |= {{"environment": [os.environ[name] for name in {list(ENVIRONMENT)}]}}
                told |= {{"names": [os.path.exists(os.environ[f"ASOBENCH_{{of}}"]) for of in ("REQUESTS", "REPLIES")]}}
                told |= {{"gap": [float(abs(u - r).max()), float(abs(u + 0.4 * y - r).max())]}}
                print("answering", flush=True)
                with open({str(self.folder / "told")!r}, "a") as file:
                    file.write(json.dumps(told) + chr(10))
                return {{"A": np.zeros((len(u), 6)), "B": np.zeros((len(u), 6)), "nk": 1}}
            f.serve()
        """
        (self.folder / "told.py").write_text(textwrap.dedent(source))
        own = {"command": [sys.executable, "told.py", "$HOME *"], "batch": 4}
        study = asobench.Study(
            settings={"window": 40, "eta": 10, "feedback": ["none", "static"]},
            feedbacks={"static": {"numerator": [0.4]}},
            methods=[{"name": "plain", **own}, {"name": "noise", **own, "told": ["noise"]}],
            measures=["e_g"],
        )
        study.folder = self.folder
        with mock.patch.dict(os.environ):
            for name in ENVIRONMENT:
                os.environ.pop(name, None)
            os.environ["MKL_NUM_THREADS"] = "3"
            study.run(self.folder / "out", trials=6, allow_commands=True)
        self.assertTrue((self.folder / "out" / "workers.log").exists())
        told = [json.loads(line) for line in (self.folder / "told").read_text().splitlines()]
        seeds = {}
        for of in told:
            # Of no shell, in the folder of the file; the names of the pipes are gone after the first answer.
            self.assertEqual(of["place"], [os.path.realpath(self.folder), "", "$HOME *"])
            self.assertEqual(of["environment"], [*ENVIRONMENT.values()])
            self.assertEqual(of["names"], [False, False])
            self.assertEqual("noise" in of, of["method"] == "noise")
            # The input as it is; in closed loop u = r - 0.4 y.
            self.assertLess(of["gap"][of["loop"] == "closed"], 1e-12)
            self.assertEqual(of["gap"][0] > 1e-3, of["loop"] == "closed")
            for trial, seed in zip(of["trials"], of["seeds"]):
                seeds.setdefault((of["method"], of["loop"], trial), set()).add(seed)
        # Whole batches, beyond the six trials; one seed of a trial, whatever the cell and the method.
        self.assertEqual({key[2] for key in seeds}, set(range(8)))
        self.assertEqual(len(seeds), 2 * 2 * 8)
        self.assertTrue(all(len({*seeds[key], *seeds["plain", "open", key[2]]}) == 1 for key in seeds))
        self.assertEqual(len(set.union(*seeds.values())), 8)

    def test_records(self):
        records = asobench.simulate(STUDY, 1, 3)
        self.assertEqual([records[name].shape for name in "uyr"], 3 * [(3, 98)])
        self.assertTrue(np.array_equal(records["u"], records["r"]))
        self.assertFalse(np.array_equal(records["y"][0], records["y"][1]))

    def test_a_record_that_cannot_be_drawn_is_not_sent(self):
        # Silence identifies no model, so there is no controller.
        settings = {"feedback": "state", "eta": 10, "amplitude": 0, "window": 100, "horizon": 150}
        study = {"settings": settings, "feedbacks": {"state": {"state_gain": 6 * [0.1], "identify": 50}}}
        with self.assertRaisesRegex(ValueError, "no record of the first 3 trials can be drawn"):
            asobench.simulate(study, trials=3)

    def test_records_are_those_of_the_cell(self):
        # The file is beside the study, not in the current folder.
        (self.folder / "in.csv").write_text("u\n" + "".join(f"{(-1) ** (k // 3)}\n" for k in range(400)))
        settings = {**STUDY["settings"], "input": "file:in.csv", "window": [60, 98]}
        path = self.folder / "study.toml"
        path.write_text(asobench._toml.toml({**STUDY, "settings": settings}))
        shapes = [asobench.simulate(path, cell, 3)["y"].shape for cell in range(4)]
        self.assertEqual(sorted(shapes), [(3, 60), (3, 60), (3, 98), (3, 98)])
        records = asobench.simulate(path, 0, 4)
        self.assertEqual(records["trial"].tolist(), [0, 1, 2, 3])
        self.assertEqual(records["u"][0, :4].tolist(), [1, 1, 1, -1])
        with self.assertRaisesRegex(IndexError, "0 to 3"):
            asobench.simulate(path, 4)

    def test_rows_have_the_numbers_of_their_trials(self):
        study = {**STUDY, "settings": {"plant": ["nikolov2023", "random"], "window": 98, "eta": 10}}
        cells = [asobench.simulate(study, cell, 5) for cell in (0, 1)]
        for records in cells:
            self.assertEqual(records["trial"].tolist(), [0, 1, 2, 3, 4])
        # A random plant answers the same input otherwise.
        self.assertTrue(np.array_equal(cells[0]["u"], cells[1]["u"]))
        self.assertFalse(np.array_equal(cells[0]["y"], cells[1]["y"]))

    def method(self, body, options="single=True", trials=20):
        """Runs a method with this body; gives the outcomes of its trials and what the run says."""
        source = "import asobench, numpy as np\n" + f"@asobench.worker({options})\ndef f(u, y, r, setting):\n"
        source += "".join(f"    {line}\n" for line in body.splitlines()) + "f.serve()\n"
        (self.folder / "f.py").write_text(source)
        method = {"name": "f", "command": [sys.executable, str(self.folder / "f.py")], "batch": 10}
        study = {
            "trials": trials,
            "measures": ["e_a", "e_g"],
            "methods": [method],
            "settings": {"window": 98, "eta": 10},
        }
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        results = asobench.run(study, self.folder / "out", allow_commands=True)
        outcomes = results.summary["cells"][0]["outputs"][0]["outcomes"]
        return {"ok": outcomes["trials"] - sum(outcomes["failures"].values()), **outcomes["failures"]}, results

    def test_what_is_no_model_is_no_result(self):
        for body, reason in [
            ("return None", "external: TypeError? returned NoneType? expected a dict of"),
            ("return {'A': np.zeros(6) + 1j, 'B': np.zeros(6)}", "external: TypeError? A? complex numbers"),
            ("return {'A': np.zeros(6), 'b': np.zeros(6)}", "external: TypeError? returned the key ?b?"),
            ("return {'A': np.zeros((6, 2)), 'B': np.zeros(6)}", "external: TypeError? A? shape"),
            ("return {'A': np.zeros(6), 'B': np.zeros(6), 'nk': 1.5}", "external: TypeError? nk? 1.5"),
            ("return {'A': np.zeros(6), 'covariance': np.eye(5)}", "external: TypeError? covariance? shape"),
            ("raise ValueError('no such thing')", "external: ValueError? no such thing"),
            ("raise asobench.Declined", "declined"),
        ]:
            with self.subTest(body):
                outcomes, _ = self.method(body)
                ((name, count),) = ((name, count) for name, count in outcomes.items() if count)
                self.assertTrue(name.startswith(reason), name)
                self.assertEqual(count, 20)

    def test_models_of_a_message_that_differ(self):
        # The true plant is not of these orders: only which trials have a model counts, and which model.
        body = """nk = 1 + setting["trial"] % 2
return {"A": np.zeros(6), "B": np.full(7 - nk, 1.0 + setting["trial"] % 2), "nk": nk}"""
        _, results = self.method(body, trials=10)
        alike = """second = setting["trial"] % 2
return {"A": np.zeros(6), "B": np.r_[np.full(second, 0.0), np.full(6 - second, 1.0 + second)], "nk": 1}"""
        figures = results.summary["cells"][0]["outputs"][0]["figures"]
        outcomes, results = self.method(alike, trials=10)
        self.assertEqual(outcomes["ok"], 10)
        self.assertEqual(figures, results.summary["cells"][0]["outputs"][0]["figures"])

    def test_a_batch_is_checked_as_a_whole(self):
        for body in ["return None", "return {'A': np.zeros((6, len(u))), 'B': np.zeros((len(u), 6))}"]:
            outcomes, _ = self.method(body, options="", trials=2)
            self.assertEqual(outcomes["crashed"], 2)

    def test_frames(self):
        results = asobench.run(STUDY, self.folder / "out")
        try:
            import polars
        except ImportError:
            with self.assertRaisesRegex(ImportError, "frames"):
                results.frame()
            return
        self.assertIsInstance(results.frame(), polars.DataFrame)
        self.assertEqual(len(results.trials()), 2 * 20)


if __name__ == "__main__":
    unittest.main()
