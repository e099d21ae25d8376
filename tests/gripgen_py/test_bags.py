"""Bags of ROS 1 and 2 as tables of pulls."""

import io
import random
import shutil
import tomllib

import numpy as np
import pytest

import gripgen as gg
from gripgen import bag_mapping

from .bag_lab import Bag, known, colours, lab, known_lab, read, table, trace, START_NS, STEP_NS, STORAGES, MAPPING  # noqa: E402, F401

Image = pytest.importorskip("PIL.Image")
rosbags = pytest.importorskip("rosbags")


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_is_a_table_of_the_known_pull(storage, tmp_path):
    bag = lab(tmp_path / "lab", storage=storage)
    out = tmp_path / "out"
    found = gg.read_bag(bag, out=out)
    assert found == gg.BagSummary(out, 1, 1, 1, {"slipped": 1}, ())
    (row,) = table(out)
    assert (row["pull_id"], row["part"], row["grip_force_n"], row["humidity_pct"]) == ("one", "gear", "40", "41.5")
    assert row["status"] == "slipped" and float(row["max_pull_force_n"]) == pytest.approx(8.0, abs=1e-12)
    wanted = known()
    unloaded = wanted[(wanted[:, 0] > 0.19) & (wanted[:, 0] < 0.91)]
    pulled = wanted[(wanted[:, 0] > 0.99) & (wanted[:, 3] < 6.0)]
    wanted = np.concatenate([unloaded, pulled]) - [1.0, 0, 0, 0]
    assert np.abs(trace(out, "one") - wanted).max() < 1e-9, "tared, cut at the stop, rows without a load before"
    for name, level in (("left", 35), ("right", 135), ("rest_left", 10), ("rest_right", 110)):
        pixels = np.asarray(Image.open(out / "images" / f"one_{name}.png"))
        assert (pixels == colours(level)[:, :, ::-1]).all(), "the last before the pull, and before the rest mark"
    pulls = gg.load(out)
    assert pulls.column("max_pull_force_n")[0] == pytest.approx(8.0) and pulls.image_size_px == (1, 2)
    assert tomllib.loads((out / "campaign.toml").read_text()) == {
        "force_convention": "per_jaw", "label_tolerance_n": 0.75, "stop_mm": 5.0, "label_evidence": "none", "every_reading": True,
    }


def test_a_file_a_folder_and_the_mapping_are_the_same_bag(known_lab, tmp_path):
    loose = shutil.copy(known_lab / "one/one.mcap", tmp_path / "one.mcap")
    (tmp_path / "rosbag.toml").write_text(MAPPING)
    rows = [table(gg.read_bag(path).out) for path in (known_lab, known_lab / "rosbag.toml", known_lab / "one", loose)]
    assert all(row[0]["max_pull_force_n"] == "8" or abs(float(row[0]["max_pull_force_n"]) - 8) < 1e-12 for row in rows)
    assert [row[0]["pull_id"] for row in rows] == ["lab", "lab", "one", "one"]


def test_marks_take_the_place_of_a_command(known_lab, tmp_path):
    marked = MAPPING.replace('command = "/command"\n', "") + "begin_s = 1.0\nstep_time_s = 0.1\n"
    by_topic, by_marks = gg.read_bag(known_lab), read(known_lab, tmp_path, marked)
    rows = trace(by_marks.out, "one")
    assert rows.shape == trace(by_topic.out, "lab").shape and np.abs(rows - trace(by_topic.out, "lab")).max() < 1e-9
    shutil.rmtree(tmp_path / "out")
    with pytest.raises(gg.DataError, match="none of 0 commands is above 0 N") as e:
        read(known_lab, tmp_path, marked.replace("begin_s = 1.0\n", ""))
    assert "begin_s" in e.value.hint


def test_a_staircase_may_begin_elsewhere(known_lab, tmp_path):
    marks = "begin_s = 1.0\nstep_time_s = 0.1\nforce_increment_n = 2\nforce_start_n = 5\n"
    read(known_lab, tmp_path, MAPPING.replace('command = "/command"\n', "") + marks)
    rows = trace(tmp_path / "out", "one")
    rows = rows[rows[:, 0] >= 0]
    assert np.abs(rows[:, 1] - (5 + 2 * np.floor(rows[:, 0] / 0.1 + 1e-6))).max() < 1e-9


