"""Runs a small sweep with the binary under test, once for all checks."""

import os
import subprocess
from pathlib import Path

import pytest

SMALL = [
    "--set", "twin=asset:configs/twin.toml",
    "--set", "vary.grip_offset_mm=[0]",
    "--set", "vary.grip_force_n=[20, 30]",
    "--set", "vary.grip_angle_deg=[30]",
    "--set", "shard_samples=6",
]


def gripgen(*arguments):
    """Runs gripgen and returns the finished process; fails if it failed."""
    command = [os.environ["GRIPGEN_BIN"], *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return done


def sweep(out, *more):
    gripgen("sweep", "asset:configs/quickstart.toml", "-o", out, *SMALL, *more)
    return Path(out)


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """16 samples in three shards, images as PNG."""
    return sweep(tmp_path_factory.mktemp("run") / "png")


@pytest.fixture(scope="session")
def raw_run(tmp_path_factory):
    """The same samples, images raw."""
    return sweep(tmp_path_factory.mktemp("run") / "raw", "--set", "images=raw")
