"""Exports in readers that know nothing of gripgen: pyarrow, pandas, Hugging Face `datasets`. Skipped where those are not installed: `cargo xtask
test --all` installs the first two; `datasets` 4.8.5 wants fsspec up to 2026.2, older than that of the other tests, and an environment of its own."""

import csv
import io
import json
import os
import subprocess

import numpy as np
import pytest
from conftest import gripgen
from PIL import Image

parquet = pytest.importorskip("pyarrow.parquet")
pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def rows(run):
    with open(run / "index.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def table(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("exports") / "run.parquet"
    gripgen("export", run, "--to", "parquet", "-o", out)
    return out


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("exports") / "lerobot"
    gripgen("export", run, "--to", "lerobot", "-o", out)
    return out


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)))


def test_counts_are_integers_and_images_structs(table, rows):
    schema = parquet.read_schema(table)
    for name in ("index", "grip_pose", "group", "repetition"):
        assert str(schema.field(name).type) == "int64", name
    assert [field.name for field in schema.field("left_png").type] == ["bytes", "path"]
    read = parquet.read_table(table).to_pylist()
    assert [row["index"] for row in read] == [int(row["index"]) for row in rows]
    assert read[3]["left_png"]["path"] is None and pixels(read[3]["left_png"]["bytes"]).shape == (240, 320, 3)


def test_hugging_face_shows_images_without_a_cast(table, rows):
    datasets = pytest.importorskip("datasets")
    found = datasets.Dataset.from_parquet(str(table), cache_dir=str(table.parent / "cache"))
    assert isinstance(found.features["left_png"], datasets.Image), found.features
    assert found[5]["right_png"].size == (320, 240)
    assert found.features["index"].dtype == "int64" and found[5]["index"] == int(rows[5]["index"])
    assert np.allclose(found[2]["max_pull_force_n"], float(rows[2]["max_pull_force_n"]))


def test_the_lerobot_folder_is_as_its_readers_expect(folder, table, rows):
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["total_episodes"] == info["total_frames"] == len(rows)
    data = parquet.read_table(folder / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data.column_names) == set(info["features"])
    # As its loader does: pandas with the task as index, episodes with their places.
    tasks = pandas.read_parquet(folder / "meta/tasks.parquet")
    assert tasks.iloc[0].name.startswith("Grip the ") and list(tasks.task_index) == list(range(len(tasks)))
    episodes = parquet.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [e["dataset_from_index"] for e in episodes] == list(range(len(rows)))
    assert all(e["dataset_to_index"] == e["dataset_from_index"] + e["length"] for e in episodes)
    original = parquet.read_table(table).to_pylist()
    for frame, row, source in zip(data.to_pylist(), rows, original, strict=True):
        assert tasks.iloc[frame["task_index"]].name == f"Grip the {row['part']} and pull until it slips."
        assert np.isclose(frame["max_pull_force_n"], float(row["max_pull_force_n"]))
        state = dict(zip(info["features"]["observation.state"]["names"], frame["observation.state"], strict=True))
        assert np.isclose(state["grip_force_n"], float(row["grip_force_n"]))
        # Lossless: the same pixels as in the run.
        assert np.array_equal(pixels(frame["observation.images.left"]["bytes"]), pixels(source["left_png"]["bytes"]))
        assert len(frame["trace.time_s"]) == info["features"]["trace.time_s"]["shape"][0]
        assert frame["trace.time_s"][-1] == pytest.approx(source["trace_time_s"][-1])
    stats = json.loads((folder / "meta/stats.json").read_text())
    forces = [float(row["grip_force_n"]) for row in rows]
    at = info["features"]["observation.state"]["names"].index("grip_force_n")
    assert stats["observation.state"]["mean"][at] == pytest.approx(np.mean(forces))
    assert stats["observation.state"]["std"][at] == pytest.approx(np.std(forces))
    images = np.stack([pixels(s["left_png"]["bytes"]) / 255 for s in original])
    assert np.allclose(np.ravel(stats["observation.images.left"]["mean"]), images.mean((0, 1, 2)))
    for name, q in (("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)):
        assert stats["observation.state"][name][at] == pytest.approx(np.quantile(forces, q))
        assert np.allclose(np.ravel(stats["observation.images.left"][name]), np.quantile(images, q, (0, 1, 2)))
    card = (folder / "README.md").read_text()
    for word in ("load_offset", "Licence", "Split", "| `max_pull_force_n` | label | N |"):
        assert word in card, word


def test_hugging_face_reads_lerobot_with_its_features(folder, rows):
    """What `lerobot` 0.4 does when it opens a folder: features made of info.json, and no cast of its own."""
    datasets = pytest.importorskip("datasets")
    info = json.loads((folder / "meta/info.json").read_text())
    features = {}
    for name, feature in info["features"].items():
        dtype, shape = feature["dtype"], feature["shape"]
        if dtype == "image":
            features[name] = datasets.Image()
        elif shape == [1]:
            features[name] = datasets.Value(dtype)
        else:
            features[name] = datasets.Sequence(datasets.Value(dtype), length=shape[0])
    paths = sorted(str(path) for path in (folder / "data").glob("*/*.parquet"))
    cache = str(folder.parent / "cache")
    found = datasets.Dataset.from_parquet(paths, features=datasets.Features(features), cache_dir=cache)
    assert len(found) == len(rows)
    assert found[1]["observation.images.right"].size == (320, 240)
    assert found[1]["index"] == 1 and found[1]["sample_index"] == int(rows[1]["index"])


def test_a_folder_with_something_in_it_is_left_alone(run, folder):
    before = sorted(p.name for p in folder.iterdir())
    done = subprocess.run([os.environ["GRIPGEN_BIN"], "export", run, "--to", "lerobot", "-o", folder, "--force"], capture_output=True, check=False)
    assert done.returncode == 2 and b"hint:" in done.stderr
    assert sorted(p.name for p in folder.iterdir()) == before
