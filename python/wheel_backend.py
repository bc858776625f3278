"""Builds the wheel: maturin makes that of the extension module; where a profile is named, the program is put into it as
a script: `pip wheel --config-settings=profile=wheel ./python`."""

import os
import shutil
import subprocess
from pathlib import Path

import maturin
from maturin import *  # noqa: F403

HERE = Path(__file__).parent
#: Where maturin looks for scripts, also when it only writes the metadata.
SCRIPTS = HERE / "asobench.data" / "scripts"
SCRIPTS.mkdir(parents=True, exist_ok=True)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    settings = dict(config_settings or {})
    program(settings.pop("profile", None))
    return maturin.build_wheel(wheel_directory, settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    program(None)
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


def program(profile):
    """Builds the program by a profile of Cargo.toml, of which `wheel` is the smallest; None leaves it out."""
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    if profile is None:
        return
    root = HERE.parent
    if not (root / "src" / "main.rs").exists():
        raise SystemExit(f"profile={profile}: these sources are of the extension alone; the program is in a clone")
    subprocess.run(["cargo", "build", "--profile", profile, "--bin", "asobench"], cwd=root, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", root / "target"))
    shutil.copy(target / profile / "asobench", SCRIPTS)
