"""Single pulls, sweeps and the verbs of the command line, from Python."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import gripgen as gg

from .conftest import CONFIG, SMALL, command_line, content


def test_a_sweep_has_the_bytes_of_the_command_line(run, tmp_path):
    sets = [f"--set={key}={json.dumps(value)}" for key, value in SMALL.items()]
    command_line("sweep", CONFIG, "--out", tmp_path / "cli", "--quiet", *sets)
    assert content(tmp_path / "cli") == content(run)


def test_a_sweep_goes_on_where_it_stopped(run, tmp_path):
    seen = []

    def stop(done, samples):
        seen.append((done, samples))
        if done >= 1:
            raise RuntimeError("enough")

    out = tmp_path / "run"
    with pytest.raises(RuntimeError, match="enough"):
        gg.sweep(CONFIG, out, set=SMALL, jobs=1, progress=stop)
    assert seen and seen[-1][1] == 16
    again = gg.sweep(CONFIG, out, set=SMALL, jobs=1)
    assert again.complete and content(out) == content(run)
    for i in range(3):
        gg.sweep(CONFIG, tmp_path / "pieces", set=SMALL, slice=(i, 3))
    assert content(tmp_path / "pieces") == content(run)
    with pytest.raises(gg.GripgenError, match="holds another run: .*seed") as e:
        gg.sweep(CONFIG, out, set=SMALL | {"seed": 9})
    assert "another folder" in e.value.hint and content(out) == content(run)


def test_a_run_is_called_like_its_configuration(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    summary = gg.sweep(CONFIG, set=SMALL)
    assert summary.out == os.path.join("runs", "quickstart")
    assert content(tmp_path / summary.out) == content(run)


def test_a_pull_is_a_function_of_its_arguments():
    sim = gg.Sim(set={"parts.gear.scatter": 0.0, "wrist.noise_n": 0.0})
    pull = sim.pull(part="gear", grip_force_n=40.0, mu=0.2, seed=3)
    again = sim.pull(part="gear", grip_force_n=40.0, mu=0.2, seed=3)
    assert pull.status == "slipped" and (pull.images == again.images).all()
    assert pull.measured_force_n.tolist() == again.measured_force_n.tolist()
    # Two jaws hold 2 mu F_G; the staircase and the lag add up to the step that was under way.
    assert pull.max_pull_force_n == pytest.approx(2 * 0.2 * 40.0, rel=0.03)
    other = sim.pull(part="gear", grip_force_n=40.0, mu=0.2, seed=4)
    assert (pull.images != other.images).any(), "the camera has noise"


def test_many_pulls_are_single_pulls_whatever_the_threads():
    sim = gg.Sim()
    asked = [{"part": "long_shaft", "grip_force_n": float(f)} for f in (20, 30, 40, 50)]
    together = sim.pulls(asked, seed=1, threads=3)
    alone = [sim.pull(**a, seed=1, index=i) for i, a in enumerate(asked)]
    for a, b in zip(together, alone):
        assert a.max_pull_force_n == b.max_pull_force_n and (a.images == b.images).all()


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_keeps_the_pulls_that_were_made():
    code = (
        "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import gripgen as gg\n"
        "sim = gg.Sim(images=False)\n"
        "print('begun', flush=True)\n"
        "try:\n"
        "    sim.pulls([{'part': 'gear', 'grip_force_n': 30.0}] * 10**5, seed=3, threads=2)\n"
        "except KeyboardInterrupt as e:\n"
        "    kept = e.pulls\n"
        "    again = sim.pull(part='gear', grip_force_n=30.0, seed=3, index=kept[-1].index)\n"
        "    print(len(kept), again.max_pull_force_n == kept[-1].max_pull_force_n, flush=True)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ)
    assert child.stdout.readline() == "begun\n"
    time.sleep(2.0)
    child.send_signal(signal.SIGINT)
    said, _ = child.communicate(timeout=60)
    kept, same = said.split()
    assert child.returncode == 0 and 0 < int(kept) < 10**5 and same == "True", said


def test_a_url_is_no_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(gg.ConfigError, match="s3://bucket/run is a URL") as e:
        gg.sweep(CONFIG, "s3://bucket/run", set=SMALL)
    assert "gripgen.ray.sweep" in e.value.hint and not list(tmp_path.iterdir())


def test_a_pull_of_the_simulator_is_a_sample_of_a_sweep(run):
    ds = gg.load(run)
    values = ds[5].values
    sim = gg.Sim("asset:configs/twin.toml")
    keys = ("part", "grip_pose", "grip_force_n", "grip_angle_deg")
    pull = sim.pull(seed=7, index=5, **{k: values[k] for k in keys})
    assert pull.max_pull_force_n == values["max_pull_force_n"]
    assert (pull.images == ds[5].images).all()


def test_wrong_keys_say_which_there_are():
    sim = gg.Sim(images=False)
    with pytest.raises(gg.ConfigError, match="ball_bearing, gear") as e:
        sim.pull(grip_force_n=20.0)
    assert e.value.hint == "say which one is pulled"
    with pytest.raises(gg.ConfigError, match="no such key") as e:
        sim.pull(part="gear", grip_froce_n=20.0)
    assert "grip_force_n" in e.value.hint
    with pytest.raises(gg.ConfigError, match="no part `gaer`"):
        sim.pull(part="gaer", grip_force_n=20.0)
    with pytest.raises(gg.ConfigError, match="without images"):
        sim.pull(part="gear", grip_force_n=20.0, images=True)
    with pytest.raises(gg.ConfigError, match="parts.gear.mu"):
        gg.Sim(set={"parts.gear.mu": -1.0})
    with pytest.raises(gg.ConfigError, match="neither"):
        gg.Sim(mechanics="pybullet")
    with pytest.raises(gg.ConfigError, match="nowhere.toml"):
        gg.Sim("nowhere.toml")


def test_other_threads_run_while_rust_works():
    sim = gg.Sim()
    ticks, done = [0], threading.Event()

    def count():
        while not done.is_set():
            ticks[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    sim.pulls([{"part": "gear", "grip_force_n": 30.0}] * 100, threads=1)
    done.set()
    thread.join()
    # With the lock held for the whole call the counter would have seen a switch interval at most.
    assert ticks[0] > 10_000


def test_an_effect_of_the_twin_acts(tmp_path):
    plain = gg.Sim(images=False, set={"wrist.noise_n": 0.0})
    dull = gg.Sim(images=False, set={"wrist.noise_n": 0.0, "effects": [{"name": "sensor_gain", "gain": 0.8}]})
    a = plain.pull(part="gear", grip_force_n=60.0)
    b = dull.pull(part="gear", grip_force_n=60.0)
    assert b.max_pull_force_n < 0.9 * a.max_pull_force_n


def test_the_loop_is_closed_from_python(tmp_path):
    measured = tmp_path / "measured"
    command_line(
        "campaign", "--parts", "gear", "--pulls", 80, "--simulate", measured, "-o", tmp_path / "c.toml", "--quiet",
        "--set", 'effects=[{ name = "dwell_ageing", beta = 0.08 }]',
    )
    fitted = gg.calibrate(measured, tmp_path / "fitted.toml", fit=["dwell_ageing"])
    assert 0.06 < fitted.data["effects"][0]["parameters"]["beta"]["value"] < 0.1
    report = tmp_path / "report.html"
    found = gg.diagnose(measured, out=tmp_path / "found.toml", report=report)
    assert found.verdict == "effect" and found.names[0] == "dwell_ageing"
    assert report.read_text().startswith("<!doctype html>") or "<html" in report.read_text()
    before, after = gg.compare(measured), gg.compare(measured, twin=found.twin)
    assert after.rmse_n < before.rmse_n
    with pytest.raises(gg.ConfigError, match="nowhere"):
        gg.diagnose(tmp_path / "nowhere")


def test_a_pull_is_drawn():
    pytest.importorskip("matplotlib")
    figure = gg.Sim().pull(part="gear", grip_force_n=40.0).plot()
    assert len(figure.axes) == 3


def test_the_module_runs_the_command_line(tmp_path):
    import subprocess
    import sys

    done = subprocess.run(
        [sys.executable, "-m", "gripgen", "sweep", "nowhere.toml"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and "nowhere.toml" in done.stderr
