"""`gripgen import`, bags that others reported, and bags against the native files of the same pulls."""

import csv
import io
import json
import os
import shutil
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import gripgen as gg
from gripgen import _core, bag_mapping

from .bag_lab import Bag, lab, known_lab, table, trace, imported, binary, ROOT, REPORTS, START_NS, STORAGES  # noqa: E402, F401

Image = pytest.importorskip("PIL.Image")
rosbags = pytest.importorskip("rosbags")


def test_the_example_of_the_page_is_a_mapping():
    text = (ROOT / "docs/interop.md").read_text().split("```toml\n", 1)[1].split("```", 1)[0]
    found = bag_mapping._parsed(Path("lab/rosbag.toml"), text, Path("lab"))
    assert found.topics.pose == "/tcp_pose_broadcaster/pose"
    assert [pull.id for pull in found.pulls] == ["pull_01", "pull_02"]
    assert found.pulls[1].bag == Path("lab/monday/pull_02") and found.pulls[1].marks.no_load_s == (0.5, 1.5)
    assert found.pulls[0].marks.text("humidity_pct") == "41"


def test_the_schema_has_the_keys_that_are_read():
    schema = json.loads(binary("schema", "rosbag").stdout)
    parts = {"BagTopics": bag_mapping.Topics, "BagForce": bag_mapping.Force, "BagMotion": bag_mapping.Motion}
    parts |= {"BagPull": bag_mapping.Marks, "CampaignHeader": bag_mapping.Campaign}
    for name, kind in parts.items():
        assert set(schema["$defs"][name]["properties"]) == {f.name for f in fields(kind)} - {"columns"}, name
    assert set(schema["properties"]) == {"clock", "campaign", "topics", "force", "motion", "defaults", "pulls"}


