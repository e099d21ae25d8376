"""Bags of ROS 2, written by `rosbags`, which knows nothing of gripgen: the same pulls as bags and as native files give the same labels, the same
fit and the same verdict. Skipped where `rosbags` is not installed."""

import csv
import json
import os
import subprocess

import pytest
from conftest import gripgen

rosbag2 = pytest.importorskip("rosbags.rosbag2")
np = pytest.importorskip("numpy")
from mcap.reader import make_reader  # noqa: E402
from mcap_protobuf.decoder import DecoderFactory  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types
PULLS = 50
START_NS = 1_700_000_000_000_000_000
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
wrench = "/force_torque_sensor_broadcaster/wrench"
command = "/pull/command"
pose = "/tcp_pose_broadcaster/pose"
"""


def header(ns, frame="base"):
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=int(ns // 10**9), nanosec=int(ns % 10**9))
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def vector(x, y, z):
    return TYPES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


class Bag:
    """A bag that is being written."""

    def __init__(self, path, compressed=False):
        self.writer = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
        if compressed:
            self.writer.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
        self.writer.open()
        self.topics = {}

    def write(self, topic, kind, ns, message):
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=STORE)
        self.writer.write(self.topics[topic], int(ns), STORE.serialize_cdr(message, kind))

    def pull(self, start_ns, trace):
        """The driver's wrench, z along the pull, and its pose; the force that was commanded."""
        pose_kind, wrench_kind = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/WrenchStamped"
        turned = TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        for time_s, desired_n, measured_n, moved_m in trace:
            ns = start_ns + round(time_s * 1e9)
            force = TYPES["geometry_msgs/msg/Wrench"](force=vector(0.3, -0.2, -measured_n), torque=vector(0.0, 0.1, 0.0))
            self.write("/force_torque_sensor_broadcaster/wrench", wrench_kind, ns + 300_000,
                       TYPES[wrench_kind](header=header(ns, "tool0"), wrench=force))
            at = TYPES["geometry_msgs/msg/Point"](x=0.4, y=-0.1, z=moved_m)
            pose = TYPES["geometry_msgs/msg/Pose"](position=at, orientation=turned)
            self.write("/tcp_pose_broadcaster/pose", pose_kind, ns + 400_000, TYPES[pose_kind](header=header(ns), pose=pose))
            self.write("/pull/command", "std_msgs/msg/Float64", ns, TYPES["std_msgs/msg/Float64"](data=desired_n))

    def close(self):
        self.writer.close()


