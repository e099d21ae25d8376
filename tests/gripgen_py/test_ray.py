"""Sweeps on a local Ray cluster of two nodes, and in an object store: the bytes of one machine.

Run by `cargo xtask test --all`; skipped where ray is missing.
"""

import json
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import gripgen as gg

from .conftest import CONFIG, content

ray = pytest.importorskip("ray")
pytest.importorskip("fsspec")

#: 64 samples in 16 shards.
KEYS = {
    "mechanics": "reduced",
    "images": "png",
    "design": "random",
    "samples": 64,
    "shard_samples": 4,
}


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """The run of one machine."""
    out = tmp_path_factory.mktemp("serial") / "run"
    gg.sweep(CONFIG, out, jobs=1, set=KEYS)
    return out


@pytest.fixture(scope="module")
def cluster():
    """Two nodes with a core each."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(
        initialize_head=True,
        head_node_args={"num_cpus": 1, "object_store_memory": 200_000_000, "include_dashboard": False},
    )
    cluster.second = cluster.add_node(num_cpus=1, object_store_memory=200_000_000)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


def same(found, serial):
    """Equal bytes, no strays. The name of a run is not part of it: run.json says how the sweep was called."""
    assert sorted(found) == sorted(content(serial))
    for name, data in content(serial).items():
        assert found[name] == data, name


def test_equal_bytes_on_two_nodes(cluster, serial, tmp_path):
    seen = []
    summary = gg.ray.sweep(CONFIG, tmp_path / "run", set=KEYS, progress=lambda done, all: seen.append((done, all)))
    assert summary.complete and summary.samples == 64
    assert seen[-1] == (16, 16)
    same(content(tmp_path / "run"), serial)


def test_a_node_that_dies_costs_nothing(cluster, serial, tmp_path):
    out = tmp_path / "run"
    with ThreadPoolExecutor(1) as pool:
        sweep = pool.submit(gg.ray.sweep, CONFIG, out, set=KEYS)
        # Ray lets nodes come and go from the main thread alone.
        while len(list(out.glob("shard-*.json"))) < 3:
            assert not sweep.done(), sweep.result()
            time.sleep(0.01)
        done = len(list(out.glob("shard-*.json")))
        cluster.remove_node(cluster.second, allow_graceful=False)
        cluster.second = cluster.add_node(num_cpus=1, object_store_memory=200_000_000)
        assert sweep.result().complete
    assert done < 16, "the node died under way"
    found = {name: data for name, data in content(out).items() if not name.endswith(".partial")}
    same(found, serial)


def test_only_what_is_missing_is_made_again(cluster, serial, tmp_path):
    out = tmp_path / "run"
    gg.ray.sweep(CONFIG, out, set=KEYS)
    times = {p.name: p.stat().st_mtime_ns for p in out.glob("shard-*.mcap")}
    (out / "shard-00004.json").unlink()
    broken = out / "shard-00007.mcap"
    broken.write_bytes(broken.read_bytes()[:-10])
    gg.ray.sweep(CONFIG, out, set=KEYS)
    same(content(out), serial)
    changed = {p.name for p in out.glob("shard-*.mcap") if p.stat().st_mtime_ns != times[p.name]}
    assert changed == {"shard-00004.mcap", "shard-00007.mcap"}


def test_another_configuration_is_refused(cluster, serial, tmp_path):
    out = tmp_path / "run"
    gg.ray.sweep(CONFIG, out, set=KEYS)
    with pytest.raises(gg.GripgenError, match="holds another run: .*seed"):
        gg.ray.sweep(CONFIG, out, set=KEYS | {"seed": 99})
    same(content(out), serial)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("mine")
    with pytest.raises(gg.GripgenError, match="thesis.tex"):
        gg.ray.sweep(CONFIG, tmp_path / "other", set=KEYS)


@pytest.fixture(scope="module")
def bucket():
    """An S3 server on this machine."""
    server_module = pytest.importorskip("moto.server")
    pytest.importorskip("s3fs")
    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    import os

    os.environ |= {
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
    }
    import s3fs

    s3fs.S3FileSystem().mkdir("runs")
    yield "s3://runs"
    server.stop()


def test_an_object_store_holds_the_same(bucket, serial, tmp_path):
    # The workers have to see the server's address: a cluster of their own, started with it in the environment.
    ray.shutdown()
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False, object_store_memory=200_000_000)
    import s3fs

    summary = gg.ray.sweep(CONFIG, f"{bucket}/run", set=KEYS)
    assert summary.complete
    files = s3fs.S3FileSystem()
    files.invalidate_cache()
    found = {path.removeprefix("runs/run/"): files.cat_file(path) for path in files.find("runs/run")}
    same(found, serial)
    ds = gg.load(f"{bucket}/run", cache_dir=tmp_path)
    assert ds.labels.tolist() == gg.load(serial).labels.tolist()
    files.rm_file("runs/run/shard-00002.json")
    assert gg.ray.sweep(CONFIG, f"{bucket}/run", set=KEYS).complete
    with pytest.raises(gg.GripgenError, match="another run"):
        gg.ray.sweep(CONFIG, f"{bucket}/run", set=KEYS | {"seed": 99})
    assert json.loads(files.cat_file("runs/run/run.json"))["samples"] == 64