def test_the_command_line_of_the_wheel(known_lab, tmp_path):
    out, answer = tmp_path / "pulls", tmp_path / "answer.json"
    done = imported(known_lab, "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["schema"] == "gripgen.import/1" and said["status"] == {"slipped": 1} and said["out"] == str(out)
    assert "1 of 1 bags" in done.stderr and "1 pull (1 slipped), 1 with a trace, 1 with images" in done.stderr
    before = (out / "pulls.csv").read_bytes()
    again = imported(known_lab, "-o", out)
    assert again.returncode == 2 and "it is there already" in again.stderr and "hint: `force`" in again.stderr
    (out / "traces/old.csv").write_text("x")
    (out / "notes.txt").write_text("kept")
    done = imported(known_lab, "-o", out, "--force", "-q", "--json", answer)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert json.loads(answer.read_text()) == said and (out / "pulls.csv").read_bytes() == before
    assert not (out / "traces/old.csv").exists() and (out / "notes.txt").exists()
    assert imported(known_lab, "-o", tmp_path / "more", "--json", answer).returncode == 2 and not (tmp_path / "more").exists()
    for arguments, problem in (
        ((), "required"),
        ((known_lab,), "required"),
        ((tmp_path / "none", "-o", tmp_path / "x"), "there is no such file or folder"),
        ((known_lab, "-o", known_lab, "--force"), "the bags are in this folder"),
        ((known_lab, "-o", answer, "--force"), "this is a file"),
        ((known_lab, "-o", tmp_path / "x", "--force", "--json", known_lab / "one/one.mcap"), "it belongs to the bags"),
        ((known_lab, "-o", ROOT / "assets/campaigns/example", "--force"), "was not made of bags"),
    ):
        done = imported(*arguments)
        assert done.returncode == 2 and problem in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert imported("--help").stdout.startswith("usage: gripgen import")
    if os.geteuid() != 0:
        os.chmod(tmp_path, 0o500)
        assert imported(known_lab, "-o", tmp_path / "y").returncode == 1


def test_without_rosbags_the_command_to_install_it_is_said(known_lab, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(gg.DataError, match="reading bags needs rosbags") as e:
        gg.read_bag(known_lab, out=tmp_path / "out")
    assert e.value.hint == "pip install 'gripgen[bags]'"


def test_the_binary_says_who_reads_bags(known_lab, tmp_path):
    twin = tmp_path / "twin.toml"
    loose = known_lab / "one/one.mcap"
    for arguments in (
        ("import", known_lab, "-o", tmp_path / "out"),
        ("import",),
        ("info", known_lab),
        ("diagnose", known_lab),
        ("diagnose", known_lab / "rosbag.toml"),
        ("compare", known_lab / "one"),
        ("compare", loose),
        ("calibrate", "pulls", known_lab, "-o", twin),
    ):
        done = binary(*arguments)
        assert done.returncode == 2 and "hint: `pip install 'gripgen[bags]'`" in done.stderr, (arguments, done.stderr)
    assert not twin.exists()
    with pytest.raises(gg.ConfigError, match="Python package"):
        gg.diagnose(known_lab)


reported = pytest.mark.skipif(not REPORTS.is_dir(), reason="the folder of shared reports is not next to the checkout")


@reported
@pytest.mark.parametrize("name, problem, hint", [
    ("13-folder-of-bags-one-is-used/b12_loose_mcaps_no_pulls", "there are 3 recordings and none is named", "`[[pulls]]`"),
    ("13-folder-of-bags-one-is-used/b12b_two_pulls_one_bag_no_marks", "rises again at 32.0", "`from_s`"),
    ("23-bag-unclear/b26_clock_jump_back", "its clock goes back by 0.995 s", 'clock = "log"'),
    ("23-bag-unclear/b28_command_wrench_unstamped", "have the same stamp, 0 s", 'clock = "log"'),
])
def test_reported_bags_that_are_not_clear_are_refused(name, problem, hint):
    with pytest.raises(gg.DataError) as e:
        gg.read_bag(REPORTS / name)
    assert problem in str(e.value) and hint in e.value.hint


@reported
def test_reported_bags_that_can_be_read(tmp_path):
    """Messages that are compressed one by one, and the unclear bags once their mapping says what is meant."""
    assert gg.read_bag(REPORTS / "23-bag-unclear/b03_message_zstd").pulls == 1
    loose = shutil.copy(REPORTS / "23-bag-unclear/b03_message_zstd/p0/p0.mcap", tmp_path / "p0.mcap")
    folder = REPORTS / "13-folder-of-bags-one-is-used/b12b_two_pulls_one_bag_no_marks"
    text = (folder / "rosbag.toml").read_text()
    (tmp_path / "rosbag.toml").write_text(text.split("[[pulls]]")[0].replace("[defaults]", "[defaults]\ngrip_force_n = 20.0"))
    with pytest.raises(gg.DataError, match="compressed one by one"):
        gg.read_bag(loose)
    marked = f'[[pulls]]\nbag = "{folder}/p0"\ngrip_force_n = 20.0\n'
    second = marked + "from_s = 10\nno_load_s = [28.5, 30]\n"
    (tmp_path / "rosbag.toml").write_text(text.split("[[pulls]]")[0] + marked + "from_s = 0\n" + second)
    found = gg.read_bag(tmp_path / "rosbag.toml")
    assert found.pulls == 2
    for name in ("b26_clock_jump_back", "b28_command_wrench_unstamped"):
        text = (REPORTS / "23-bag-unclear" / name / "rosbag.toml").read_text()
        text = text.replace('bag = "p0"', f'bag = "{REPORTS / "23-bag-unclear" / name / "p0"}"')
        (tmp_path / "rosbag.toml").write_text('clock = "log"\n' + text)
        found = gg.read_bag(tmp_path / "rosbag.toml")
        assert found.pulls == 1 and float(table(found.out)[0]["max_pull_force_n"]) > 0


# The same pulls as bags and as the native files of a run: one label, one fit, one verdict.

PULLS = 50
LAW = 'effects=[{name="dwell_ageing", beta=0.05}]'
COVARIATES = [
    "grip_force_n", "force_increment_n", "step_time_s", "dwell_s", "pull_index", "time_s", "temperature_c", "grip_offset_mm",
    "grip_angle_deg", "pull_direction", "gel_id", "session",
]
SWEEP = """twin = "asset:configs/twin-baseline.toml"
samples = 50
seed = 11
mechanics = "reduced"
images = "none"
trace = "full"
shard_samples = 25
[vary]
part = ["gear"]
grip_force_n = { uniform = [12, 60] }
dwell_s = { log_uniform = [1, 100] }
"""
TOPICS = """[campaign]
feedback = "measured"
[topics]
wrench = "/wrench"
command = "/command"
pose = "/pose"
"""


def ran(*arguments):
    done = binary(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def samples(run):
    """Rows of the index, and traces, of a run."""
    with open(run / "index.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    values, lengths = _core.Dataset(run).traces(list(range(len(rows))))
    return rows, [values[i, : lengths[i]] for i in range(len(rows))]


def write_pull(bag, start_ns, rows):
    for time_s, desired_n, measured_n, moved_mm in rows.astype(np.float64):
        ns = start_ns + round(time_s * 1e9)
        bag.wrench(ns + 300_000, -measured_n, stamp_ns=ns)
        bag.pose(ns, 1e-3 * moved_mm)
        bag.command(ns, desired_n)


def entry(row, **more):
    """The columns of a pull as keys; words that look like numbers are words."""
    words = ("gel_id", "session")
    cells = {name: row[name] if name in words else float(row[name]) for name in COVARIATES if row[name] != ""}
    cells |= {name: int(cells[name]) for name in ("pull_direction", "pull_index")}
    return "[[pulls]]\n" + "".join(f"{name} = {json.dumps(value)}\n" for name, value in (cells | more).items())


def unloaded(rows, origin_s):
    """The readings before time 0, in seconds of the bag; `origin_s` is the start of the pull."""
    before = rows[rows[:, 0] < 0, 0].astype(np.float64)
    return {"no_load_s": [origin_s + before[0] - 1e-4, origin_s + before[-1] + 1e-4]} if len(before) else {}


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    """A run of 50 virtual pulls, its rows and its traces."""
    folder = tmp_path_factory.mktemp("native")
    (folder / "sweep.toml").write_text(SWEEP)
    ran("sweep", folder / "sweep.toml", "-o", folder / "run", "--set", LAW)
    rows, traces = samples(folder / "run")
    assert len(rows) == len(traces) == PULLS and {row["status"] for row in rows} == {"slipped"}
    # Stored times are float32: a tick that is a hair before the start of a step would belong to the step before.
    traces = [np.column_stack([np.round(t[:, 0].astype(float), 6), t[:, 1:].astype(float)]) for t in traces]
    return folder / "run", rows, traces


@pytest.fixture(scope="module")
def many(native, tmp_path_factory):
    """The same pulls, a bag each, of every storage."""
    _, rows, traces = native
    folder, text = tmp_path_factory.mktemp("bags"), TOPICS
    for i, (row, trace) in enumerate(zip(rows, traces)):
        storage = [*STORAGES, "chunk_zstd"][i % 6]
        name = f"pull_{i:03d}" + (".bag" if storage == "ros1" else "")
        with Bag(folder / name, storage) as bag:
            write_pull(bag, START_NS + i * 60 * 10**9, trace)
        text += entry(row, bag=name, part="gear", **unloaded(trace, -float(trace[0, 0])))
    (folder / "rosbag.toml").write_text(text)
    return gg.read_bag(folder, out=folder.with_name("bags-pulls"))


@pytest.fixture(scope="module")
def one(native, tmp_path_factory):
    """All of them in one bag, marked by time."""
    _, rows, traces = native
    folder, text, at_ns = tmp_path_factory.mktemp("one_bag") / "day", TOPICS.replace('command = "/command"\n', ""), 0
    with Bag(folder, "chunk_zstd") as bag:
        for row, trace in zip(rows, traces):
            write_pull(bag, START_NS + at_ns, trace)
            origin_s = at_ns * 1e-9 - float(traces[0][0, 0])
            marks = {"begin_s": round(origin_s, 9), "end_s": origin_s + float(trace[-1, 0]) + 1e-4}
            text += entry(row, part="gear", **marks, **unloaded(trace, origin_s))
            at_ns += round(float(trace[-1, 0]) * 1e9) + 3 * 10**9
    (folder / "rosbag.toml").write_text(text)
    return gg.read_bag(folder, out=folder.with_name("day-pulls"))


def test_labels_are_those_of_the_native_files(native, many, one):
    _, rows, _ = native
    for found in (many, one):
        assert found.status == {"slipped": PULLS} and found.traces == PULLS
        apart = [abs(float(a["max_pull_force_n"]) - float(b["max_pull_force_n"])) for a, b in zip(table(found.out), rows)]
        # Traces of a run are float32, labels are not.
        assert max(apart) < 1e-5


def diagnosis(path):
    return json.loads(ran("diagnose", path, "--twin", "asset:configs/twin-baseline.toml", "--json"))


def test_the_verdict_is_that_of_the_native_files(native, many, one):
    wanted = diagnosis(native[0])
    assert wanted["verdict"] == "effect" and [e["name"] for e in wanted["effects"]] == ["dwell_ageing"]
    for path in (many.out, one.out):
        found = diagnosis(path)
        assert found["data"]["pulls"] == wanted["data"]["pulls"] == PULLS
        assert found["data"]["traces"] == wanted["data"]["traces"], "one reading each 10 ms of some pulls, as of a run"
        assert found["verdict"] == wanted["verdict"]
        assert [e["name"] for e in found["effects"]] == [e["name"] for e in wanted["effects"]]
        for when in ("before", "after"):
            a, b = found["error"][when]["rmse_n"], wanted["error"][when]["rmse_n"]
            assert abs(a - b) < 1e-3 * b


def test_calibrate_and_compare_read_the_table(native, many, tmp_path):
    errors = []
    for name, path in (("run", native[0]), ("bags", many.out)):
        out = tmp_path / f"{name}.toml"
        ran("calibrate", "pulls", path, "-o", out)
        errors.append(json.loads(ran("compare", path, "--twin", out, "--json"))["pulls"])
    assert errors[0]["n"] == errors[1]["n"] == PULLS
    assert abs(errors[0]["rmse_n"] - errors[1]["rmse_n"]) < 0.02 * errors[0]["rmse_n"]


def test_images_are_compared(tmp_path):
    """The image of the twin itself, raw and as PNG, is what the twin expects."""
    sweep = SWEEP.replace("samples = 50", "samples = 2").replace('images = "none"', 'images = "png"')
    (tmp_path / "sweep.toml").write_text(sweep)
    ran("sweep", tmp_path / "sweep.toml", "-o", tmp_path / "run")
    (rows, traces), images = samples(tmp_path / "run"), gg.load(tmp_path / "run").batch([0, 1])[0]
    (tmp_path / "seen").mkdir()
    text = TOPICS + 'image_left = "/left"\nimage_right = "/right"\n'
    for i, (row, trace) in enumerate(zip(rows, traces)):
        start = START_NS + i * 60 * 10**9
        png = io.BytesIO()
        Image.fromarray(images[i, 0]).save(png, format="png")
        with Bag(tmp_path / f"seen/p{i}") as bag:
            bag.compressed("/left", start - 10**8, png.getvalue())
            bag.image("/right", start - 10**8, images[i, 1][:, :, ::-1])
            write_pull(bag, start, trace)
        text += entry(row, bag=f"p{i}", part="gear", **unloaded(trace, -float(trace[0, 0])))
    (tmp_path / "seen/rosbag.toml").write_text(text)
    found = gg.read_bag(tmp_path / "seen", out=tmp_path / "pulls")
    assert found.images == 2
    twin = "asset:configs/twin-baseline.toml"
    both = [json.loads(ran("compare", path, "--twin", twin, "--json"))["images"] for path in (tmp_path / "run", found.out)]
    assert both[0]["n"] == both[1]["n"] == 4
    assert abs(both[0]["mse"] - both[1]["mse"]) < 1e-9 and both[1]["ssim"] == pytest.approx(both[0]["ssim"])
