"""Runs behind fsspec URLs: copied once into a cache, checked against their sidecars."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ._core import DataError
from .checks import unreadable

#: Files of a run that are read, beside its shards.
_FILES = ("run.json", "pulls.csv", "campaign.toml")


def is_url(path: str) -> bool:
    """Whether a path is an fsspec URL."""
    return re.match(r"^[a-zA-Z][a-zA-Z0-9+.-]+://", path) is not None


def default_cache() -> Path:
    """`$GRIPGEN_CACHE`, or `gripgen` in the user's cache folder."""
    own = os.environ.get("GRIPGEN_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(own) if own else Path(base) / "gripgen"


def fetch(url: str, cache_dir: str | os.PathLike[str] | None = None) -> str:
    """Copy a run into the cache, unless it is there already, and return where it is.

    Shards are compared with the SHA-256 in their sidecars; a sidecar is copied after its shard, so that a copy that was
    interrupted goes on where it stopped.
    """
    try:
        import fsspec
    except ImportError as e:
        raise unreadable(f"{url}: reading URLs needs fsspec", "pip install 'gripgen[remote]'") from e
    try:
        files, root = fsspec.core.url_to_fs(url)
    except ImportError as e:
        kind = url.split("://")[0]
        hint = "pip install 'gripgen[s3]'" if kind == "s3" else f"install what fsspec needs for {kind}: {e}"
        raise unreadable(f"{url}: a package of fsspec is not there", hint) from e
    root = root.rstrip("/")
    local = Path(cache_dir or default_cache()) / hashlib.sha256(url.encode()).hexdigest()[:16]
    local.mkdir(parents=True, exist_ok=True)
    names = {entry.rsplit("/", 1)[-1]: entry for entry in files.ls(root, detail=False)}
    if not {"run.json", "pulls.csv"} & set(names):
        raise DataError(f"{url}: neither a run folder (run.json) nor a folder of measured pulls (pulls.csv)")
    for name in (name for name in _FILES if name in names):
        _copy(files, names[name], local / name)
    for folder in ("inputs", "traces", "images"):
        if folder in names:
            for entry in files.ls(names[folder], detail=False):
                target = local / folder / entry.rsplit("/", 1)[-1]
                if not target.exists():
                    _copy(files, entry, target)
    shards = [name[:-5] for name in names if re.fullmatch(r"shard-\d+\.json", name)]

    def shard(stem: str) -> None:
        if (local / f"{stem}.json").exists() and (local / f"{stem}.mcap").exists():
            return
        sidecar = files.cat_file(names[f"{stem}.json"])
        wanted = json.loads(sidecar).get("sha256")
        _copy(files, names[f"{stem}.mcap"], local / f"{stem}.mcap")
        found = hashlib.sha256((local / f"{stem}.mcap").read_bytes()).hexdigest()
        if found != wanted:
            raise DataError(f"{url}/{stem}.mcap: its SHA-256 is {found}, the sidecar says {wanted}")
        publish(local / f"{stem}.json", sidecar)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(shard, shards))
    return str(local)


def _copy(files: object, source: str, target: Path) -> None:
    publish(target, files.cat_file(source))  # type: ignore[attr-defined]


def publish(target: Path, content: bytes) -> None:
    """Write a file at once: under a temporary name in its folder first, then renamed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=target.parent, suffix=".partial", delete=False) as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.chmod(file.name, 0o644)
    os.replace(file.name, target)