def kinematics(joints_rad):
    """The tool of a UR5e by its Denavit-Hartenberg parameters."""
    at = np.eye(4)
    rows = [(0, 0.1625, np.pi / 2), (-0.425, 0, 0), (-0.3922, 0, 0), (0, 0.1333, np.pi / 2), (0, 0.0997, -np.pi / 2), (0, 0.0996, 0)]
    for (a, d, alpha), theta in zip(rows, joints_rad):
        s, c, sa, ca = np.sin(theta), np.cos(theta), np.sin(alpha), np.cos(alpha)
        at = at @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return at[:3, 3]


def test_joints_move_the_tool_where_there_is_no_pose(known_lab, tmp_path):
    mapping = MAPPING.replace('pose = "/pose"', 'joint_states = "/joint_states"')
    read(known_lab, tmp_path, mapping + "[motion]\nalong = [0, 0, -1]\n")
    rows, signal = trace(tmp_path / "out", "one"), known()
    rows = rows[rows[:, 0] >= 0]
    place_mm = [-1e3 * kinematics((0.1, -1.2 + 1e-3 * moved_mm, 1.5, -1.9, -1.5, 0.2))[2] for moved_mm in signal[50:, 3]]
    wanted = np.array(place_mm)[: len(rows)] - place_mm[0]
    assert np.abs(wanted).max() > 1.0 and np.abs(rows[:, 3] - wanted).max() < 1e-6


def test_without_a_pose_labels_are_used_and_traces_are_not(known_lab, tmp_path):
    found = read(known_lab, tmp_path, MAPPING.replace('pose = "/pose"\n', ""))
    assert (found.traces, found.status) == (0, {"slipped": 1}) and "motion of the tool" in found.notes[0]
    assert float(table(found.out)[0]["max_pull_force_n"]) == pytest.approx(8.0, abs=1e-12)
    assert not (found.out / "traces").exists()


def test_directions_of_force_and_pull(tmp_path):
    """A downward pull turns force and displacement; `force.along` picks the axis."""
    (tmp_path / "lab").mkdir()
    with Bag(tmp_path / "lab/down") as bag:
        for time_s, desired_n, force_n, moved_mm in known():
            ns = START_NS + round(time_s * 1e9)
            bag.wrench(ns, 0.5 + force_n)
            bag.pose(ns, 0.3 - 1e-3 * moved_mm)
            bag.wrench(ns, -desired_n, topic="/command")
    mapping = MAPPING.replace("image_left = \"/left\"\nimage_right = \"/right\"\n", "") + "pull_direction = -1\n[[pulls]]\nbag = \"down\"\n"
    (tmp_path / "lab/rosbag.toml").write_text(mapping)
    found = gg.read_bag(tmp_path / "lab")
    rows = trace(found.out, "down")
    assert rows[:, 2].max() == pytest.approx(8.0) and rows[-1, 3] == pytest.approx(5.5)
    assert table(found.out)[0]["max_pull_force_n"].startswith("8")


def test_statuses_that_were_written_down_are_believed(known_lab, tmp_path):
    found = read(known_lab, tmp_path, MAPPING + 'status = "failed"\nstatus_reason = "the part fell"\n')
    assert found.status == {"failed": 1} and found.notes == ("pull one is failed: the part fell",)


def test_a_pull_that_holds_is_censored_and_one_without_a_label_failed(known_lab, tmp_path):
    found = read(known_lab, tmp_path, MAPPING.replace("label_tolerance_n", "stop_mm = 50\nlabel_tolerance_n"))
    assert found.status == {"censored": 1}
    assert "pull one is censored: the pull ends before the slip: its largest displacement is" in found.notes[0]
    assert found.notes[0].endswith("`stop_mm` is 50 mm")
    shutil.rmtree(found.out)
    found = read(known_lab, tmp_path, MAPPING.replace("tare = true", "along = [0, 1, 0]"))
    assert found.status == {"failed": 1} and "closest 1.200 N" in found.notes[0]


