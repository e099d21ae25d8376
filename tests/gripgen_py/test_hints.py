"""Hints speak of the keywords of Python's calls, not of options of the command line."""

import re
from pathlib import Path

import numpy as np
import pytest

import gripgen as gg

from .conftest import CONFIG, SMALL, content

ASSETS = Path(__file__).parents[2] / "assets"
SENSOR = "asset:sensors/gelsight_synthetic/sensor.npz"


def hint_of(call, *arguments, **keywords):
    """What an exception says to do, which its text says too."""
    with pytest.raises(gg.GripgenError) as e:
        call(*arguments, **keywords)
    assert str(e.value).endswith(f"hint: {e.value.hint}")
    assert "--" not in e.value.hint, e.value.hint
    return e.value.hint


@pytest.mark.parametrize("call", [gg.diagnose, gg.calibrate])
def test_a_file_that_exists_is_replaced_with_force(call, tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text("mine")
    hint = hint_of(call, ASSETS / "campaigns/example", out=mine)
    assert hint == "`force=True` replaces it"
    assert mine.read_text() == "mine"


def test_another_folder_is_named_with_out(run):
    before = content(run)
    assert "another folder with `out=`; nothing" in hint_of(gg.sweep, CONFIG, run, set={**SMALL, "seed": 9})
    assert content(run) == before


def test_a_value_of_set_can_be_copied_from_the_hint():
    hint = hint_of(gg.Sim, images=False, set={"effects.wear.depth": 0.2})
    said = re.search(r"`(set=.*)`", hint)[1]
    assert said == """set={"effects": '[{name="wear", depth=0.1}]'}"""
    worn = gg.Sim(images=False, **eval(f"dict({said})"))
    plain = gg.Sim(images=False)
    late = {"part": "gear", "grip_force_n": 40.0, "pull_index": 5000.0}
    labels = [sim.pull(**late, trace=False).max_pull_force_n for sim in (worn, plain)]
    assert labels[0] != labels[1], "the effect acts"


def test_lengths_and_places_are_those_of_render():
    part = ASSETS / "parts/gear/part.stl"
    assert hint_of(gg.render, part, sensor=SENSOR) == "`depth_mm=0.5`, say"
    beside = hint_of(gg.render, part, sensor=SENSOR, depth_mm=0.5, x_px=-900.0)
    for keyword in ("`x_px=` and `y_px=` are the place", "`scale_mm_per_unit=` is the size"):
        assert keyword in beside
    deep = hint_of(gg.render, np.full((240, 320), 11.0), sensor=SENSOR)
    assert "`scale_mm_per_unit=`" in deep


def test_what_python_itself_refuses_has_its_hint_too(run):
    sim = gg.Sim(images=False)
    said = hint_of(lambda: sim.pull(mu=0.2, grip_force_n=20)).split(" ")[0]
    assert sim.pull(mu=0.2, grip_force_n=20, part=said.split("'")[1]).status == "slipped", said
    assert "during_pull" in hint_of(gg.load, run, video=True)
    assert 'images = "clean"' in hint_of(gg.load, run, noise="off")
    for rank, world_size in ((2, 2), (-1, 2), (0, 0)):
        assert "world_size=2" in hint_of(lambda: next(gg.load(run).iterate(rank=rank, world_size=world_size)))
        assert "world_size=2" in hint_of(gg.stream, CONFIG, rank=rank, world_size=world_size)
    with pytest.raises(gg.DataError, match="no column 'colour'") as e:
        gg.load(run).column("colour")
    assert e.value.hint is None, "nothing to say is said by no hint, not by none of the attribute"


def test_commands_for_a_shell_stay_as_they_are(tmp_path):
    assert "`gripgen calibrate presses`" in hint_of(gg.render, np.zeros((240, 320)), sensor=tmp_path / "none.npz")
