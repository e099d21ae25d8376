"""`pip install .` into a fresh environment, as README and docs say it. Run by `cargo xtask test --all` (minutes)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif("GRIPGEN_SLOW_TESTS" not in os.environ, reason="slow: cargo xtask test --all")


def test_a_fresh_environment_has_package_and_command(tmp_path):
    def run(*command):
        clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "GRIPGEN_BIN")}
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=clean)
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        return done.stdout

    run(sys.executable, "-m", "venv", tmp_path / "venv")
    binaries = tmp_path / "venv" / "bin"
    run(binaries / "python", "-m", "pip", "install", "--quiet", str(ROOT))
    run(binaries / "gripgen", "sweep", "asset:configs/quickstart.toml", "--out", "run", "--set", "mechanics=reduced", "-q")
    code = "import gripgen as gg; ds = gg.load('run'); print(ds.batch([0])[0].shape, gg.Sim(images=False).parts)"
    found = run(binaries / "python", "-c", code)
    assert "(1, 2, 240, 320, 3)" in found and "gear" in found