def test_labels_that_their_traces_contradict_are_suspect(known_lab, tmp_path):
    found = read(known_lab, tmp_path, MAPPING.replace('label_evidence = "none"\n', ""))
    assert found.status == {"suspect": 1} and found.notes[0].startswith("pull one is suspect: ")


def test_readings_without_a_load_after_the_pull_end_its_trace(known_lab, tmp_path):
    read(known_lab, tmp_path, MAPPING + "end_s = 1.89\nno_load_after_s = [1.9, 1.97]\n")
    rows = trace(tmp_path / "out", "one")
    assert (rows[-4:, 1] == 0.0).all() and rows[-5, 1] > 0.0 and np.allclose(rows[-4:, 0], [0.90, 0.92, 0.94, 0.96])


@pytest.mark.parametrize("form", ["png", "jpeg"])
def test_compressed_images(form, tmp_path):
    pixels = np.zeros((6, 8, 3), np.uint8)
    pixels[:, 4:] = (200, 100, 50)
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, format=form, quality=95)
    (tmp_path / "lab").mkdir()
    with Bag(tmp_path / "lab/one") as bag:
        for time_s, desired_n, force_n, moved_mm in known():
            ns = START_NS + round(time_s * 1e9)
            bag.wrench(ns, -0.5 - force_n)
            bag.pose(ns, 1e-3 * moved_mm)
            bag.command(ns, desired_n)
        for jaw in ("left", "right"):
            bag.compressed(f"/{jaw}", START_NS, data.getvalue(), form)
    (tmp_path / "lab/rosbag.toml").write_text(MAPPING)
    found = gg.read_bag(tmp_path / "lab/one")
    read_back = np.asarray(Image.open(found.out / "images/one_right.png")).astype(int)
    assert np.abs(read_back - pixels).max() <= (0 if form == "png" else 60)
    assert Image.open(found.out / "images/one_left.png").format == "PNG"


FAULTS = [
    (('/wrench"', '/ft"'), "no message on `/ft`; topics: /command (std_msgs/msg/Float64)", "topics.wrench"),
    (('pose = "/pose"', 'pose = "/joint_states"'), "it is a `sensor_msgs/msg/JointState`, `geometry_msgs/msg/PoseStamped` is read", "pose"),
    (("grip_force_n = 40", "grip_force_n = -7"), "pulls[0] (`one`): `grip_force_n` is `-7`, it must be", "columns of pulls.csv"),
    (('part = "gear"\n', ""), "no pull has the key `part`", "columns"),
    (("rest_s", "begin_s = 7.0\nrest_s"), "it is from 7 to 1.98 s, the wrench from 0 to 1.98 s", "clock"),
    (("rest_s", "begin_s = 2\nend_s = 1\nrest_s"), "`end_s` is 1, it must be above `begin_s`, 2", "schema"),
    (("rest_s", "max_pull_force_n = 8\nrest_s"), "`max_pull_force_n` is taken from the readings", "schema"),
    (("tare = true", "along = [0, 0, 2]"), "of length 2, it must be 1", "schema"),
    (("no_load_s = [0.2, 0.9]\n", ""), "no reading to take off", "no_load_s"),
    (("[0.2, 0.9]", "[0.2, 1.5]"), "reaches 1.5 s, the pull begins at 1 s", "before"),
    (("[0.2, 0.9]", "[0.9, 0.2]"), "`no_load_s` is from 0.9 to 0.2 s, it must rise", "schema"),
    (("[topics]", "[topic]"), "unknown key `topic`", "schema"),
    (("pose =", "pos ="), "unknown key `topics.pos`", "schema"),
    (("[force]\ntare = true", "[force]\ntare = 1"), "`force.tare` is 1, it must be true or false", "schema"),
    (("0.75", "nan"), "`label_tolerance_n` is nan, it must be a number above 0", "schema"),
    (('"none"', '"some"'), "`campaign.label_evidence` is 'some', it must be `trace` or `none`", "schema"),
    (('"/command"', '"/wrench"'), "`topics.wrench` and `topics.command` are both `/wrench`", "schema"),
    (("rest_s", 'pull_direction = "left"\nrest_s'), "`pull_direction` is `left`, it must be 1 or -1", "1 is up"),
    (("rest_s", "begin_s = true\nrest_s"), "`pulls[0].begin_s` is True, it must be a number", "schema"),
    (("rest_s", "more = [1]\nrest_s"), "`more` is [1], it must be a number or a word", "schema"),
    (("[topics]", "[topics"), "rosbag.toml: ", "schema"),
    (('pose = "/pose"', 'joint_states = "/joint_states"\n[motion]\njoints = ["a", "b", "c", "d", "e", "f"]\n[nothing]'), "unknown key", "schema"),
]


