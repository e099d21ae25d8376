"""One small run for all checks of the Python package, and the command line that is compared with it."""

import os
import subprocess
from pathlib import Path

import pytest

import gripgen as gg

CONFIG = "asset:configs/quickstart.toml"
#: 16 samples in three shards; the reduced mechanics make them in a second.
SMALL = {
    "twin": "asset:configs/twin.toml",
    "vary.grip_offset_mm": [0],
    "mechanics": "reduced",
    "vary.grip_force_n": [20, 30],
    "vary.grip_angle_deg": [30],
    "shard_samples": 6,
}


def command_line(*arguments):
    """Runs the binary under test; fails if it failed."""
    command = [os.environ["GRIPGEN_BIN"], *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return done.stdout


def content(folder):
    """Every file of a folder by name, without what is being written."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """A run folder."""
    out = tmp_path_factory.mktemp("wheel") / "run"
    gg.sweep(CONFIG, out, jobs=2, set=SMALL)
    return out


@pytest.fixture
def copy_of(run, tmp_path):
    """A copy of the run that may be damaged."""
    import shutil

    return Path(shutil.copytree(run, tmp_path / "copy"))
