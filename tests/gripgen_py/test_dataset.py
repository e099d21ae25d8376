"""Datasets: the same values as independent readers, random access, processes, damage."""

import io
import multiprocessing
import os
import pickle
import shutil
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import psutil
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

import gripgen as gg

from .conftest import content


def stock(run):
    """Images and labels by index, as the stock MCAP library and Pillow read them."""
    found = {}
    for shard in sorted(run.glob("shard-*.mcap")):
        with open(shard, "rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            topics = ["/sample", "/tactile/left", "/tactile/right"]
            sample, images = None, {}
            for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
                if channel.topic == "/sample":
                    sample, images = message, {}
                else:
                    images[channel.topic] = np.asarray(Image.open(io.BytesIO(message.data)))
                if len(images) == 2:
                    both = np.stack([images["/tactile/left"], images["/tactile/right"]])
                    found[sample.index] = (both, sample.max_pull_force_n, sample)
    return found


def test_a_batch_is_what_the_stock_library_reads(run):
    ds = gg.load(run)
    wanted = stock(run)
    assert len(ds) == 16 == len(wanted)
    ids = [11, 0, 5, 11, -1]
    for threads in (1, 3):
        images, labels = ds.batch(ids, threads=threads)
        assert images.shape == (5, 2, 240, 320, 3) and images.dtype == np.uint8 and images.flags.c_contiguous
        assert labels.shape == (5,) and labels.dtype == np.float32
        for i, index in enumerate([11, 0, 5, 11, 15]):
            assert (images[i] == wanted[index][0]).all()
            assert labels[i] == np.float32(wanted[index][1])


def test_traces_forces_and_heights_belong_to_their_pull(run):
    ds = gg.load(run)
    batch = ds.batch([3, 9], images=False, traces=True, forces=True, heights=True)
    assert batch.images is None
    wanted = stock(run)
    for i, index in enumerate([3, 9]):
        sample = wanted[index][2]
        rows = batch.trace_rows[i]
        trace = batch.traces[i, :rows]
        assert np.isnan(batch.traces[i, rows:]).all()
        at = np.argmin(np.abs(trace[:, 0] - sample.slip_time_s))
        assert trace[at, 2] == pytest.approx(sample.max_pull_force_n, abs=1e-4)
        # The cells of a jaw carry its normal force, and the deepest point is the press depth of the record.
        assert batch.forces[i, :, :, 3].sum(-1) == pytest.approx([sample.left.normal_force_n] * 2, rel=1e-5)
        deepest = batch.heights_mm[i].max((1, 2))
        assert deepest == pytest.approx([sample.left.press_depth_mm, sample.right.press_depth_mm], rel=1e-3)


def test_a_row_has_its_values_and_slices_are_datasets(run):
    ds = gg.load(run)
    sample = ds[4]
    assert sample.images.shape == (2, 240, 320, 3)
    assert sample.values["part"] == ds.column("part")[4]
    assert len(ds[2:6]) == 4 and ds[2:6][0].values["index"] == 2.0
    assert [s.label_n for s in ds] == ds.column("max_pull_force_n").tolist()
    with pytest.raises(IndexError, match="no row 16, the dataset has 16"):
        ds[16]


def test_a_mask_selects_rows_as_in_numpy(run):
    ds = gg.load(run)
    mask = ds.column("grip_force_n") > 25
    wanted = ds.labels[mask].tolist()
    assert 0 < len(wanted) < len(ds), "a mask that is read as numbers of rows gives as many rows as it is long"
    images, labels = ds.batch(mask)
    assert labels.tolist() == wanted and (images == ds.batch(np.flatnonzero(mask))[0]).all()
    assert ds.batch(mask.tolist())[1].tolist() == wanted, "a list of bool is a mask too"
    for picked in (ds.subset(mask), ds.where(mask), ds[mask], ds[np.flatnonzero(mask)]):
        assert picked.labels.tolist() == wanted
    assert len(ds.batch(~mask & mask)[1]) == len(ds.batch([])[1]) == 0
    for select in (ds.batch, ds.subset, ds.where):
        with pytest.raises(gg.ConfigError, match="the mask has 6 values, the dataset 16 rows"):
            select(mask[:6])
        with pytest.raises(gg.ConfigError, match=r"the mask has the shape \(4, 4\), the dataset 16 rows"):
            select(mask.reshape(4, 4))
    # Numbers of rows are no mask, even where there are as many.
    with pytest.raises(gg.ConfigError, match="this one of int64") as e:
        ds.where(np.arange(16))
    assert "ds.subset" in e.value.hint


def test_numbers_of_rows_are_whole(run):
    ds = gg.load(run)
    assert ds.batch([1.0, -1.0])[1].tolist() == ds.batch([1, 15])[1].tolist(), "a whole number of any type"
    for broken, said in (([0, 1.5], "no row 1.5"), ([np.nan], "no row nan"), ([np.inf], "no row inf")):
        with pytest.raises(gg.ConfigError, match=f"{said}: numbers of rows are whole"):
            ds.batch(broken)
    with pytest.raises(gg.ConfigError, match="no row 1.5"):
        ds[1.5]
    with pytest.raises(gg.ConfigError, match="not by <U4"):
        ds.batch(["gear"])
    with pytest.raises(IndexError, match="no row 16.0, the dataset has 16"):
        ds.batch([16.0])


def test_statuses_shares_and_sizes_that_cannot_be_are_refused(run):
    with pytest.raises(gg.ConfigError, match="no status 'sliped'; there are slipped, no_contact, censored, suspect, failed") as e:
        gg.load(run, status=["sliped"])
    assert e.value.hint == "did you mean `slipped`?" and str(e.value).endswith(e.value.hint)
    with pytest.raises(gg.ConfigError, match="no status 'good'") as e:
        gg.load(run, status="good")
    assert e.value.hint is None
    ds = gg.load(run, status="slipped")
    assert len(ds) == len(gg.load(run, status=["slipped"])) > 0, "a word is a status, not letters"
    for test in (2, 1, 1.0, 0, -0.2, float("nan")):
        with pytest.raises(gg.ConfigError, match=f"test = {test} is no share"):
            ds.split(test=test)
    for size in (0, -1, 2.5):
        with pytest.raises(gg.ConfigError, match=f"batch_size = {size}, it must be a whole number, 1 at least"):
            next(ds.iterate(batch_size=size))


def test_the_table_is_the_index(run):
    import csv

    with open(run / "index.csv", newline="") as file:
        wanted = list(csv.DictReader(file))
    table = gg.load(run).table(to="arrow").to_pylist()
    # Why a pull is suspect stands in the index as its failure.
    assert [name for name in table[0] if name != "status_reason"] == list(wanted[0])
    for row, cells in zip(table, wanted):
        for name, cell in cells.items():
            assert row[name] == pytest.approx(float(cell)) if isinstance(row[name], float) and cell else True
        assert row["part"] == cells["part"]


def test_splits_keep_groups_together_and_cover_everything(run, tmp_path):
    out = tmp_path / "repeated"
    keys = {"mechanics": "reduced", "repetitions": 4, "vary.part": ["gear", "long_shaft"], "images": "none",
            "vary.grip_force_n": [20, 30], "vary.grip_pose": [0], "vary.grip_angle_deg": [0, 45]}
    gg.sweep("asset:configs/quickstart.toml", out, set=keys)
    ds = gg.load(out)
    train, test = ds.split(test=0.25, seed=3)
    assert len(train) + len(test) == len(ds) == 32 and len(test) == 8
    assert not set(train.column("group")) & set(test.column("group"))
    train, test = ds.split(by="part")
    assert set(train.column("part")) | set(test.column("part")) == {"gear", "long_shaft"}
    assert len(set(test.column("part"))) == 1
    assert ds.image_size_px is None
    with pytest.raises(gg.DataError, match="no images"):
        ds.batch([0])
    assert ds.split(seed=5)[1].rows.tolist() == ds.split(seed=5)[1].rows.tolist()


def test_a_run_of_several_rigs_is_split_by_rig(tmp_path):
    keys = {"images": "none", "samples": 60, "mechanics": "reduced", "trace": "none", "design": "random", "groups": "{rigs=10}"}
    keys |= {"vary.robot.lag_s": '{log_normal=[0.05, 0.3], per="rig"}'}
    gg.sweep("asset:configs/quickstart.toml", tmp_path / "run", set=keys)
    ds = gg.load(tmp_path / "run")
    train, test = ds.split(test=0.3)
    rigs = [set(part.column("rig_id").tolist()) for part in (train, test)]
    assert not rigs[0] & rigs[1] and len(rigs[1]) == 3 and len(train) + len(test) == len(ds)
    lags = {rig: set(ds.where(ds.column("rig_id") == rig).column("robot.lag_s").tolist()) for rig in rigs[0] | rigs[1]}
    assert all(len(of) == 1 for of in lags.values()) and len(set.union(*lags.values())) == len(lags)


def test_ranks_share_every_row_once(run):
    ds = gg.load(run)
    seen = []
    for rank in range(3):
        for _, labels in ds.iterate(batch_size=2, seed=1, epoch=2, rank=rank, world_size=3):
            seen += labels.tolist()
    assert sorted(seen) == sorted(ds.labels.tolist())
    order = [labels.tolist() for _, labels in ds.iterate(batch_size=16, epoch=1)]
    assert order != [labels.tolist() for _, labels in ds.iterate(batch_size=16, epoch=2)]


def test_a_run_that_grew_is_seen_by_the_next_load(copy_of):
    sidecar = copy_of / "shard-00001.json"
    stored = sidecar.read_bytes()
    sidecar.unlink()
    ds = gg.load(copy_of)
    copy = pickle.dumps(ds)
    assert len(ds) == 10
    sidecar.write_bytes(stored)
    assert len(gg.load(copy_of)) == 16 and len(ds) == 10
    with pytest.raises(gg.DataError, match="16 rows now and had 10"):
        pickle.loads(copy).batch([0])


def first_pixel_sum(ds, ids):
    images, _ = ds.batch(ids)
    return int(images.sum())


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_read_the_same(run, method):
    ds = gg.load(run)
    pieces = [[0, 1, 2], [3, 4, 5], [13, 14, 15]]
    wanted = [first_pixel_sum(ds, ids) for ids in pieces]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(method)) as pool:
        assert list(pool.map(first_pixel_sum, [ds] * 3, pieces)) == wanted


