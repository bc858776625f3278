"""Builds the wheel: maturin makes that of the extension module, and the program is put into it as a script."""

import os
import shutil
import subprocess
from pathlib import Path

import maturin
from maturin import *  # noqa: F403

HERE = Path(__file__).parent
#: Functions of the same code are linked once: unoptimised dependencies have many of these.
LINK = ["--", "-Clink-arg=-Wl,--icf=all"]


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    program()
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    program()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


def program():
    """The program, where maturin looks for scripts."""
    scripts = HERE / "asobench.data" / "scripts"
    shutil.rmtree(scripts, ignore_errors=True)
    scripts.mkdir(parents=True)
    root = HERE.parent
    subprocess.run(["cargo", "rustc", "--release", "--bin", "asobench", *LINK], cwd=root, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", root / "target"))
    shutil.copy(target / "release" / "asobench", scripts)
