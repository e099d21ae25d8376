"""A pull of a rig is filmed, and read like the film of a sweep."""

import subprocess
import sys

import numpy as np

import gripgen as gg

COMMAND = [sys.executable, "-m", "gripgen", "rig"]


def test_the_film_of_a_pull(tmp_path):
    file = tmp_path / "rig.toml"
    serve = [*COMMAND, "serve", "--any-ports", "-q", "--in-step", "--speed", "2", "--write-rig", file]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as rig:
        try:
            assert rig.stdout.readline().startswith("ready")
            pull = [*COMMAND, "pull", file, "--parts", "gear", "--grip-force-n", "25", "--repetitions", "1"]
            run = tmp_path / "run"
            made = subprocess.run([*pull, "-o", run], capture_output=True, text=True, timeout=600, check=False)
            assert made.returncode == 0, made.stderr
        finally:
            rig.terminate()
    ds = gg.load(run, video=True)
    film = ds[0].film
    assert film.images.shape[1:] == (2, 240, 320, 3) and len(film) > 10
    assert (film.state == 255).all(), "nobody knows what slips"
    assert film.time_s[0] < 0 < film.time_s[-1] and (np.diff(film.time_s) > 0).all()
    assert (np.diff(film.device_time_s, axis=0) > 0).all(), "each camera by its own clock"
    assert np.abs(film.received_s.max(axis=1) - film.time_s).max() < 1e-9
    # The last frame before the pull is the grip, as it is stored: JPEG of the best quality.
    gripped = film.images[np.searchsorted(film.time_s, 0) - 1].astype(int)
    assert np.abs(gripped - ds[0].images).mean() < 2
    assert film.contact_force_n.max() > 3 and film.displacement_mm[-1] > 1
