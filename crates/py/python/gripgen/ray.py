"""Sweeps on a Ray cluster: the bytes of one machine. Needs ray, and fsspec for object stores.

A task makes one shard from the run's own `run.json` and inputs in a temporary folder of its node, then publishes the
shard and, last, its sidecar. A shard with a sidecar is done: what was lost with a node is made again, and running the
same call again makes what is missing.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from . import _core, checks

try:
    import fsspec
    import ray
except ImportError as e:
    raise checks.needs("gripgen.ray", "ray", "ray") from e

from .remote import is_url, publish
from .sweeps import SweepSummary

#: Attempts of a task whose node died.
RETRIES = 5


class _Store:
    """A run folder on disk or in an object store."""

    def __init__(self, out: str) -> None:
        self.is_local = not is_url(out)
        self.files, self.root = fsspec.core.url_to_fs(out if is_url(out) else os.path.abspath(out))

    def names(self) -> set[str]:
        """Files of the run, with those of its inputs as `inputs/NAME`."""
        found: set[str] = set()
        self.files.invalidate_cache()
        for folder in ("", "inputs/"):
            try:
                entries = self.files.ls(f"{self.root}/{folder}".rstrip("/"), detail=False)
            except FileNotFoundError:
                continue
            found |= {folder + entry.rstrip("/").rsplit("/", 1)[-1] for entry in entries}
        return found

    def read(self, name: str) -> bytes:
        return self.files.cat_file(f"{self.root}/{name}")

    def write(self, name: str, content: bytes) -> None:
        # One PUT is atomic; a move would be a copy and a deletion. On disk a rename is.
        if self.is_local:
            publish(Path(self.root) / name, content)
        else:
            self.files.pipe_file(f"{self.root}/{name}", content)


def _make_shard(run: Mapping[str, bytes], shard: int, shards: int, jobs: int, out: str) -> int:
    with tempfile.TemporaryDirectory(prefix="gripgen-") as folder:
        for name, content in run.items():
            publish(Path(folder) / name, content)
        _core.sweep(None, folder, None, jobs, (shard, shards), None)
        store = _Store(out)
        for suffix in ("mcap", "json"):
            name = f"shard-{shard:05}.{suffix}"
            store.write(name, (Path(folder) / name).read_bytes())
    return shard


def sweep(
    config: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    jobs: int = 1,
    set: Mapping[str, Any] | None = None,
    in_flight: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> SweepSummary:
    """Run a sweep on the cluster that `ray.init` connected to (a local one is started if none was).

    `out` is a folder that all nodes see, or an fsspec URL (`s3://bucket/run`). A task has `jobs` cores and makes a
    shard with as many threads; `in_flight` tasks are under way at once (twice what fits into the cluster if None).
    `progress` is called with shards done and shards in all. `set` overrides any key, as in `gripgen.sweep`.

    Raises GripgenError if `out` holds another run; nothing is touched then.
    """
    if not ray.is_initialized():
        ray.init(include_dashboard=False, log_to_driver=False)
    out = os.fspath(out)
    store = _Store(out)
    with tempfile.TemporaryDirectory(prefix="gripgen-") as folder:
        local = Path(folder) / "run"
        there = store.names()
        if "run.json" in there:
            # Preparing it again compares the two and says which keys differ.
            publish(local / "run.json", store.read("run.json"))
        elif foreign := [n for n in there if not n.endswith(".partial") and not n.startswith("inputs")]:
            raise _core.GripgenError(f"{out} is not empty and holds no run (no run.json, but {foreign[0]})")
        samples, shards = _core.prepare_run(os.fspath(config), str(local), dict(set or {}))
        run = {str(p.relative_to(local)): p.read_bytes() for p in local.rglob("*") if p.is_file()}
        # run.json last: a folder that has it has its inputs.
        for name in sorted(run, key=lambda n: n == "run.json"):
            if name not in there:
                store.write(name, run[name])
        done = {s for s in range(shards) if {f"shard-{s:05}.json", f"shard-{s:05}.mcap"} <= there}
        done -= _broken(store, done, local)
        _make_missing(run, sorted(frozenset(range(shards)) - done), shards, jobs, out, in_flight, progress)
        return _finish(store, local, shards, samples, out)


def _broken(store: _Store, done: set[int], local: Path) -> set[int]:
    """Shards whose file has not the size that its sidecar says, or whose sidecar is damaged. One of another version is neither."""
    broken = set()
    for shard in done:
        name = f"shard-{shard:05}.json"
        try:
            sidecar = json.loads(store.read(name))
            version = sidecar.get("gripgen_version", _core.__version__)
            if version != _core.__version__:
                raise _core.GripgenError(f"{store.root}/{name}: gripgen {version} made it, this is {_core.__version__}")
            wanted = sidecar["bytes"]
        except (ValueError, KeyError, TypeError):
            broken.add(shard)
            continue
        if store.files.size(f"{store.root}/shard-{shard:05}.mcap") != wanted:
            broken.add(shard)
    return broken


def _make_missing(
    run: Mapping[str, bytes],
    todo: list[int],
    shards: int,
    jobs: int,
    out: str,
    in_flight: int | None,
    progress: Callable[[int, int], None] | None,
) -> None:
    task = ray.remote(num_cpus=jobs, max_retries=RETRIES, scheduling_strategy="SPREAD")(_make_shard)
    shared = ray.put(dict(run))
    waiting: set[Any] = set()
    made = shards - len(todo)
    queue = iter(todo)
    while True:
        window = in_flight or max(2, 2 * int(ray.cluster_resources().get("CPU", 1) // jobs))
        while len(waiting) < window and (shard := next(queue, None)) is not None:
            target = out if is_url(out) else os.path.abspath(out)
            waiting.add(task.remote(shared, shard, shards, jobs, target))
        if not waiting:
            return
        ready, rest = ray.wait(list(waiting), num_returns=1, timeout=5.0)
        ray.get(ready)
        made += len(ready)
        waiting = set(rest)
        if progress is not None and ready:
            progress(made, shards)


def _finish(store: _Store, local: Path, shards: int, samples: int, out: str) -> SweepSummary:
    """Index and overview, by the same code as on one machine."""
    store.files.invalidate_cache()
    if store.is_local:
        found = _core.sweep(None, store.root, None, 1, None, None)
        return SweepSummary(out=out, **found)
    # The index is made of sidecars, the overview of a few samples: empty files of the right size stand for the other shards.
    for shard in range(shards):
        sidecar = store.read(f"shard-{shard:05}.json")
        publish(local / f"shard-{shard:05}.json", sidecar)
        with open(local / f"shard-{shard:05}.mcap", "wb") as file:
            file.truncate(json.loads(sidecar)["bytes"])
    for shard in _core.contact_sheet_shards(str(local)):
        name = f"shard-{shard:05}.mcap"
        publish(local / name, store.read(name))
    found = _core.sweep(None, str(local), None, 1, None, None)
    for name in ("index.csv", "contact-sheet.png"):
        store.write(name, (local / name).read_bytes())
    shutil.rmtree(local)
    return SweepSummary(out=out, **found)
