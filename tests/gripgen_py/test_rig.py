"""A rig from Python: checked, rehearsed and pulled on the virtual rig."""

import subprocess
import sys
from collections import Counter

import pytest

import gripgen as gg

COMMAND = [sys.executable, "-m", "gripgen", "rig"]


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A virtual rig whose clock waits for its client, and the file that finds it."""
    file = tmp_path_factory.mktemp("rig") / "rig.toml"
    serve = [*COMMAND, "serve", "--any-ports", "-q", "--speed", "20", "--in-step", "--write-rig", file]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as rig:
        try:
            assert rig.stdout.readline().startswith("ready")
            yield file
        finally:
            rig.terminate()


def test_a_rig_that_answers_is_all_right(served):
    lines = gg.rig.check(served)
    assert all(line.ok for line in lines), lines
    assert {"RTDE", "gripper", "programs"} <= {line.what for line in lines}
    # A device that is not there is a line, and no exception.
    lost = {line.what: line for line in gg.rig.check(served, set={"gripper.port": 1})}
    assert not lost["gripper"].ok and "127.0.0.1:1" in lost["gripper"].found


def test_pulls_are_recorded_and_told(served, tmp_path):
    events = []
    run = gg.rig.pull(
        served, tmp_path / "run", parts=["gear"], grip_force_n=[25], repetitions=2, on_event=events.append
    )
    assert run.complete and run.failed == 0
    counts = Counter(event["event"] for event in events)
    assert counts["pull_started"] == counts["pull_finished"] == 2
    assert counts["images"] == 4 and counts["reading"] > 100 and counts["stopped"] == 0
    made = [event for event in events if event["event"] == "pull_finished"]
    assert [event["index"] for event in made] == [0, 1]
    ds = gg.load(run.out)
    assert len(ds) == 2
    assert list(ds.table()["max_pull_force_n"]) == pytest.approx([event["max_pull_force_n"] for event in made])
    # Nothing is left to make.
    again = gg.rig.pull(served, tmp_path / "run", parts=["gear"], grip_force_n=[25], repetitions=2)
    assert again == run


def test_a_rehearsal_is_a_file(served, tmp_path):
    steps = []
    out = tmp_path / "rehearsal.json"
    found = gg.rig.rehearse(served, out, part="gear", dwell_s=1.0, on_event=steps.append)
    assert found["schema"] == "gripgen.rigrehearsal/1" and found["rehearsal"]["part"] == "gear"
    assert any(event.get("step") == "pulling air" for event in steps)
    lines = {line.what: line for line in gg.rig.check(served, rehearsal=out)}
    assert lines["rehearsal"].ok
    with pytest.raises(FileExistsError):
        gg.rig.rehearse(served, out)


def test_what_stops_a_rig_is_an_exception(served, tmp_path):
    with pytest.raises(gg.ConfigError, match="120 N") as refused:
        gg.rig.pull(served, tmp_path / "run", parts=["gear"], grip_force_n=[60])
    assert "nothing was sent" in refused.value.hint
    with pytest.raises(gg.GripgenError, match="RTDE"):
        gg.rig.pull(served, tmp_path / "run", parts=["gear"], set={"robot.rtde_port": 1})

    class GoneError(Exception):
        pass

    def leave(event):
        if event["event"] == "reading":
            raise GoneError

    # The exception of a caller stops the rig safely first: the pull failed, and is made by the next call.
    with pytest.raises(GoneError):
        gg.rig.pull(served, tmp_path / "left", parts=["gear"], grip_force_n=[25], on_event=leave)
    run = gg.rig.pull(served, tmp_path / "left", parts=["gear"], grip_force_n=[25])
    assert run.complete
    kept = (tmp_path / "left/failed/shard-00000-1.json").read_text()
    assert "interrupted" in kept
