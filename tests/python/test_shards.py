"""The shards open in readers that know nothing of gripgen, and hold what the index says."""

import csv
import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import gripgen
from foxglove import messages
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.stream_reader import CRCValidationError
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image


def read(path):
    """All messages of a shard as {topic: [(log_time, message)]}, with every checksum checked."""
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def metadata(path):
    with open(path, "rb") as file:
        return {m.name: m.metadata for m in make_reader(file, validate_crcs=True).iter_metadata()}


def damages(path):
    """The content of a shard, cut in half and with one bit flipped in the middle of each kind of chunk: what a checksum
    covers. (Message indexes between the chunks have none.)"""
    whole = path.read_bytes()
    found = {"cut": whole[: len(whole) // 2]}
    with open(path, "rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    for name, chunk in [("core", chunks[2]), ("view", chunks[3])]:
        flipped = bytearray(whole)
        flipped[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 1
        found[name] = bytes(flipped)
    return found


def index(run):
    with open(run / "index.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_every_sample_is_what_the_index_says(run):
    rows = index(run)
    assert len(rows) == 16
    for shard, path in enumerate(sorted(run.glob("*.mcap"))):
        samples = [s for _, s in read(path)["/sample"]]
        mine = [r for r in rows if int(r["shard"]) == shard]
        assert len(samples) == len(mine)
        for place, (sample, row) in enumerate(zip(samples, mine)):
            assert int(row["in_shard"]) == place
            assert sample.index == int(row["index"])
            assert sample.part == row["part"]
            for column in ["grip_force_n", "grip_angle_deg", "max_pull_force_n", "slip_time_s", "mu_effective"]:
                assert getattr(sample, column) == float(row[column]), column


def test_samples_stand_in_their_time_slots(run):
    for path in run.glob("*.mcap"):
        facts = metadata(path)["gripgen.shard"]
        slot, count = int(facts["slot_ns"]), int(facts["n_samples"])
        with open(path, "rb") as file:
            reader = make_reader(file)
            for k in range(count):
                window = dict(starting_at=k * slot, ending_before=(k + 1) * slot)
                topics = [c.topic for _, c, _ in reader.iter_messages(**window)]
                assert topics.count("/sample") == 1
                assert topics.count("/tactile/left") == topics.count("/tactile/right") == 1
                assert topics.count("/pull/trace") == 1 and topics.count("/pull/state") > 20


def test_the_label_follows_from_the_trace(run):
    """The rule of the experiment, applied here: the last force within 3 N of the command."""
    for path in run.glob("*.mcap"):
        found = read(path)
        for (_, sample), (_, trace) in zip(found["/sample"], found["/pull/trace"]):
            desired, measured = np.array(trace.desired_force_n), np.array(trace.measured_force_n)
            assert len(desired) == len(measured) == len(trace.displacement_mm)
            last = np.flatnonzero(np.abs(measured - desired) < sample.label_tolerance_n)[-1]
            assert sample.max_pull_force_n == pytest.approx(measured[last], rel=1e-6)
            assert sample.slip_time_s == pytest.approx(trace.start_s + last / trace.rate_hz)
            assert trace.displacement_mm[-1] > sample.stop_mm > trace.displacement_mm[-2]


def test_labels_are_the_friction_law(run):
    """2 mu F_G, with what the sensor's noise adds to one reading."""
    for row in index(run):
        ideal = 2 * float(row["mu_effective"]) * float(row["grip_force_n"])
        assert float(row["max_pull_force_n"]) == pytest.approx(ideal, abs=0.6)


def test_pressure_cells_carry_the_grip_force(run):
    for path in run.glob("*.mcap"):
        for _, sample in read(path)["/sample"]:
            for jaw in [sample.left, sample.right]:
                assert 0 < len(jaw.cell_force_n) <= 64
                assert sum(jaw.cell_force_n) == pytest.approx(sample.grip_force_n, rel=1e-5)
                assert jaw.normal_force_n == pytest.approx(sample.grip_force_n, rel=2e-3)
                quaternion = np.array([jaw.qx, jaw.qy, jaw.qz, jaw.qw])
                assert np.linalg.norm(quaternion) == pytest.approx(1)


def test_png_and_raw_hold_the_same_pixels(run, raw_run):
    for path in sorted(run.glob("*.mcap")):
        png, raw = read(path), read(raw_run / path.name)
        for topic in ["/tactile/left", "/tactile/right"]:
            for (_, a), (_, b) in zip(png[topic], raw[topic]):
                assert a.format == "png" and a.frame_id == b.frame_id == "gel_" + topic.rsplit("/", 1)[1]
                assert b.encoding == "rgb8" and b.step == 3 * b.width
                pixels = np.asarray(Image.open(io.BytesIO(a.data)))
                other = np.frombuffer(b.data, np.uint8).reshape(b.height, b.width, 3)
                assert pixels.shape == (240, 320, 3)
                assert np.array_equal(pixels, other)


def test_the_resolved_configuration_travels_with_the_data(run):
    import tomllib

    with open(run / "shard-00000.mcap", "rb") as file:
        attachments = {a.name: a.data for a in make_reader(file, validate_crcs=True).iter_attachments()}
    config = tomllib.loads(attachments["config.toml"].decode())
    assert config["sweep"]["vary"]["grip_force_n"] == [20, 30]
    assert config["twin"]["parts"]["gear"]["mu"] == 0.15
    about = json.loads((run / "run.json").read_text())
    assert about["config_sha256"] == metadata(run / "shard-00000.mcap")["gripgen.shard"]["config_sha256"]


@pytest.mark.parametrize("name", ["CompressedImage", "RawImage"])
def test_image_schemas_are_foxgloves(run, raw_run, name):
    """Byte for byte what foxglove-sdk embeds, so that viewers recognise them."""
    expected = getattr(messages, name).get_schema()
    with open((run if name == "CompressedImage" else raw_run) / "shard-00000.mcap", "rb") as file:
        schemas = make_reader(file).get_summary().schemas.values()
    [schema] = [s for s in schemas if s.name == expected.name]
    assert schema.encoding == expected.encoding == "protobuf"
    assert schema.data == expected.data


def rerun(*arguments):
    binary = Path(sys.executable).parent / "rerun"
    return subprocess.run([binary, *map(str, arguments)], capture_output=True, text=True, check=False)


def rerun_accepts(path):
    """`rerun mcap check --full` decodes every message. Its exit code alone is not enough: 0.41 prints a checksum error of
    an uncompressed chunk and still ends with 0."""
    done = rerun("mcap", "check", "--full", path)
    complaints = [line for line in done.stderr.splitlines() if "Failed" in line or "ERROR" in line]
    checked = [line.split() for line in done.stdout.splitlines() if "/" in line and " ok" in f" {line}"]
    topics = {word for line in checked for word in line if word.startswith("/")}
    everything = {"/sample", "/tactile/left", "/tactile/right", "/pull/trace", "/pull/state"} <= topics
    return done.returncode == 0 and not complaints and everything


def test_rerun_finds_nothing_to_complain_about(run, raw_run, tmp_path):
    rerun("analytics", "disable")
    for path in [*run.glob("*.mcap"), *raw_run.glob("*.mcap")]:
        assert rerun_accepts(path), path
    one = tmp_path / "one.mcap"
    gripgen("export", run, "--sample", 9, "-o", one)
    assert rerun_accepts(one)
    # And would complain: a damaged file, a cut one.
    for content in damages(run / "shard-00000.mcap").values():
        broken = tmp_path / "broken.mcap"
        broken.write_bytes(content)
        assert not rerun_accepts(broken)


def test_damaged_files_are_refused_by_stock_readers_too(run, tmp_path):
    for name, content in damages(run / "shard-00000.mcap").items():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(content)
        with pytest.raises((McapError, CRCValidationError)):
            read(path)


def test_an_export_has_every_reading_as_a_message(run, tmp_path):
    one = tmp_path / "one.mcap"
    gripgen("export", run, "--sample", 3, "-o", one)
    found = read(one)
    [(start, sample)], [(_, trace)] = found["/sample"], found["/pull/trace"]
    assert (start, sample.index) == (0, 3)
    states = found["/pull/state"]
    assert len(states) == len(trace.measured_force_n)
    times = np.array([t for t, _ in states]) * 1e-9
    assert np.allclose(times, np.arange(len(times)) / trace.rate_hz, atol=1e-9)
    measured = [s.measured_force_n for _, s in states]
    assert np.allclose(measured, trace.measured_force_n)


def test_the_index_reads_as_a_table(run):
    rows = index(run)
    columns = rows[0].keys()
    assert {"part", "grip_force_n", "max_pull_force_n", "status", "shard"} <= set(columns)
    assert all(r["status"] == "slipped" and r["failure"] == "" for r in rows)
