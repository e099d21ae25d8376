"""Bags of ROS 1 and 2, written here by `rosbags` with a signal that is known, and bags that others reported."""

import csv
import io
import json
import os
import random
import shutil
import subprocess
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import gripgen as gg
from gripgen import _core, bag_mapping

rosbags = pytest.importorskip("rosbags")
Image = pytest.importorskip("PIL.Image")
from rosbags import rosbag1, rosbag2  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

ROOT = Path(__file__).parents[2]
REPORTS = ROOT.parent / "shared/reports"
START_NS, STEP_NS = 1_700_000_000_000_000_000, 20_000_000
STORAGES = ["ros1", "sqlite3", "mcap", "message_zstd", "file_zstd"]
JOINTS = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
MAPPING = """[campaign]
label_tolerance_n = 0.75
label_evidence = "none"
[topics]
wrench = "/wrench"
command = "/command"
pose = "/pose"
image_left = "/left"
image_right = "/right"
[force]
tare = true
[defaults]
part = "gear"
grip_force_n = 40
humidity_pct = 41.5
no_load_s = [0.2, 0.9]
rest_s = 0.5
"""


class Bag:
    """A bag that is being written."""

    def __init__(self, path, storage="mcap"):
        self.is1, self.topics = storage == "ros1", {}
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is1 else Stores.ROS2_HUMBLE)
        if self.is1:
            self.writer = rosbag1.Writer(path)
        else:
            plugin = rosbag2.StoragePlugin.SQLITE3 if storage == "sqlite3" else rosbag2.StoragePlugin.MCAP
            self.writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
            if storage.endswith("zstd"):
                mode = {"message_zstd": "MESSAGE", "file_zstd": "FILE", "chunk_zstd": "STORAGE"}[storage]
                self.writer.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)

    def __enter__(self):
        self.writer.open()
        return self

    def __exit__(self, *_):
        self.writer.close()

    def make(self, kind, **values):
        return self.store.types[kind](**values)

    def write(self, topic, kind, ns, message):
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.is1 else self.store.serialize_cdr
        self.writer.write(self.topics[topic], int(ns), serialize(message, kind))

    def header(self, ns, frame="base"):
        stamp = self.make("builtin_interfaces/msg/Time", sec=int(ns // 10**9), nanosec=int(ns % 10**9))
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **({"seq": 0} if self.is1 else {}))

    def vector(self, kind, x, y, z):
        return self.make(f"geometry_msgs/msg/{kind}", x=float(x), y=float(y), z=float(z))

    def wrench(self, ns, force_n, topic="/wrench", stamp_ns=None):
        force = self.make(
            "geometry_msgs/msg/Wrench", force=self.vector("Vector3", 0.3, -0.2, force_n), torque=self.vector("Vector3", 0, 0.1, 0)
        )
        kind = "geometry_msgs/msg/WrenchStamped"
        header = self.header(ns if stamp_ns is None else stamp_ns)
        self.write(topic, kind, ns, self.make(kind, header=header, wrench=force))

    def pose(self, ns, z_m, topic="/pose"):
        turned = self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        pose = self.make("geometry_msgs/msg/Pose", position=self.vector("Point", 0.4, -0.1, z_m), orientation=turned)
        kind = "geometry_msgs/msg/PoseStamped"
        self.write(topic, kind, ns, self.make(kind, header=self.header(ns), pose=pose))

    def command(self, ns, force_n, topic="/command"):
        self.write(topic, "std_msgs/msg/Float64", ns, self.make("std_msgs/msg/Float64", data=float(force_n)))

    def joints(self, ns, angles_rad):
        # The driver's order differs, and a gripper is on the same topic.
        names, angles = ["finger_joint", *JOINTS[::-1]], np.array([0.01, *angles_rad[::-1]])
        none, kind = np.zeros(0), "sensor_msgs/msg/JointState"
        message = self.make(kind, header=self.header(ns), name=names, position=angles, velocity=none, effort=none)
        self.write("/joint_states", kind, ns, message)

    def image(self, topic, ns, pixels, encoding="bgr8", padding=0):
        kind, (height, width, channels) = "sensor_msgs/msg/Image", pixels.shape
        rows = np.pad(pixels.reshape(height, -1), ((0, 0), (0, padding))).astype(np.uint8)
        message = self.make(
            kind, header=self.header(ns), height=height, width=width, encoding=encoding, is_bigendian=0,
            step=width * channels + padding, data=rows.reshape(-1),
        )
        self.write(topic, kind, ns, message)

    def compressed(self, topic, ns, data, form="png"):
        kind = "sensor_msgs/msg/CompressedImage"
        message = self.make(kind, header=self.header(ns), format=form, data=np.frombuffer(data, np.uint8))
        self.write(topic, kind, ns, message)


def known():
    """The signal: time_s from the first wrench, command, force, displacement in mm. The pull begins after 1 s of 0.5 N, rises by 1 N each
    0.1 s and slips at 8 N; its force follows at once, which no loop does."""
    i = np.arange(100)
    pulled = np.maximum(i - 50, 0)
    desired_n = np.where(i < 50, 0.0, 1.0 + pulled // 5)
    moved_mm = np.where(desired_n > 8.0, pulled - 39.5, 0.0)
    return np.column_stack([0.02 * i, desired_n, np.minimum(desired_n, 8.0), moved_mm])


def colours(level):
    return np.array([[[level, 2, 3]], [[4, 5, 6]]], np.uint8)


def write_known(path, storage="mcap", start_ns=START_NS):
    with Bag(path, storage) as bag:
        for i, (time_s, desired_n, force_n, moved_mm) in enumerate(known()):
            ns = start_ns + round(time_s * 1e9)
            bag.wrench(ns, -0.5 - force_n)
            bag.pose(ns, 0.3 + 1e-3 * moved_mm)
            bag.command(ns, desired_n)
            bag.joints(ns, (0.1, -1.2 + 1e-3 * moved_mm, 1.5, -1.9, -1.5, 0.2))
            if i % 25 == 10:
                bag.image("/left", ns, colours(i), padding=1)
                bag.image("/right", ns, colours(i + 100)[:, :, ::-1], encoding="rgb8")


def lab(folder, mapping=MAPPING, storage="mcap"):
    """A folder with a bag and its mapping."""
    folder.mkdir(exist_ok=True)
    bag = folder / ("one.bag" if storage == "ros1" else "one")
    if not bag.exists():
        write_known(bag, storage)
    (folder / "rosbag.toml").write_text(mapping)
    return bag


@pytest.fixture(scope="module")
def known_lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("known") / "lab"
    lab(folder)
    return folder


def read(known_lab, tmp_path, mapping, **more):
    """The known bag with another mapping."""
    (tmp_path / "rosbag.toml").write_text(mapping)
    return gg.read_bag(known_lab / "one", tmp_path / "rosbag.toml", out=tmp_path / "out", **more)


def table(out):
    with open(out / "pulls.csv", newline="") as file:
        return list(csv.DictReader(file))


def trace(out, name):
    with open(out / "traces" / f"{name}.csv") as file:
        assert file.readline() == "time_s,desired_force_n,measured_force_n,displacement_mm\n"
        return np.loadtxt(file, delimiter=",")


def imported(*arguments):
    """The command line of the wheel."""
    command = [sys.executable, "-m", "gripgen", "import", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def binary(*arguments):
    command = [os.environ["GRIPGEN_BIN"], *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


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
    assert len(trace(found.out, "a")) == 46
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
    protected = binary("diagnose", ROOT / "assets/campaigns/example", "-o", loose, "--force")
    assert protected.returncode == 2 and "belongs to the measurements" in protected.stderr


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
