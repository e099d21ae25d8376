"""The page of `gripgen view` in a real browser: it filters, orders and counts, fits its window, and asks no network for anything."""

import base64
import html
import io
import json
import re
import shutil
import subprocess
import tarfile

import numpy as np
import pytest
from conftest import gripgen
from PIL import Image

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "chrome"]

# What the test does with the page, and what it finds; the answer stands in the page that the browser prints.
SCRIPT = """
<pre id="found"></pre><script>
const errors = []; window.onerror = message => errors.push(String(message));
const shown = () => [...document.querySelectorAll(".pull")].filter(c => !c.hidden);
const set = (name, value) => { form.elements[name].value = value; form.dispatchEvent(new Event("input")); };
const own = () => charts.map(c => [...c.querySelectorAll("rect.own")].filter(r => Number(r.getAttribute("height")) > 0).length);
const state = () => ({cards: shown().map(c => c.dataset.row), count: document.getElementById("count").textContent, bars: own()});
const found = {all: state(), width: document.documentElement.scrollWidth, inner: window.innerWidth,
  paper: getComputedStyle(document.body).backgroundColor,
  images: document.images.length};
const part = form.elements.part.options[1].value;
set("part", part); found.part = {name: part, parts: [...new Set(shown().map(c => c.dataset.part))], ...state()};
set("part", ""); set("from", "25"); found.from = {forces: shown().map(c => Number(c.dataset.force)), ...state()};
set("from", ""); set("order", "label"); found.labels = shown().map(c => Number(c.dataset.label));
set("order", "far"); found.far = shown().map(c => Number(c.dataset.far));
set("order", "row"); found.again = state();
shown()[0].querySelector("img").click(); found.large = document.querySelectorAll(".pull.large").length;
found.errors = errors; document.getElementById("found").textContent = JSON.stringify(found);
</script></body>
"""


def browser():
    """A browser without a window, or the test is skipped with what is missing."""
    for name in BROWSERS:
        if path := shutil.which(name):
            return path
    pytest.skip(f"no browser to open pages with: none of {', '.join(BROWSERS)} is installed")


def opened(page, width, dark, tmp_path):
    """What the script finds in a window of this width."""
    tried = tmp_path / f"tried-{width}.html"
    tried.write_text(page.read_text().replace("</body>", SCRIPT))
    command = [
        browser(), "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
        "--host-resolver-rules=MAP * ~NOTFOUND", f"--window-size={width},900", "--virtual-time-budget=20000",
        f"--user-data-dir={tmp_path / 'profile'}", f"--blink-settings=preferredColorScheme={0 if dark else 1}", "--dump-dom",
        tried.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    answer = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    assert answer and answer.group(1), done.stderr[-2000:]
    return json.loads(html.unescape(answer.group(1)))


@pytest.fixture(scope="module")
def page(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("view") / "page.html"
    gripgen("view", run, "-o", out)
    return out


def test_the_page_asks_for_nothing(page):
    text = page.read_text()
    assert not re.search(r"""(src|href)\s*=\s*["'](?!data:|#)""", text)
    assert "@import" not in text and "fetch(" not in text and "http" not in re.sub(r"data:[^\"]*", "", text)


def test_its_pictures_are_those_of_the_run(page, run, tmp_path):
    shown = re.findall(r'<img src="data:image/jpeg;base64,([^"]+)"', page.read_text())
    gripgen("export", run, "--to", "webdataset", "-o", tmp_path / "run.tar")
    with tarfile.open(tmp_path / "run.tar") as tar:
        names = [name for name in tar.getnames() if name.endswith((".left.png", ".right.png"))]
        assert len(shown) == len(names) == 32
        for coded, name in list(zip(shown, names, strict=True))[::7]:
            jpeg, png = (np.asarray(Image.open(file), dtype=float) for file in (io.BytesIO(base64.b64decode(coded)), tar.extractfile(name)))
            assert jpeg.shape == png.shape and np.abs(jpeg - png).mean() < 2.5, name


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_it_filters_orders_and_fits(page, run, width, dark, tmp_path):
    found = opened(page, width, dark, tmp_path)
    assert found["errors"] == []
    rows = (run / "index.csv").read_text().strip().splitlines()[1:]
    assert len(found["all"]["cards"]) == len(rows) and found["images"] == 2 * len(rows)
    assert found["width"] <= found["inner"], "nothing stands out to the right"
    assert found["all"]["count"].startswith(f"{len(rows)} of {len(rows)} pulls")
    part = found["part"]["name"]
    of_part = [row for row in rows if row.split(",")[4] == part]
    assert found["part"]["parts"] == [part] and len(found["part"]["cards"]) == len(of_part)
    assert found["part"]["count"].startswith(f"{len(of_part)} of {len(rows)} pulls")
    assert sum(found["part"]["bars"]) < sum(found["all"]["bars"]), "the selection has fewer bars"
    assert found["from"]["forces"] and min(found["from"]["forces"]) >= 25
    assert len(found["from"]["cards"]) < len(rows)
    assert found["labels"] == sorted(found["labels"])
    known = [x for x in found["far"] if x is not None]
    assert known == sorted(known, reverse=True)
    assert found["again"] == found["all"] and found["large"] == 1
    light = sum(map(int, re.findall(r"\d+", found["paper"])[:3])) > 3 * 128
    assert light != dark, found["paper"]


def test_a_shard_and_measured_pulls_have_a_page(run, tmp_path):
    said = json.loads(gripgen("view", sorted(run.glob("*.mcap"))[1], "-o", tmp_path / "shard.html", "--json").stdout)
    assert said["pulls"] == said["shown"] == 6
    folder = tmp_path / "measured"
    folder.mkdir()
    lines = [f"p{i},gear,{20 + i % 3 * 20},{(20 + i % 3 * 20) * 0.4 + i * 0.01},{i}" for i in range(300)]
    (folder / "pulls.csv").write_text("pull_id,part,grip_force_n,max_pull_force_n,humidity_pct\n" + "\n".join(lines))
    said = json.loads(gripgen("view", folder, "--pulls", 40, "--json").stdout)
    assert (said["pulls"], said["shown"]) == (300, 40)
    text = (folder / "view.html").read_text()
    assert "distribution of humidity_pct" in text and 'data-row="299"' in text and len(text) < 300_000