def traces_of(run):
    """Time, command, reading and displacement of each sample, by the stock library."""
    found = []
    for shard in sorted(run.glob("shard-*.mcap")):
        with open(shard, "rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, _, _, t in reader.iter_decoded_messages(topics=["/pull/trace"]):
                times = list(t.time_s) or [t.start_s + i / t.rate_hz for i in range(len(t.measured_force_n))]
                found.append(list(zip(times, t.desired_force_n, t.measured_force_n, [x * 1e-3 for x in t.displacement_mm])))
    return found


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    """A run of 50 virtual pulls, its rows and its traces."""
    folder = tmp_path_factory.mktemp("native")
    (folder / "sweep.toml").write_text(SWEEP)
    gripgen("sweep", folder / "sweep.toml", "-o", folder / "run", "--set", LAW)
    with open(folder / "run/index.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    traces = traces_of(folder / "run")
    assert len(rows) == len(traces) == PULLS and {row["status"] for row in rows} == {"slipped"}
    return folder / "run", rows, traces


def entry(row, **more):
    def text(value):
        try:
            return repr(float(value))
        except ValueError:
            return json.dumps(value)

    lines = [f"{name} = {text(row[name])}" for name in COVARIATES if row[name] != ""]
    lines = [line.replace(".0", "") if line.startswith(("pull_direction", "pull_index")) else line for line in lines]
    lines += [f"{name} = {json.dumps(value)}" for name, value in more.items()]
    # Words that look like numbers are words.
    lines = [line if not line.startswith(("gel_id", "session")) else f'{line.split(" = ")[0]} = {json.dumps(row[line.split(" = ")[0]])}'
             for line in lines]
    return "[[pulls]]\n" + "\n".join(lines) + "\n"


def unloaded(trace, origin_s):
    """The readings before time 0, in seconds of the bag; `origin_s` is the start of the pull."""
    before = [time_s for time_s, *_ in trace if time_s < 0]
    return {"no_load_s": [origin_s + before[0] - 1e-4, origin_s + before[-1] + 1e-4]} if before else {}


@pytest.fixture(scope="module")
def bags(native, tmp_path_factory):
    """The same pulls, a bag each; every other one is compressed."""
    _, rows, traces = native
    folder = tmp_path_factory.mktemp("bags")
    text = TOPICS
    for i, (row, trace) in enumerate(zip(rows, traces)):
        bag = Bag(folder / f"pull_{i:03d}", compressed=i % 2 == 1)
        bag.pull(START_NS + i * 60 * 10**9, trace)
        bag.close()
        text += entry(row, bag=f"pull_{i:03d}", part="gear", **unloaded(trace, -trace[0][0]))
    (folder / "rosbag.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def one_bag(native, tmp_path_factory):
    """All of them in one bag, marked by time."""
    _, rows, traces = native
    folder = tmp_path_factory.mktemp("one_bag") / "day"
    bag, text, at_ns = Bag(folder, compressed=True), TOPICS.replace('command = "/pull/command"\n', ""), 0
    for row, trace in zip(rows, traces):
        bag.pull(START_NS + at_ns, trace)
        origin_s = at_ns * 1e-9 - traces[0][0][0]
        text += entry(row, part="gear", begin_s=round(origin_s, 9), end_s=origin_s + trace[-1][0] + 1e-4, **unloaded(trace, origin_s))
        at_ns += round(trace[-1][0] * 1e9) + 3 * 10**9
    bag.close()
    (folder / "rosbag.toml").write_text(text)
    return folder


def labels(folder, tmp_path):
    """The label of each pull: `info` summarizes parts, so each pull is a part of its own here."""
    text, i = (folder / "rosbag.toml").read_text(), 0
    while 'part = "gear"' in text:
        text, i = text.replace('part = "gear"', f'part = "p{i:03d}"', 1), i + 1
    for bag in folder.iterdir():
        if bag.name != "rosbag.toml":
            (tmp_path / bag.name).symlink_to(bag)
    (tmp_path / "rosbag.toml").write_text(text)
    found = json.loads(gripgen("info", tmp_path, "--json").stdout)
    assert found["source"] == "rosbag.toml" and all(part["samples"] == 1 for part in found["parts"].values())
    return [found["parts"][name]["low_n"] for name in sorted(found["parts"])]


@pytest.mark.parametrize("which", ["bags", "one_bag"])
def test_labels_and_status_are_those_of_the_native_files(native, which, request, tmp_path):
    _, rows, _ = native
    found = labels(request.getfixturevalue(which), tmp_path)
    assert len(found) == PULLS, "all of them slipped"
    worst = max(abs(a - float(row["max_pull_force_n"])) for a, row in zip(found, rows))
    print(f"{which}: {PULLS} labels, largest difference {worst:.2e} N")
    # Traces of a run are float32, labels are not.
    assert worst < 1e-5


def diagnosis(path):
    return json.loads(gripgen("diagnose", path, "--twin", "asset:configs/twin-baseline.toml", "--json").stdout)


def test_the_verdict_is_that_of_the_native_files(native, bags, one_bag):
    run, rows, _ = native
    wanted = diagnosis(run)
    assert wanted["verdict"] == "effect" and [e["name"] for e in wanted["effects"]] == ["dwell_ageing"]
    for path in (bags, one_bag):
        found = diagnosis(path)
        assert found["data"]["pulls"] == wanted["data"]["pulls"] == PULLS
        assert found["data"]["traces"] == wanted["data"]["traces"]
        assert found["verdict"] == wanted["verdict"]
        assert [e["name"] for e in found["effects"]] == [e["name"] for e in wanted["effects"]]
        for when in ("before", "after"):
            a, b = found["error"][when]["rmse_n"], wanted["error"][when]["rmse_n"]
            print(path.name, when, a, b)
            assert abs(a - b) < 1e-3 * b
    assert len({diagnosis(bags)["data"]["sha256"], diagnosis(one_bag)["data"]["sha256"]}) == 2


def test_calibrate_and_compare_read_bags(native, bags, tmp_path):
    run, _, _ = native
    mu = []
    for name, path in (("run", run), ("bags", bags)):
        out = tmp_path / f"{name}.toml"
        gripgen("calibrate", "pulls", path, "-o", out)
        mu.append(json.loads(gripgen("compare", path, "--twin", out, "--json").stdout)["pulls"])
    assert mu[0]["n"] == mu[1]["n"] == PULLS
    assert abs(mu[0]["rmse_n"] - mu[1]["rmse_n"]) < 0.02 * mu[0]["rmse_n"]


def test_images_of_a_bag_are_compared(tmp_path):
    """The image of the twin itself, raw and as PNG, is what the twin expects."""
    folder = tmp_path / "seen"
    sweep = SWEEP.replace("samples = 50", "samples = 2").replace('images = "none"', 'images = "png"')
    (tmp_path / "sweep.toml").write_text(sweep)
    gripgen("sweep", tmp_path / "sweep.toml", "-o", tmp_path / "run")
    with open(tmp_path / "run/index.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    pillow = pytest.importorskip("PIL.Image")
    import io
    images = {}
    with open(tmp_path / "run/shard-00000.mcap", "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=["/tactile/left", "/tactile/right"]):
            images.setdefault(channel.topic.rsplit("/", 1)[1], []).append(bytes(message.data))
    folder.mkdir()
    text = TOPICS + 'image_left = "/left"\nimage_right = "/right"\n'
    for i, (row, trace) in enumerate(zip(rows, traces_of(tmp_path / "run"))):
        bag, start = Bag(folder / f"p{i}"), START_NS + i * 60 * 10**9
        kind = "sensor_msgs/msg/CompressedImage"
        png = TYPES[kind](header=header(start - 10**8), format="png", data=np.frombuffer(images["left"][i], np.uint8))
        bag.write("/left", kind, start - 10**8, png)
        pixels = np.asarray(pillow.open(io.BytesIO(images["right"][i])))
        kind = "sensor_msgs/msg/Image"
        raw = TYPES[kind](header=header(start - 10**8), height=240, width=320, encoding="bgr8", is_bigendian=0, step=960,
                          data=np.ascontiguousarray(pixels[:, :, ::-1]).reshape(-1))
        bag.write("/right", kind, start - 10**8, raw)
        bag.pull(start, trace)
        bag.close()
        text += entry(row, bag=f"p{i}", part="gear", **unloaded(trace, -trace[0][0]))
    (folder / "rosbag.toml").write_text(text)
    twin = "asset:configs/twin-baseline.toml"
    both = [json.loads(gripgen("compare", path, "--twin", twin, "--json").stdout)["images"] for path in (tmp_path / "run", folder)]
    assert both[0]["n"] == both[1]["n"] == 4
    assert abs(both[0]["mse"] - both[1]["mse"]) < 1e-9 and both[1]["ssim"] == pytest.approx(both[0]["ssim"])


def refused(*arguments):
    command = [os.environ["GRIPGEN_BIN"], *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "panicked" not in done.stderr, done.stderr
    return done.stderr


def test_faults_say_what_to_do(bags, one_bag, tmp_path):
    bag = bags / "pull_001"
    said = refused("diagnose", bag)
    assert "rosbag.toml: a bag needs this file" in said and "/pull/command (std_msgs/msg/Float64)" in said and "hint:" in said
    cut = tmp_path / "cut.mcap"
    whole = next(bags.glob("pull_000/*.mcap")).read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    (tmp_path / "rosbag.toml").write_text(TOPICS + '[defaults]\npart = "gear"\ngrip_force_n = 40\n')
    said = refused("calibrate", "pulls", cut, "-o", tmp_path / "twin.toml")
    assert f"the file has {len(whole) // 2} bytes" in said and "mcap recover" in said
    assert "is what the command reads" in refused("diagnose", one_bag, "-o", one_bag / "rosbag.toml", "--force")
