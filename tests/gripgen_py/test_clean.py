"""Images that are stored without noise: the bytes of the others when they are read, and what stock readers see."""

import io
import pickle

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

import gripgen as gg

from .conftest import CONFIG, SMALL, command_line


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    out = tmp_path_factory.mktemp("clean") / "run"
    gg.sweep(CONFIG, out, jobs=2, set={**SMALL, "images": "clean"})
    return out


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """The same without noise."""
    out = tmp_path_factory.mktemp("quiet") / "run"
    off = {"optics.left.image_noise": "off", "optics.right.image_noise": "off"}
    gg.sweep(CONFIG, out, jobs=2, set={**SMALL, **off})
    return out


def messages(run):
    """What the stock library and Pillow see: images and samples, and what the shards say of themselves."""
    images, samples, said = [], [], []
    for shard in sorted(run.glob("shard-*.mcap")):
        with open(shard, "rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages(topics=["/sample", "/tactile/left"]):
                if channel.topic == "/sample":
                    samples.append(message)
                else:
                    assert message.format == "png"
                    images.append(np.asarray(Image.open(io.BytesIO(message.data))))
            said += [m.metadata for m in reader.iter_metadata() if m.name == "gripgen.shard"]
    return np.stack(images), samples, said


def test_what_is_read_is_what_png_stores(run, clean):
    ds, noisy = gg.load(clean), gg.load(run)
    for ids in ([3], range(len(ds))):
        for threads in (1, 2):
            wanted, labels = noisy.batch(ids, threads=threads)
            images, found = ds.batch(ids, threads=threads)
            assert images.tobytes() == wanted.tobytes() and found.tobytes() == labels.tobytes()
    assert (ds[5].images == noisy[5].images).all()
    streamed = np.concatenate([b for b, _ in gg.stream(CONFIG, set={**SMALL, "images": "clean"})])
    assert streamed.tobytes() == noisy.batch(range(len(noisy)))[0].tobytes()
    size = [sum(p.stat().st_size for p in path.glob("shard-*.mcap")) for path in (clean, run)]
    # Without noise the texture of a real frame at rest is left: 0.66. Of the invented sensor it was below 0.6.
    assert size[0] < 0.7 * size[1], size


def test_stock_readers_see_clean_frames_and_how_to_add_the_noise(run, clean, quiet):
    images, samples, said = messages(clean)
    assert (images == messages(quiet)[0]).all()
    assert all(entry["images"] == "clean" for entry in said)
    assert all("images" not in entry for entry in messages(run)[2])
    # From the message alone, by docs/format.md.
    noise = samples[7].left_image_noise
    added = with_noise(images[7], noise.key, (noise.red, noise.green, noise.blue))
    assert (added == gg.load(run)[7].images[0]).all()
    assert not messages(run)[1][7].HasField("left_image_noise")


def with_noise(frame, key, deviations):
    """The noise of docs/format.md, in numpy."""

    def mix(h):
        h = (h ^ (h >> 16)) * 0x85EBCA6B & 0xFFFFFFFF
        h = (h ^ (h >> 13)) * 0xC2B2AE35 & 0xFFFFFFFF
        return h ^ (h >> 16)

    low, high = key & 0xFFFFFFFF, key >> 32
    first = mix(low ^ mix(high))
    second = mix(high ^ mix((low + first) & 0xFFFFFFFF))
    index = np.arange(frame.size, dtype=np.uint64)
    hashes = mix((mix(index ^ np.uint64(first)) + np.uint64(second)) & np.uint64(0xFFFFFFFF))
    total = sum((hashes >> np.uint64(8 * byte)) & np.uint64(255) for byte in range(4)).astype(np.int64)
    x = (total - 510) / 147.80054
    z = x * (0.9588452 + x**2 * (0.016671193 + x**2 * (-0.0020320107 + x**2 * 0.0003177025)))
    values = frame.reshape(-1) + z * np.tile(deviations, frame.size // 3)
    return np.clip(np.floor(values + 0.5), 0, 255).astype(np.uint8).reshape(frame.shape)


def test_noise_can_be_left_out_and_drawn_anew(run, clean, quiet):
    rows = range(6)
    stored, none = gg.load(clean).batch(rows)[0], gg.load(clean, noise="off").batch(rows)[0]
    assert none.tobytes() == gg.load(quiet).batch(rows)[0].tobytes()
    anew = gg.load(clean, noise="resample")
    first, again, second = (anew.with_noise("resample", e).batch(rows)[0].astype(int) for e in (0, 0, 1))
    assert (first == again).all() and (first != second).mean() > 0.4
    for images in (first, second, stored):
        noise = images - none.astype(int)
        assert abs(noise.mean()) < 0.01
        assert noise.std() == pytest.approx((stored - none.astype(int)).std(), rel=0.01)
    # Noise of other epochs has nothing to do with it.
    parts = [(images - none.astype(int)).ravel() for images in (first, second, stored)]
    assert np.abs(np.corrcoef(parts) - np.eye(3)).max() < 0.01
    epochs = [np.concatenate([b for b, _ in anew.iterate(shuffle=False, epoch=e)])[:6] for e in (0, 1)]
    assert (epochs[0] == first).all() and (epochs[1] == second).all()
    copy = pickle.loads(pickle.dumps(anew.with_noise("resample", 1).subset([0, 1])))
    assert (copy.batch([0, 1])[0] == second[:2]).all()
    with pytest.raises(gg.DataError, match="the noise of its images is in them"):
        gg.load(run, noise="off")
    with pytest.raises(gg.ConfigError, match="neither"):
        gg.load(clean, noise="pink")


def test_every_reader_adds_it(run, clean, tmp_path):
    for path, name in ((run, "noisy"), (clean, "clean")):
        command_line("export", path, "--sample", 4, "-o", tmp_path / f"{name}.mcap")
        command_line("export", path, "--to", "parquet", "-o", tmp_path / f"{name}.parquet")
        command_line("show", path, 4, "-o", tmp_path / f"{name}.png")
        command_line("verify", path)
    images = [messages_of(tmp_path / f"{name}.mcap") for name in ("noisy", "clean")]
    assert (images[0] == images[1]).all()
    pictures = [(tmp_path / f"{name}.png").read_bytes() for name in ("noisy", "clean")]
    assert np.array_equal(*(np.asarray(Image.open(io.BytesIO(p))) for p in pictures))
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = [parquet.read_table(tmp_path / f"{name}.parquet").column("right_png")[9].as_py()["bytes"] for name in ("noisy", "clean")]
    assert np.array_equal(*(np.asarray(Image.open(io.BytesIO(p))) for p in columns))


def messages_of(file):
    with open(file, "rb") as data:
        reader = make_reader(data, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages(topics=["/tactile/left", "/sample"]))
    assert not any(c.topic == "/sample" and m.HasField("left_image_noise") for _, c, _, m in found)
    return np.stack([np.asarray(Image.open(io.BytesIO(m.data))) for _, c, _, m in found if c.topic != "/sample"])
