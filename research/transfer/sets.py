"""Training sets and world W1: sweeps of gripgen, read from their files.

`GRIPGEN_BIN` names the program. Priors and twin are those inside the program. A sweep that is there is not made again.
"""

import functools
import io
import os
import re
import subprocess
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

from research.transfer.contact import VIEW
from research.transfer.worlds import LOGGED, Samples

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = ROOT / "assets" / "configs"
SHRINK = 4  # 320 x 240 pixels to 80 x 60 cells of 0.35 mm
NAMES = {
    "old": "large.toml, the old training set",
    "new": "training.toml",
    "no-friction": "training.toml without friction.toml",
    "no-gel": "training.toml without gel.toml",
    "no-rig": "training.toml without rig.toml",
    "one-family": "training.toml with the shafts alone",
}


def gripgen(*arguments: str) -> None:
    """Runs the program on one core; code 4 says that some samples failed, which readers leave out."""
    done = subprocess.run([os.environ.get("GRIPGEN_BIN", "gripgen"), *arguments], stdout=subprocess.DEVNULL)
    if done.returncode not in (0, 4):
        raise RuntimeError(f"gripgen {' '.join(arguments)}: exit code {done.returncode}")


def test_twin(work: Path) -> Path:
    """The twin of training.toml with the benchmark's families for tests: bearing, connector, cam."""
    folder = work / "benchmark"
    if not (folder / "twin.toml").exists():
        gripgen("init", "--benchmark", "--per-family", "6", "-o", str(folder), "--quiet")
    head = (CONFIGS / "twin-training.toml").read_text().split("\n[parts.", 1)[0]
    parts = re.split(r"\n(?=\[parts\.)", (folder / "twin.toml").read_text())
    tests = [p.replace("scatter = 0.05", "scatter = 0.04") for p in parts if 'split = "test"' in p]
    (folder / "twin-test.toml").write_text(head + "\n" + "\n".join(tests) + "\n")
    return folder / "twin-test.toml"


def configuration(name: str, work: Path) -> tuple[Path, list[str]]:
    """File and overrides of a set: one of NAMES, `w1` (the test) or `w1-native` (made for W1 alone)."""
    sets = ["images.storage=clean"]
    if name == "old":
        return ROOT / "research" / "transfer" / "large.toml", [*sets, "images.compression=small"]
    text = (CONFIGS / "training.toml").read_text()
    twin = "asset:configs/twin-training.toml"
    if name.startswith("w1"):
        twin = test_twin(work).as_posix()
        sets.append(f"seed={77 if name == 'w1' else 78}")
        if name == "w1":
            text = text.replace("rigs = 200", "rigs = 16")
    kept = [p for p in ("friction", "gel", "rig") if name != f"no-{p}"]
    text = re.sub(r"(?m)^priors = .*$", "priors = [" + ", ".join(f'"asset:priors/{p}.toml"' for p in kept) + "]", text)
    text = text.replace('"twin-training.toml"', f'"{twin}"')
    if name == "one-family":
        shafts = re.findall(r'\[parts\.(\w+)\]\nfamily = "shaft"', (CONFIGS / "twin-training.toml").read_text())
        text = text.replace("[vary]\n", f"[vary]\npart = {shafts}\n".replace("'", '"'))
    path = work / f"{name}.toml"
    path.write_text(text)
    return path, sets


def made(name: str, work: Path, samples: int) -> Samples:
    """A set, swept and read."""
    saved = work / f"{name}-{samples}.npz"
    if saved.exists():
        return Samples(**np.load(saved))
    run = work / f"run-{name}-{samples}"
    path, overrides = configuration(name, work)
    keys = [k for o in [f"samples={samples}", *overrides] for k in ("--set", o)]
    gripgen("sweep", str(path), *keys, "-j", "1", "-o", str(run), "--quiet", "--allow-constant")
    found = read(run)
    np.savez(saved, **vars(found))
    return found


@functools.cache
def rest_of(sensor: str) -> np.ndarray:
    """The frame at rest of a shipped sensor, in whole grey levels."""
    with np.load(ROOT / "assets" / sensor.removeprefix("asset:")) as file:
        return np.round(file["rest_rgb"]).astype(np.int16)


def change_of(png: bytes, base: np.ndarray, whole: bool) -> np.ndarray:
    """Change from the frame at rest, which `base` is for `whole` frames; others hold (frame - rest + mean of the row) mod 256, and `base` is that mean."""
    stored = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=np.int16)
    change = (stored - base).astype(np.float32)
    if not whole:
        change = np.where(change > 127, change - 256, np.where(change < -128, change + 256, change))
    return change.reshape(VIEW[0], SHRINK, VIEW[1], SHRINK, 3).mean((1, 3))


def read(run: Path, rig_key: str = "") -> Samples:
    """Pulls of a run that slipped or were censored, with the contact that only the simulation knows.

    Rigs are told apart by the groups of the sweep, or by the value of `rig_key` that was drawn."""
    columns: dict[str, list] = {k: [] for k in ("change", "force_n", "label_n", "censored", "part", "rig", "area_mm2", "depth_mm", "trails", "logged")}
    for shard in sorted(run.glob("*.mcap")):
        with shard.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            base = {}
            for attachment in reader.iter_attachments():
                if attachment.name.startswith("rest_"):
                    rest = np.asarray(Image.open(io.BytesIO(attachment.data)).convert("RGB"), dtype=np.float64)
                    base[attachment.name[5:-4]] = np.round(rest.mean(1, keepdims=True)).astype(np.int16)
            images: dict[str, list[tuple[int, int, bytes]]] = {"left": [], "right": []}
            samples = []
            topics = ["/sample", "/tactile/left", "/tactile/right"]
            for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
                if channel.topic == "/sample":
                    samples.append(message)
                else:
                    images[channel.topic.rsplit("/", 1)[1]].append((message.timestamp.seconds, message.timestamp.nanos, message.data))
        frames = {jaw: {(s, n): data for s, n, data in found} for jaw, found in images.items()}
        for sample in samples:
            if sample.status not in (1, 2):
                continue
            at = (sample.timestamp.seconds, sample.timestamp.nanos)
            seed = np.random.default_rng([sample.index, 5])
            sensors = {jaw: sample.drawn_text.get(f"optics.{jaw}.sensor") for jaw in ("left", "right")}
            both = np.stack([change_of(frames[jaw][at], rest_of(s) if s else base[jaw], s is not None) for jaw, s in sensors.items()])
            sd = [[getattr(n, c) for c in ("red", "green", "blue")] for n in (sample.left_image_noise, sample.right_image_noise)]
            both += seed.standard_normal(both.shape) * np.array(sd)[:, None, None, :] / SHRINK
            columns["change"].append(both.astype(np.float16))
            columns["force_n"].append(sample.grip_force_n)
            columns["label_n"].append(max(sample.max_pull_force_n, 0.0))
            columns["censored"].append(sample.status == 2)
            columns["part"].append(sample.part)
            rig = sample.drawn_text.get("rig_id", "") or sample.gel_id.split("g")[0]
            columns["rig"].append(f"{sample.drawn_number[rig_key]:.12g}" if rig_key else rig)
            columns["area_mm2"].append([sum(j.cell_area_mm2) for j in (sample.left, sample.right)])
            columns["trails"].append(sample.lag_exceeds_tolerance)
            columns["depth_mm"].append([j.press_depth_mm for j in (sample.left, sample.right)])
            columns["logged"].append([0.0 if k == "session" else getattr(sample, k) for k in LOGGED])  # sessions of a sweep are words
    return Samples(**{k: np.array(v) for k, v in columns.items()})