def test_a_dataset_is_found_after_the_folder_was_changed(run, tmp_path, monkeypatch):
    """Hydra, Ray and launchers change the folder after a relative path was given."""
    monkeypatch.chdir(run.parent)
    ds = gg.load(run.name)
    stored = pickle.dumps(ds)
    monkeypatch.chdir(tmp_path)
    assert (ds.batch([15])[0] == gg.load(run).batch([15])[0]).all()
    assert pickle.loads(stored).labels.tolist() == ds.labels.tolist() and os.path.isabs(ds.path)


def test_a_pickle_holds_names_and_numbers_only(run):
    ds = gg.load(run)[4:9]
    stored = pickle.dumps(ds)
    assert len(stored) < 1000
    assert pickle.loads(stored).labels.tolist() == ds.labels.tolist()


def test_ten_thousand_accesses_do_not_grow(run):
    ds = gg.load(run)
    rng = np.random.default_rng(0)
    process = psutil.Process()

    def read(n):
        for _ in range(n // 20):
            ds.batch(rng.integers(0, len(ds), 20))
        return process.memory_info().rss

    before = read(2000)
    assert read(10_000) < before + 20e6


def test_measured_pulls_are_loaded_by_the_same_call(run, tmp_path):
    (tmp_path / "pulls.csv").write_text(
        "pull_id,part,grip_force_n,operator,max_pull_force_n\na,gear,20,ann,6.5\nb,gear,20,ben,7\nc,gear,30,ann,9.25\n"
    )
    (tmp_path / "images").mkdir()
    both, _, _ = stock(run)[0]
    for jaw, image in zip(("left", "right"), both):
        Image.fromarray(image).save(tmp_path / "images" / f"b_{jaw}.png")
    ds = gg.load(tmp_path)
    assert ds.labels.tolist() == [6.5, 7.0, 9.25]
    assert (ds.batch([1])[0][0] == both).all()
    assert ds.column("operator").tolist() == ["ann", "ben", "ann"]
    with pytest.raises(gg.DataError, match="row 0 has no images"):
        ds.batch([0])
    train, test = ds.split(test=0.5)
    assert {len(train), len(test)} == {1, 2}, "the two pulls with 20 N stay together"


def test_suspect_labels_are_left_out_unless_asked_for(tmp_path):
    (tmp_path / "pulls.csv").write_text(
        "pull_id,part,grip_force_n,max_pull_force_n,status,status_reason\n"
        "a,gear,20,6.5,,\nb,gear,20,3,suspect,a hand was there\nc,gear,30,,failed,part lost\n"
    )
    assert gg.load(tmp_path).labels.tolist() == [6.5]
    both = gg.load(tmp_path, suspect=True)
    assert both.labels.tolist() == [6.5, 3.0]
    assert both.column("status_reason").tolist() == ["", "a hand was there"]
    assert both[1].values["status"] == "suspect"


def test_failed_samples_are_left_out_unless_asked_for(tmp_path):
    # An imprint of 9 mm^3/N at 80 N goes through the gel.
    keys = {"mechanics": "reduced", "vary.grip_force_n": [20, 80], "vary.part": ["gear"], "images": "none",
            "vary.grip_pose": [0], "vary.grip_angle_deg": [0], "parts.gear.imprint_mm3_per_n": 9.0}
    summary = gg.sweep("asset:configs/quickstart.toml", tmp_path / "run", set=keys)
    assert summary.failed >= 1 and summary.complete
    assert len(gg.load(tmp_path / "run", status=["failed"])) == summary.failed
    assert len(gg.load(tmp_path / "run")) == summary.samples - summary.failed


def flip(path, at=None):
    data = bytearray(path.read_bytes())
    at = len(data) // 2 if at is None else at
    data[at] ^= 0xFF
    path.write_bytes(data)


def read_all(folder):
    ds = gg.load(folder)
    ds.batch(range(len(ds)))


def test_damage_is_an_exception_that_names_the_file(copy_of, tmp_path):
    shard, sidecar = copy_of / "shard-00001.mcap", copy_of / "shard-00001.json"
    good = shard.read_bytes(), sidecar.read_bytes()
    # One byte of an image: the checksum of its chunk tells.
    flip(shard)
    with pytest.raises(gg.DataError, match="shard-00001.mcap"):
        read_all(copy_of)
    # The end of the file, and the place in it that says where the summary is.
    for at in (len(good[0]) - 1, len(good[0]) - 30):
        shard.write_bytes(good[0])
        flip(shard, at)
        with pytest.raises(gg.DataError, match="shard-00001.mcap"):
            read_all(copy_of)
    # Cut off: the sidecar says another size, so the shard is not done.
    shard.write_bytes(good[0][: len(good[0]) // 2])
    assert len(gg.load(copy_of)) == 10
    # Somebody else's file of the right size.
    shard.write_bytes(b"x" * len(good[0]))
    with pytest.raises(gg.DataError, match="shard-00001.mcap"):
        read_all(copy_of)
    shard.write_bytes(good[0])
    # A shard of another version.
    sidecar.write_bytes(good[1].replace(f'"{gg.__version__}"'.encode(), b'"9.9.9"'))
    with pytest.raises(gg.DataError, match="shard-00001.json.*9.9.9"):
        read_all(copy_of)
    sidecar.write_bytes(good[1])
    read_all(copy_of)
    (copy_of / "run.json").write_text("{}")
    with pytest.raises(gg.DataError, match="run.json"):
        gg.load(copy_of)
    with pytest.raises(gg.DataError, match=str(tmp_path / "nowhere")):
        gg.load(tmp_path / "nowhere")


def test_a_shard_of_another_run_is_refused(copy_of, tmp_path):
    other = tmp_path / "other"
    from .conftest import CONFIG, SMALL

    gg.sweep(CONFIG, other, set=SMALL | {"seed": 8})
    shutil.copy(other / "shard-00001.mcap", copy_of)
    import json

    sidecar = json.loads((other / "shard-00001.json").read_text())
    sidecar["config_sha256"] = json.loads((copy_of / "run.json").read_text())["config_sha256"]
    (copy_of / "shard-00001.json").write_text(json.dumps(sidecar))
    with pytest.raises(gg.DataError, match="shard-00001.mcap.*config_sha256"):
        read_all(copy_of)


class Bomb:
    def __reduce__(self):
        return (exec, ("raise SystemExit('code was run')",))


def test_nothing_that_is_read_is_run(copy_of):
    # A pickle in the place of every file of a run: an exception, and nothing happens.
    for name in content(copy_of):
        path = copy_of / name
        good = path.read_bytes()
        path.write_bytes(pickle.dumps(Bomb()))
        try:
            read_all(copy_of)
        except gg.DataError:
            pass
        path.write_bytes(good)


def test_urls_are_copied_once_and_checked(run, tmp_path):
    fsspec = pytest.importorskip("fsspec")
    files = fsspec.filesystem("memory")
    for name, data in content(run).items():
        files.pipe_file(f"/bucket/run/{name}", data)
    ds = gg.load("memory://bucket/run", cache_dir=tmp_path)
    assert ds.labels.tolist() == gg.load(run).labels.tolist()
    assert (ds.batch([7])[0] == gg.load(run).batch([7])[0]).all()
    broken = bytearray(files.cat_file("/bucket/run/shard-00002.mcap"))
    broken[1000] ^= 1
    files.pipe_file("/bucket/run/shard-00002.mcap", bytes(broken))
    with pytest.raises(gg.DataError, match="shard-00002.mcap"):
        gg.load("memory://bucket/run", cache_dir=tmp_path / "new")
