"""How fast a training loop reads: the dataset beside the stock `mcap` library with Pillow, in the same run.

    pip install . mcap mcap-protobuf-support pillow gymnasium
    python benches/python.py

Random batches of 32 from a run of 1024 samples that lies in the page cache. Then steps of the environments.
"""

import io
import tempfile
import time
from pathlib import Path

import gripgen as gg
import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

SAMPLES = 1024
BATCH = 32
SECONDS = 4.0


def rate(of, per_call: int) -> float:
    """Things per second: the best of three goes."""
    best = 0.0
    for _ in range(3):
        started, n = time.perf_counter(), 0
        while time.perf_counter() - started < SECONDS / 3:
            of()
            n += per_call
        best = max(best, n / (time.perf_counter() - started))
    return best


def stock_reader(run: Path, shard_samples: int):
    """Random samples through the stock library: open files, summaries read once, time windows of a sample."""
    readers, slots = [], []
    for path in sorted(run.glob("shard-*.mcap")):
        reader = make_reader(open(path, "rb"), decoder_factories=[DecoderFactory()])
        metadata = next(iter(reader.iter_metadata())).metadata
        readers.append(reader)
        slots.append(int(metadata["slot_ns"]))
    rng = np.random.default_rng(0)

    def batch() -> None:
        images = np.empty((BATCH, 2, 240, 320, 3), np.uint8)
        labels = np.empty(BATCH, np.float32)
        for i, index in enumerate(rng.integers(0, SAMPLES, BATCH)):
            shard, k = divmod(int(index), shard_samples)
            start = k * slots[shard]
            topics = ["/sample", "/tactile/left", "/tactile/right"]
            window = {"starting_at": start, "ending_before": start + 1}
            for _, channel, _, message in readers[shard].iter_decoded_messages(topics=topics, **window):
                if channel.topic == "/sample":
                    labels[i] = message.max_pull_force_n
                else:
                    images[i, channel.topic.endswith("right")] = np.asarray(Image.open(io.BytesIO(message.data)))

    return batch


def main() -> None:
    """Both tables."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        keys = {"mechanics": "reduced", "design": "random", "samples": SAMPLES, "trace": "none", "shard_samples": 64}
        gg.sweep("asset:configs/quickstart.toml", run, set=keys)
        ds = gg.load(run)
        rng = np.random.default_rng(0)
        stock = rate(stock_reader(run, 64), BATCH)
        print(f"{'reader':24} {'samples/s':>10} {'to stock':>9}")
        print(f"{'mcap + Pillow':24} {stock:10.0f} {1.0:9.1f}")
        for threads in (1, 2):
            found = rate(lambda: ds.batch(rng.integers(0, SAMPLES, BATCH), threads=threads), BATCH)
            print(f"{f'gripgen, {threads} threads':24} {found:10.0f} {found / stock:9.1f}")
    environments()


def environments() -> None:
    """Steps per second under the staircase, restarts included."""
    import gymnasium as gym

    policy = gg.Staircase()
    print(f"\n{'environment':24} {'steps/s':>10}")
    for name, options in [("8 places, images", {}), ("8 places, no images", {"images": False})]:
        envs = gym.make_vec("gripgen/Pull-v0", num_envs=8, vectorization_mode="vector_entry_point", **options)
        seen, _ = envs.reset(seed=0)

        def step() -> None:
            nonlocal seen
            seen = envs.step(policy(seen))[0]

        print(f"{name:24} {rate(step, 8):10.0f}")


if __name__ == "__main__":
    main()
