"""The page of `--live` in a real browser: it fills itself while a sweep is under way, fits its window, and asks no other machine."""

import os
import re
import shutil
import subprocess

import pytest

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "chrome"]


def text_of(dom, name):
    """What an element with this id holds, without tags."""
    found = re.search(rf'id="{name}"[^>]*>(.*?)</', dom, re.S)
    return found and re.sub(r"<[^>]*>", "", found.group(1)).strip()


@pytest.mark.parametrize("width_px", [390, 1280])
def test_a_sweep_is_watched_in_a_browser(tmp_path, width_px):
    browser = next((b for b in BROWSERS if shutil.which(b)), None)
    if browser is None:
        pytest.skip("no browser on this machine")
    run = [os.environ["GRIPGEN_BIN"], "sweep", "asset:configs/training.toml", "-o", str(tmp_path / "run"), "--live", "--jobs", "1"]
    run += ["--set", "samples=100000", "--set", "shard_samples=4"]
    sweep = subprocess.Popen(run, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    try:
        url = next(line.split()[1] for line in sweep.stderr if line.startswith("live: "))
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url)
        look = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--window-size={width_px},900", "--virtual-time-budget=4000"]
        dom = subprocess.run([*look, "--dump-dom", url], capture_output=True, text=True, timeout=120).stdout
    finally:
        sweep.terminate()
        sweep.wait(60)
    assert text_of(dom, "title") == "sweep training"
    made = text_of(dom, "made")
    assert re.match(r"[1-9]\d* of 100000 samples, [\d.]+ per", made), made
    assert "slipped" in text_of(dom, "counts")
    assert len(re.findall(r'class="dots"', dom)) >= 2, "labels of at least two parts"
    assert not re.search(r'(?:src|href)="https?:', dom), "it asks other machines"