@pytest.mark.parametrize("change, problem, hint", FAULTS)
def test_faults_name_the_file_the_numbers_and_what_to_do(change, problem, hint, known_lab, tmp_path):
    assert change[0] in MAPPING
    with pytest.raises(gg.GripgenError) as e:
        read(known_lab, tmp_path, MAPPING.replace(*change, 1))
    assert problem in str(e.value) and hint in e.value.hint, str(e.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["rosbag.toml"], "nothing half is left"


def test_faults_of_joints_and_steps(known_lab, tmp_path):
    mapping = MAPPING.replace('pose = "/pose"\n', 'joint_states = "/joint_states"\n')
    with pytest.raises(gg.DataError, match="no message has the joints a, b, c, d, e, f; there are elbow_joint, "):
        read(known_lab, tmp_path, mapping + '[motion]\njoints = ["a", "b", "c", "d", "e", "f"]\n')
    unmarked = MAPPING.replace('command = "/command"\n', "") + "begin_s = 1\n"
    for key, problem in (("step_time_s = 0", "it must be a number above 0"), ('step_time_s = "x"', "must be a number"), ("step_time_s = 1e-9", "at most 1000000")):
        with pytest.raises(gg.DataError, match=problem):
            read(known_lab, tmp_path, unmarked + key + "\n")


def test_a_bag_without_a_mapping_is_described(known_lab, tmp_path):
    bag = shutil.copytree(known_lab / "one", tmp_path / "one")
    with pytest.raises(gg.ConfigError, match="rosbag.toml: a bag needs this file") as e:
        gg.read_bag(bag)
    assert "/pose (geometry_msgs/msg/PoseStamped)" in str(e.value) and 'wrench = "/wrench"' in e.value.hint
    for path in (tmp_path, tmp_path / "missing", known_lab / "one/metadata.yaml"):
        with pytest.raises(gg.ConfigError):
            gg.read_bag(path)


def test_clocks(known_lab, tmp_path):
    """The stamp counts or the time of recording; of stamps that are none the other is named."""
    def written(name, stamp):
        with Bag(tmp_path / name) as bag:
            for i, (time_s, desired_n, force_n, moved_mm) in enumerate(known()):
                ns = START_NS + round(time_s * 1e9)
                bag.wrench(ns, -0.5 - force_n, stamp_ns=stamp(i, ns))
                bag.pose(ns, 1e-3 * moved_mm)
                bag.command(ns, desired_n)
        return tmp_path / name

    plain = MAPPING.replace('image_left = "/left"\nimage_right = "/right"\n', "")
    (tmp_path / "rosbag.toml").write_text(plain)
    (tmp_path / "log.toml").write_text('clock = "log"\n' + plain)
    for name, stamp, problem in (
        ("unset", lambda i, ns: 0, "100 of 100 messages have the same stamp, 0 s"),
        ("stuck", lambda i, ns: min(ns, START_NS + 40 * STEP_NS), "60 of 100 messages have the same stamp"),
        ("back", lambda i, ns: ns - (10**9 if i > 60 else 0), "its clock goes back by 0.98 s at message 62 of 100"),
        ("ahead", lambda i, ns: ns + 10**12, "it is from -999 to 1.98 s, the wrench from 0 to 1.98 s"),
    ):
        bag = written(name, stamp)
        with pytest.raises(gg.DataError, match=problem) as e:
            gg.read_bag(bag)
        assert "log" in e.value.hint
        found = gg.read_bag(bag, tmp_path / "log.toml")
        assert abs(float(table(found.out)[0]["max_pull_force_n"]) - 8) < 1e-12


def test_a_pose_of_another_time_is_no_motion(tmp_path):
    with Bag(tmp_path / "one") as bag:
        for time_s, desired_n, force_n, moved_mm in known():
            ns = START_NS + round(time_s * 1e9)
            bag.wrench(ns, -0.5 - force_n)
            bag.pose(ns + 10**10, 1e-3 * moved_mm)
            bag.command(ns, desired_n)
    (tmp_path / "rosbag.toml").write_text(MAPPING.replace('image_left = "/left"\nimage_right = "/right"\n', ""))
    with pytest.raises(gg.DataError, match="`/pose` is from 10 to 11.98 s, the pull from 1 to 1.98 s"):
        gg.read_bag(tmp_path / "one")


def test_several_pulls_of_a_bag(tmp_path):
    """Two staircases without marks are a question; `from_s`, and begin and end, tell them apart."""
    second_s = 5.0
    with Bag(tmp_path / "day", "sqlite3") as bag:
        for start_s in (0.0, second_s):
            for time_s, desired_n, force_n, moved_mm in known():
                ns = START_NS + round((start_s + time_s) * 1e9)
                bag.wrench(ns, -0.5 - force_n)
                bag.pose(ns, 1e-3 * moved_mm)
                bag.command(ns, desired_n)
            bag.command(START_NS + round((start_s + 1.99) * 1e9), 0.0)
    plain = MAPPING.replace('image_left = "/left"\nimage_right = "/right"\n', "").replace("no_load_s = [0.2, 0.9]\n", "")
    plain = plain.replace("tare = true", "tare = false")

    def told(text):
        (tmp_path / "rosbag.toml").write_text(plain + text)
        return gg.read_bag(tmp_path / "day")

    with pytest.raises(gg.DataError, match="falls back at .* and rises again at 6 s: 2 staircases") as e:
        told("")
    assert "`[[pulls]]`" in e.value.hint
    with pytest.raises(gg.DataError, match="it begins at 1 s, and so does pulls.0."):
        told("[[pulls]]\n[[pulls]]\n")
    with pytest.raises(gg.DataError, match="rises again at 6 s"):
        told("[[pulls]]\nbegin_s = 1\nend_s = 6.9\n")
    found = told("[[pulls]]\nfrom_s = 0\n[[pulls]]\nfrom_s = 3\n")
    assert [row["pull_id"] for row in table(found.out)] == ["day-1", "day-2"]
    a, b = trace(found.out, "day-1"), trace(found.out, "day-2")
    assert np.abs(a - b).max() < 1e-9 and a[-1, 3] == pytest.approx(5.5)
    found = told('[[pulls]]\npull_id = "a"\nbegin_s = 1\nend_s = 1.9\n[[pulls]]\npull_id = "b"\nbegin_s = 6\n')
    assert len(trace(found.out, "a")) == 46 and found.notes == ()
    found = told("[[pulls]]\nbegin_s = 1\nend_s = 1.9\n")
    assert len(found.notes) == 1 and "the command rises at 6 s too, in no pull" in found.notes[0], found.notes
    for ids, problem in (('"a/b"', "it must be a name without"), ('"x"\n[[pulls]]\npull_id = "x"\nfrom_s = 3', "are both pull `x`")):
        with pytest.raises(gg.ConfigError, match=problem):
            told(f"[[pulls]]\nfrom_s = 0\npull_id = {ids}\n")


def test_a_folder_of_loose_recordings_is_a_question(known_lab, tmp_path):
    for name in ("a", "b"):
        shutil.copy(known_lab / "one/one.mcap", tmp_path / f"{name}.mcap")
    (tmp_path / "rosbag.toml").write_text(MAPPING)
    with pytest.raises(gg.DataError, match="there are 2 recordings and none is named: a.mcap, b.mcap"):
        gg.read_bag(tmp_path)
    (tmp_path / "rosbag.toml").write_text(MAPPING + '[[pulls]]\nbag = "a.mcap"\n[[pulls]]\nbag = "b.mcap"\n')
    assert [row["pull_id"] for row in table(gg.read_bag(tmp_path).out)] == ["a", "b"]
    (tmp_path / "rosbag.toml").write_text(MAPPING + '[[pulls]]\nbag = "c.mcap"\n')
    with pytest.raises(gg.DataError, match="c.mcap: there is no such bag"):
        gg.read_bag(tmp_path)


def test_recordings_that_are_not_read_are_named(known_lab, tmp_path):
    for name in ("monday", "tuesday"):
        shutil.copytree(known_lab / "one", tmp_path / name)
    shutil.copy(known_lab / "one/one.mcap", tmp_path / "loose.mcap")
    (tmp_path / "packed.mcap.zstd").write_bytes(b"")
    (tmp_path / "rosbag.toml").write_text(MAPPING + '[[pulls]]\nbag = "monday"\n')
    found = gg.read_bag(tmp_path)
    assert found.pulls == 1 and len(found.notes) == 1
    assert "loose.mcap, packed.mcap.zstd, tuesday: named by no pull, not read" in found.notes[0]
    assert gg.read_bag(tmp_path / "monday").notes == (), "one bag was asked for"
    shutil.copy(known_lab / "one/one.mcap", tmp_path / "monday/one_1.mcap")
    found = gg.read_bag(tmp_path / "rosbag.toml")
    assert len(found.notes) == 2 and "monday: one_1.mcap: not in its metadata.yaml, not read" in found.notes[1]
    # A file that metadata.yaml names and that is not there is an error.
    (tmp_path / "monday/one.mcap").unlink()
    with pytest.raises(gg.DataError, match="monday.*one.mcap"):
        gg.read_bag(tmp_path)


@pytest.mark.parametrize("storage", ["ros1", "sqlite3", "mcap"])
def test_damaged_bags_are_refused_or_read(storage, tmp_path):
    """Bags of `rosbags` have no checksums, so that a value may change; what is cut off is always found."""
    mapping = MAPPING.replace('image_left = "/left"\nimage_right = "/right"\n', "")
    bag = lab(tmp_path / "lab", mapping, storage)
    file = bag if storage == "ros1" else next(p for p in bag.iterdir() if p.suffix in (".mcap", ".db3"))
    whole, chance = file.read_bytes(), random.Random(7)
    refused, rounds = 0, 60
    for i in range(rounds):
        if i % 3:
            damaged = bytearray(whole)
            damaged[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        else:
            damaged = whole[: chance.randrange(len(whole))]
        file.write_bytes(damaged)
        try:
            gg.read_bag(bag, out=tmp_path / f"out-{i}")
        except gg.GripgenError as e:
            assert e.hint and file.name.split(".")[0] in str(e)
            refused += 1
        else:
            assert i % 3, "what is cut off is refused"
    print(f"{storage}: {refused} of {rounds} refused")


def test_changed_mappings_are_refused_or_read(known_lab, tmp_path):
    chance = random.Random(3)
    words = ["nan", "-1", "1e999", '""', "[]", "{}", "true", "[[pulls]]", "0", "inf", "=", '"/wrench"', "99999999999999999999"]
    taken = 0
    for i in range(300):
        tokens = MAPPING.split(" ")
        for _ in range(chance.randint(1, 3)):
            at = chance.randrange(len(tokens))
            tokens[at] = chance.choice([chance.choice(words), tokens[at][::-1], "", tokens[at] * 2])
        path = tmp_path / "rosbag.toml"
        path.write_text(" ".join(tokens))
        try:
            bag_mapping.read_mapping(path, known_lab / "one")
            taken += 1
        except gg.ConfigError as e:
            assert "rosbag.toml" in str(e)
    assert 0 < taken < 300
