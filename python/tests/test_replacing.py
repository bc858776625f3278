"""Results in a folder: what a study may replace there, and a run that has not ended. Python itself removes nothing."""

import fcntl
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

import asobench as ab

SETTINGS = {"window": 18, "eta": [2, 10]}


def study(seed=1, **keys):
    return ab.Study(**{"seed": seed, "settings": SETTINGS, "methods": ["ls"], "measures": ["e_a"], **keys})


def tree(folder):
    """Every file below a folder with its content, and every folder."""
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


class Replacing(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.out = Path(place.name, "out")

    def refuses(self, of, part, **options):
        before = tree(self.out)
        with self.assertRaises(ab.StudyError) as caught:
            of.run(self.out, trials=10, overwrite=True, **options)
        self.assertIn(part, str(caught.exception))
        self.assertEqual(len(str(caught.exception).splitlines()), 1)
        self.assertEqual(tree(self.out), before)

    def test_a_foreign_folder_stays_as_it_is(self):
        for files, part in [
            ({"manifest.json": '{"manifest_version": 3, "name": "Clipper"}', "thesis.tex": "mine"}, "manifest.json"),
            ({"blocks/photo.jpg": "mine"}, "no manifest.json"),
            ({"thesis.tex": "mine"}, "no manifest.json"),
        ]:
            with self.subTest(part):
                for name, text in files.items():
                    path = self.out / name
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_text(text)
                self.refuses(study(), part)
                for name in files:
                    (self.out / name).unlink()

    def test_what_is_wrong_keeps_finished_results(self):
        study().run(self.out, trials=10)
        self.refuses(study(2, methods=["lss"]), "lss")
        self.refuses(study(2, setings={}), "setings")
        self.refuses(study(2, methods=[{"name": "m", "command": ["false"]}]), "--allow-commands")
        (self.out / "blocks" / "thesis.tex").write_text("mine")
        self.refuses(study(2), "thesis.tex")

    def test_a_folder_of_another_run_is_refused(self):
        study().run(self.out, trials=10)
        with (self.out / ".lock").open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.refuses(study(2), "another run")
            with self.assertRaisesRegex(ab.StudyError, "another run"):
                study(2).run(self.out, trials=10)

    def test_another_study_takes_the_place(self):
        results = study(store="trials").run(self.out, trials=10)
        (self.out / "thesis.tex").write_text("mine")
        with self.assertRaisesRegex(ab.StudyError, "another design"):
            study(2).run(self.out, trials=10)
        self.assertEqual(ab.Results(self.out).summary, results.summary)
        new = study(2).run(self.out, trials=10, overwrite=True)
        alone = study(2).run(self.out.parent / "alone", trials=10)
        self.assertEqual(new.summary, alone.summary)
        self.assertNotEqual(new.summary, results.summary)
        left = {path.name for path in self.out.iterdir()} - {path.name for path in alone.folder.iterdir()}
        self.assertEqual(left, {"thesis.tex"})
        # Fewer trials are another matter than more, and than the same.
        with self.assertRaisesRegex(ab.StudyError, "more than 5"):
            study(2).run(self.out, trials=5)
        self.assertEqual(study(2).run(self.out, trials=5, overwrite=True).rows()[0]["trials"], 5)
        self.assertEqual(study(2).run(self.out, trials=10, overwrite=True).summary, new.summary)

    def test_whole_results_count_before_they_have_moved(self):
        study().run(self.out, trials=10)
        new = study(2).run(self.out.parent / "alone", trials=10)
        whole = self.out / ".asobench-whole"
        whole.mkdir()
        for path in new.folder.glob("[!.]*.*"):
            (whole / path.name).write_bytes(path.read_bytes())
        self.assertEqual(ab.Results(self.out).summary, new.summary)

    def test_python_removes_nothing(self):
        sources = Path(ab.__file__).parent.glob("*.py")
        removes = re.compile(r"\brmtree\b|\bunlink\b|\bremove\(|\brmdir\b|\bremovedirs\b")
        for path in sources:
            self.assertIsNone(removes.search(path.read_text()), path.name)

    def test_a_run_that_has_not_ended_is_told_from_none(self):
        source = """
            import asobench as ab, sys
            study = ab.Study(settings={"window": 500, "eta": 10}, methods=["oe"], measures=["e_g"], store="trials")
            print("begin", flush=True)
            study.run(sys.argv[1], trials=100000, progress=False)
        """
        call = [sys.executable, "-c", textwrap.dedent(source), str(self.out)]
        child = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
        until = time.monotonic() + 60
        while not list(self.out.glob("blocks/*.block")) and time.monotonic() < until:
            time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        child.communicate(timeout=60)
        results = ab.Results(self.out)
        for use in (results.rows, results.trials, results.verdicts, results.failed):
            with self.assertRaisesRegex(FileNotFoundError, r"\d+ of 100000 trials of a run that has not ended"):
                use()
        for use in (results.plot, results.report, lambda: results.replay(0, cell=0)):
            with self.assertRaisesRegex(ab.StudyError, r"\d+ of 100000 trials of a run that has not ended"):
                use()
        self.out.with_name("empty").mkdir()
        with self.assertRaisesRegex(FileNotFoundError, "no results in this folder"):
            ab.Results(self.out.with_name("empty")).rows()


if __name__ == "__main__":
    unittest.main()
