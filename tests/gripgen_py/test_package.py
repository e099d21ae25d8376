"""The package as such: stubs, names, documentation."""

import inspect
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import gripgen as gg

ROOT = Path(__file__).parents[2]
DOCS = ["README.md", "docs/python.md", "docs/training.md", "docs/scale.md"]

#: Commands of the documentation that are not run here, and why.
NOT_RUN = {
    "cargo": "they are what built this",
    "pip install": "`cargo xtask test --all` installs into a fresh environment",
    "gripgen calibrate presses": "tests/presses.rs runs it on presses",
    "gripgen compare new-presses": "tests/presses.rs runs it on presses",
    "gripgen sensor check": "crates/cli/tests/cli/sensor_check.rs runs it on presses",
    "gripgen render part.stl": "crates/cli/tests/cli/presses.rs runs it on a mesh",
    "gripgen sweep mine/sweep.toml": "10 000 samples",
    "python examples/train_grip_metric.py": "needs torch; docs/training.md has its figures",
    "python examples/train_on_families.py": "minutes; docs/training.md has its figures",
    "python examples/close_the_loop.py": "needs torch, minutes; docs/training.md has its figures",
    "python benches/python.py": "a benchmark",
}


def test_the_stubs_are_those_of_the_module():
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "gripgen._core", "--ignore-disjoint-bases"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_is_documented():
    for name in gg.__all__:
        thing = getattr(gg, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert inspect.getdoc(thing), name
            for member, what in inspect.getmembers(thing, inspect.isfunction):
                if not member.startswith("_") and what.__module__.startswith("gripgen"):
                    assert inspect.getdoc(what), f"{name}.{member}"
    assert gg.__version__ == re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M)[1]


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder like a checkout with what the documentation takes for given: measured pulls, a part."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    # A cluster of its own, whatever else runs on this machine.
    monkeypatch.setenv("RAY_ADDRESS", "local")
    for name in ("assets", "tests", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "assets/campaigns/example", tmp_path / "measured")
    shutil.copy(ROOT / "assets/parts/gear/part.stl", tmp_path / "part.stl")
    binary = tmp_path / "target/release"
    binary.mkdir(parents=True)
    (binary / "gripgen").symlink_to(os.environ["GRIPGEN_BIN"])
    gg.sweep("asset:configs/quickstart.toml", "runs/quickstart", set={"mechanics": "reduced"})
    return tmp_path


def blocks(text):
    """Python blocks with the packages that they say they need."""
    for code in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S):
        needs = re.match(r"# needs: (.*)\n", code)
        yield code, [n.strip() for n in needs[1].split(",")] if needs else []


@pytest.mark.parametrize("page", DOCS)
def test_python_snippets_run_in_their_order(page, desk):
    names = {"__name__": "snippets"}
    ran = 0
    for code, needs in blocks((ROOT / page).read_text()):
        if any(find_spec(need) is None for need in needs if need != "measured"):
            continue
        exec(compile(code, page, "exec"), names)
        ran += 1
    if "ray" in sys.modules:
        # The cluster that a snippet started.
        sys.modules["ray"].shutdown()
    assert ran or page in ("docs/training.md", "docs/scale.md")


def commands(text):
    """Shell lines: indented by four, beginning with a program."""
    for line in re.findall(r"^    ((?:target/release/)?(?:gripgen|cargo|pip|python) .*)$", text, re.M):
        yield re.sub(r"\s+#.*$", "", line.strip())


def test_shell_commands_run_in_their_order(desk):
    path = f"{desk / 'target/release'}:{os.environ['PATH']}"
    for page in DOCS:
        for command in commands((ROOT / page).read_text()):
            plain = command.removeprefix("target/release/")
            if any(plain.startswith(start) for start in NOT_RUN):
                continue
            done = subprocess.run(
                command, shell=True, capture_output=True, text=True, check=False, env=os.environ | {"PATH": path}
            )
            assert done.returncode == 0, f"{page}: {command}: {done.stdout}{done.stderr}"


@pytest.mark.parametrize("package, extra, use", [
    ("pandas", "table", "gg.load(run).table()"),
    ("pyarrow", "table", "gg.load(run).table(to='arrow')"),
    ("matplotlib", "plot", "gg.Sim(images=False).pull(part='gear', grip_force_n=30.0).plot()"),
    ("torch", "train", "gg.torch"),
    ("ray", "ray", "gg.ray"),
    ("gymnasium", "gym", "import gripgen.envs"),
    ("fsspec", "remote", "gg.load('memory://bucket/run')"),
    ("rosbags", "bags", "gg.read_bag(bag)"),
])
def test_a_package_that_is_not_there_is_named_with_its_extra(package, extra, use, run, tmp_path):
    (tmp_path / "rosbag.toml").write_text('[topics]\nwrench = "/wrench"\n[defaults]\npart = "gear"\ngrip_force_n = 40\n')
    (tmp_path / "a.mcap").write_bytes(b"")
    setup = f"import sys; sys.modules[{package!r}] = None; run, bag = {str(run)!r}, {str(tmp_path / 'a.mcap')!r}\n"
    done = subprocess.run([sys.executable, "-c", f"{setup}import gripgen as gg\n{use}"], capture_output=True, text=True, check=False)
    said = done.stderr.strip().splitlines()
    assert done.returncode == 1 and f"pip install 'gripgen[{extra}]'" in said[-1], done.stderr
    assert package in done.stderr
