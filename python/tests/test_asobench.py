"""The package: python -m unittest discover python/tests"""
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import asobench
import numpy as np

STUDY = {
    "trials": 20,
    "store": "trials",
    "measures": ["e_a", "e_x_max"],
    "settings": {"window": 98, "eta": [0, 10]},
    "methods": [{"estimator": "arx"}],
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

    def test_records(self):
        records = asobench.simulate(STUDY, 1, 3)
        self.assertEqual([records[name].shape for name in "uyr"], 3 * [(3, 98)])
        self.assertTrue(np.array_equal(records["u"], records["r"]))
        self.assertFalse(np.array_equal(records["y"][0], records["y"][1]))

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
