"""Bags of ROS 1 and 2, written by `rosbags` with a signal that is known."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gripgen as gg

rosbags = pytest.importorskip("rosbags")
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
