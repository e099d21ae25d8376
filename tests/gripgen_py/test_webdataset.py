"""`export --to webdataset`: what tarfile, Pillow and numpy, and WebDataset itself, read."""

import io
import json
import tarfile

import numpy as np
import pytest
from PIL import Image

import gripgen as gg

from .conftest import CONFIG, command_line


def samples(path):
    """Files by key and ending."""
    found = {}
    with tarfile.open(path) as tar:
        for entry in tar:
            assert entry.mtime == 0 and entry.uid == 0 and entry.mode == 0o644
            key, _, ending = entry.name.partition(".")
            found.setdefault(key, {})[ending] = tar.extractfile(entry).read()
    return found


def test_a_tar_file_holds_the_run(run, tmp_path):
    out = tmp_path / "all.tar"
    said = json.loads(command_line("export", run, "--to", "webdataset", "-o", out, "--json"))
    ds = gg.load(run)
    found = samples(out)
    assert said["rows"] == len(found) == len(ds) and said["left_out"] == 0
    assert list(found) == [f"{i:09}" for i in range(len(ds))]
    batch = ds.batch(range(len(ds)), traces=True)
    for i, files in enumerate(found.values()):
        assert sorted(files) == ["json", "left.png", "right.png", "trace.npy"]
        for jaw, name in enumerate(("left.png", "right.png")):
            assert (np.asarray(Image.open(io.BytesIO(files[name]))) == batch.images[i, jaw]).all()
        cells = json.loads(files["json"])
        assert cells["max_pull_force_n"] == pytest.approx(batch.label_n[i], rel=1e-6)
        assert cells["index"] == i and isinstance(cells["index"], int) and cells["part"] == ds.column("part")[i]
        assert cells["failure"] is None and cells["status"] == "slipped"
        assert isinstance(cells["group"], int) and isinstance(cells["grip_force_n"], float)
        trace = np.load(io.BytesIO(files["trace.npy"]), allow_pickle=False)
        rows = batch.trace_rows[i]
        assert trace.dtype == np.float32 and (trace == batch.traces[i, :rows]).all()
    card = (tmp_path / "all.md").read_text()
    assert ds.info["config_sha256"] in card and "max_pull_force_n" in card and "[sweep]" in card
    # The same run gives the same bytes.
    bytes_ = out.read_bytes()
    command_line("export", run, "--to", "webdataset", "-o", out, "--force")
    assert out.read_bytes() == bytes_


def test_numbered_files_share_the_rows(run, tmp_path):
    command_line("export", run, "--to", "webdataset", "--no-images", "--no-traces", "-o", tmp_path / "t-%04d.tar")
    found = samples(tmp_path / "t-0000.tar")
    assert len(found) == 16 and all(list(files) == ["json"] for files in found.values())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t-0000.tar", "t.md"]


def test_hugging_face_datasets_reads_rows_with_and_without_a_pull(tmp_path):
    """Grips that miss have no trace: their samples have the same keys, or `datasets` refuses the file."""
    datasets = pytest.importorskip("datasets")
    drawn = {"design": "random", "repetitions": 1, "samples": 30, "vary.grip_offset_mm": {"normal": [0, 30]}}
    gg.sweep(CONFIG, tmp_path / "run", set={"mechanics": "reduced", **drawn})
    command_line("export", tmp_path / "run", "--to", "webdataset", "-o", tmp_path / "a.tar")
    found = samples(tmp_path / "a.tar")
    keys = {tuple(files) for files in found.values()}
    assert keys == {("left.png", "right.png", "json", "trace.npy")}
    lengths = [len(np.load(io.BytesIO(files["trace.npy"]))) for files in found.values()]
    assert 0 in lengths and max(lengths) > 0, "both kinds are there"
    rows = datasets.load_dataset(
        "webdataset", data_files={"train": str(tmp_path / "a.tar")}, cache_dir=str(tmp_path / "cache")
    )["train"]
    ds = gg.load(tmp_path / "run", status=("slipped", "no_contact", "censored", "suspect"))
    assert len(rows) == len(ds) == len(found)
    for row, length in zip(rows, lengths, strict=True):
        i = list(ds.column("index")).index(row["json"]["index"])
        assert (np.asarray(row["left.png"]) == ds[i].images[0]).all() and len(row["trace.npy"]) == length


def test_webdataset_reads_it(run, tmp_path):
    webdataset = pytest.importorskip("webdataset")
    out = tmp_path / "all.tar"
    command_line("export", run, "--to", "webdataset", "-o", out)
    rows = webdataset.WebDataset(str(out), shardshuffle=False).decode("rgb8")
    rows = rows.to_tuple("left.png", "right.png", "json", "trace.npy")
    ds = gg.load(run)
    seen = 0
    for i, (left, right, cells, trace) in enumerate(rows):
        images, label = ds[i].images, ds[i].label_n
        assert (left == images[0]).all() and (right == images[1]).all()
        assert cells["max_pull_force_n"] == pytest.approx(label) and trace.shape[1] == 4
        seen += 1
    assert seen == len(ds)
