"""Streams: the batches of a run without its folder, in any number of threads, ranks, workers and passes."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest

import gripgen as gg

from .conftest import CONFIG, SMALL


def stream(**more):
    return gg.stream(CONFIG, **{"set": SMALL, "batch_size": 5, **more})


def test_a_stream_is_the_run_without_its_folder(run):
    ds = gg.load(run)
    wanted, labels = ds.batch(range(len(ds)))
    columns = ["index", "part", "grip_force_n", "grip_pose", "mu_effective", "shard", "in_shard", "status"]
    for jobs, ahead in ((1, 1), (3, None), (2, 40)):
        found = list(stream(jobs=jobs, ahead=ahead, columns=columns))
        assert [len(batch.max_pull_force_n) for batch in found] == [5, 5, 5, 1]
        images = np.concatenate([batch.images for batch in found])
        assert images.dtype == np.uint8 and images.tobytes() == wanted.tobytes()
        assert np.concatenate([batch.max_pull_force_n for batch in found]).tobytes() == labels.tobytes()
        for name in columns:
            values = np.concatenate([np.asarray(batch.columns[name]) for batch in found])
            assert (values == ds.column(name)).all(), name
    # A second pass is the same as the first; without columns a batch is a pair.
    again = stream()
    for _ in range(2):
        pairs = list(again)
        assert np.concatenate([pair[0] for pair in pairs]).tobytes() == wanted.tobytes()
    assert [len(labels) for _, labels in stream(drop_last=True)] == [5, 5, 5]


def test_films_come_without_a_folder(tmp_path):
    filmed = {**SMALL, "images": {"storage": "clean", "during_pull": {"frames": 4}}, "samples": 5, "design": "random"}
    gg.sweep(CONFIG, tmp_path / "run", jobs=2, set=filmed)
    ds = gg.load(tmp_path / "run", video=True)
    found = [film for batch in stream(set=filmed, video=True, batch_size=2) for film in batch.films]
    assert len(found) == len(ds) and any(film is not None for film in found)
    for i, film in enumerate(found):
        stored = ds.film(i)
        assert (film is None) == (stored is None)
        for name, value in vars(film).items() if film else ():
            other = getattr(stored, name)
            assert value.tobytes() == other.tobytes() if isinstance(value, np.ndarray) else value == other, name
    with pytest.raises(gg.ConfigError, match="its pulls are not filmed") as caught:
        stream(video=True)
    assert "during_pull" in caught.value.hint


def test_ranks_and_workers_share_the_sweep_and_lose_nothing(run):
    labels = gg.load(run).labels
    found = {}
    for rank in range(3):
        for part in range(2):
            own = stream(rank=rank, world_size=3, columns=["index"], batch_size=2).share(part, 2)
            for batch in own:
                found.update(zip(batch.columns["index"].astype(int), batch.max_pull_force_n))
    assert found == dict(enumerate(labels))
    with pytest.raises(gg.ConfigError, match="ranks count from 0"):
        stream(rank=3, world_size=3)


def test_a_stream_goes_on_where_it_was(run):
    ds = gg.load(run)
    first = stream(batch_size=4, columns=["index"])
    passed = iter(first)
    next(passed), next(passed)
    state = first.state_dict()
    copy = pickle.loads(pickle.dumps(stream(batch_size=4, columns=["index"])))
    copy.load_state_dict(state)
    assert np.concatenate([b.columns["index"] for b in copy]).tolist() == list(range(8, 16))
    # The pass after it is a whole one.
    assert sum(len(b.max_pull_force_n) for b in copy) == len(ds)
    # Of a worker's share, too: what all of them have read together is read.
    halves = [first.share(part, 2) for part in range(2)]
    left = sorted(int(i) for half in halves for batch in half for i in batch.columns["index"])
    assert left == list(range(8, 16))
    with pytest.raises(gg.ConfigError, match="config_sha256"):
        stream(set={**SMALL, "seed": 99}).load_state_dict(state)


def test_statuses_are_those_that_were_asked_for(tmp_path):
    # Offsets of up to 70 mm: some jaws miss the part, some samples may fail.
    wide = {**SMALL, "vary.grip_offset_mm": [0, 70]}
    gg.sweep(CONFIG, tmp_path / "run", jobs=2, set=wide)
    for status in ("slipped", ("slipped", "no_contact"), ("no_contact",)):
        ds = gg.load(tmp_path / "run", status=status)
        found = [b for b in stream(set=wide, status=status, columns=["index", "status"])]
        assert [int(i) for b in found for i in b.columns["index"]] == ds.column("index").astype(int).tolist()
    assert len(gg.load(tmp_path / "run", status=("no_contact",))) > 0


def test_what_cannot_be_is_told_before_anything_is_made(tmp_path):
    with pytest.raises(gg.ConfigError, match="nothing.toml"):
        gg.stream(tmp_path / "nothing.toml")
    with pytest.raises(gg.ConfigError, match="shard_samples"):
        stream(set={**SMALL, "shard_samples": -1})
    with pytest.raises(gg.DataError, match="there is no column 'colour'.*grip_force_n"):
        stream(columns=["index", "colour"])
    for size in (0, -1, 2.5):
        with pytest.raises(gg.ConfigError, match=f"batch_size = {size}, it must be a whole number, 1 at least"):
            stream(batch_size=size)
    with pytest.raises(gg.ConfigError, match="no status 'no_contct'; there are slipped, no_contact") as e:
        stream(status=["slipped", "no_contct"])
    assert e.value.hint == "did you mean `no_contact`?"
    images, labels = next(iter(stream(set={**SMALL, "images": "none"})))
    assert images is None and len(labels) == 5


def wait_for_rest(process):
    """Until the process uses the processor no more, however busy the machine is."""
    spent_s = [sum(process.cpu_times()[:2])]
    while len(spent_s) < 5 or spent_s[-1] - spent_s[-5] > 0.02:
        assert spent_s[-1] - spent_s[0] < 60, "a reader that waits lets the threads wait"
        time.sleep(0.2)
        spent_s.append(sum(process.cpu_times()[:2]))


def test_threads_wait_for_a_slow_reader_and_end_with_it():
    before = threading.active_count(), psutil.Process().num_threads()
    endless = gg.stream(CONFIG, batch_size=1, jobs=2, ahead=3, set={**SMALL, "design": "random", "repetitions": 1, "samples": 10**9})
    batches = iter(endless)
    next(batches)
    process = psutil.Process()
    wait_for_rest(process)
    held = process.memory_info().rss
    for _ in range(40):
        next(batches)
    assert process.memory_info().rss - held < 60e6, "nothing piles up"
    batches.close()
    del batches
    while process.num_threads() > before[1]:
        time.sleep(0.05)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
def test_an_iterator_is_read_by_the_process_that_began_it():
    """A child has no threads that make samples: it is told so, and does not wait for them; the stream itself can be read there."""
    stream = gg.stream(CONFIG, batch_size=4, set=SMALL)
    batches = iter(stream)
    first = next(batches)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            next(batches)
            said = "nothing"
        except gg.DataError as e:
            said = f"{e}"
        del batches
        again = next(iter(gg.stream(CONFIG, batch_size=4, set=SMALL)))
        os.write(write, f"{said} {(again[0] == first[0]).all()}".encode())
        os._exit(0)
    os.close(write)
    for _ in range(600):
        if os.waitpid(child, os.WNOHANG) != (0, 0):
            break
        time.sleep(0.1)
    else:
        os.kill(child, signal.SIGKILL)
        pytest.fail("the child waits for threads that it has not")
    with os.fdopen(read) as pipe:
        said = pipe.read()
    assert "begun in another process" in said and "hint:" in said and said.endswith("True"), said
    assert len(next(batches)[1]) == 4, "the parent goes on"


def test_a_stream_is_found_after_the_folder_was_changed(tmp_path, monkeypatch):
    (tmp_path / "sweep.toml").write_text('twin = "asset:configs/twin.toml"\nsamples = 2\nmechanics = "reduced"\nimages = "none"\n')
    monkeypatch.chdir(tmp_path)
    stream, sim = gg.stream("sweep.toml"), gg.Sim(gg.simulation.BASELINE, images=False)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert sum(len(labels) for _, labels in stream) == 2
    assert pickle.loads(pickle.dumps(sim)).parts == sim.parts


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_ends_a_stream():
    code = (
        # Whoever runs in the background of a shell has inherited that Ctrl-C is ignored.
        "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import gripgen as gg\n"
        f"s = gg.stream({CONFIG!r}, batch_size=10**6, set={{**{SMALL!r}, 'design': 'random', 'repetitions': 1, 'samples': 10**6}})\n"
        "print('begun', flush=True)\n"
        "next(iter(s))\n"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    assert child.stdout.readline() == "begun\n"
    time.sleep(1.0)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=300)
    assert child.returncode != 0 and "KeyboardInterrupt" in said
