"""What a sweep costs: against samples, threads, storage, size of the images, frames of the pull, triangles of the part, and mechanics.

    python benches/scaling.py --gripgen target/release/gripgen --work /tmp/scaling

Prints the tables of `docs/performance.md`. Wall clock of whole commands, the best of three where it is short; a slope is the exponent of the
best straight line in logarithms. The meshes are spheres of 16 mm that it makes itself. Needs no package; for figures that mean something nothing else may run.
"""

import argparse
import math
import os
import shutil
import struct
import subprocess
import time
import zipfile
from pathlib import Path

QUICKSTART = "asset:configs/quickstart.toml"
SENSOR = Path(__file__).parent.parent / "assets/sensors/gelsight_synthetic/sensor.npz"


def sphere(path, rings):
    """Writes a sphere of 4 * rings * (rings - 1) triangles as binary STL, mm; returns how many."""
    def at(i, j):
        theta, phi = math.pi * i / rings, math.pi * j / rings
        return [8 * math.sin(theta) * math.cos(phi), 8 * math.sin(theta) * math.sin(phi), 8 * math.cos(theta)]

    triangles = []
    for i in range(rings):
        for j in range(2 * rings):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            if i + 1 < rings:
                triangles.append((a, b, c))
            if i > 0:
                triangles.append((a, c, d))
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *[x for corner in t for x in corner], 0) for t in triangles)
    path.write_bytes(b"sphere".ljust(80) + struct.pack("<I", len(triangles)) + body)
    return len(triangles)


class Bench:
    """Sweeps with one binary, timed."""

    def __init__(self, gripgen, work):
        self.gripgen, self.work = gripgen, work

    def sweep(self, config=QUICKSTART, jobs=2, repeats=3, **keys):
        """Seconds of a sweep, and bytes of its shards."""
        keys = {"design": "random", "mechanics": "reduced", **keys}
        words = [w for k, v in keys.items() for w in ("--set", f"{k}={v}")]
        best = math.inf
        for _ in range(repeats):
            shutil.rmtree(self.work / "run", ignore_errors=True)
            start = time.perf_counter()
            subprocess.run([self.gripgen, "sweep", config, "-o", self.work / "run", "-q", "-j", str(jobs), *words], check=True, stdout=subprocess.DEVNULL)
            best = min(best, time.perf_counter() - start)
        return best, sum(f.stat().st_size for f in (self.work / "run").glob("*.mcap"))


def table(column, rows):
    """Prints rows of (level, samples, seconds, bytes), and the slope of the seconds of a sample where levels are numbers."""
    print(f"\n| {column} | samples | seconds | samples/s | kB a sample |\n|---|---|---|---|---|")
    for level, samples, seconds, size in rows:
        print(f"| {level} | {samples} | {seconds:.2f} | {samples / seconds:.0f} | {size / samples / 1e3:.1f} |")
    numbers = [(math.log(float(level)), math.log(seconds / samples)) for level, samples, seconds, _ in rows if isinstance(level, int)]
    if len(numbers) > 2:
        mx, my = (sum(x[i] for x in numbers) / len(numbers) for i in (0, 1))
        slope = sum((x - mx) * (y - my) for x, y in numbers) / sum((x - mx) ** 2 for x, _ in numbers)
        print(f"\nSeconds a sample go with the power {slope:.2f}.")


def own_part(work, name, rings):
    """A twin and a sweep of a sphere; its triangles."""
    triangles = sphere(work / f"{name}.stl", rings)
    (work / f"{name}-twin.toml").write_text(
        f'[robot]\nmodel = "carriage"\n[parts.{name}]\nmesh = "{name}.stl"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n'
        f"[[parts.{name}.grips]]\norigin_mm = [0, 0, 0]\norientation_deg = [0, 0, 0]\n"
    )
    (work / f"{name}.toml").write_text(
        f'twin = "{name}-twin.toml"\nsamples = 200\nseed = 1\n[vary]\ngrip_force_n = {{ uniform = [20, 40] }}\ngrip_angle_deg = {{ uniform = [-180, 180] }}\n'
    )
    return triangles


def arrays(path):
    """The members of an npz file, each as its header and its bytes."""
    with zipfile.ZipFile(path) as file:
        for name in file.namelist():
            content = file.read(name)
            end = 10 + struct.unpack_from("<H", content, 8)[0]
            yield name, content[10:end].decode(), content[end:]


def sensor_of_width(work, width):
    """The shipped sensor with pixels of another size, the same millimetres in view; returns its file."""
    path = work / f"sensor-{width}.npz"
    with zipfile.ZipFile(path, "w") as file:
        for name, header, data in arrays(SENSOR):
            if name == "mm_per_px.npy":
                data = struct.pack("<d", struct.unpack("<d", data)[0] * 320 / width)
            if name == "rest_rgb.npy":
                rows = [data[y * 240 // (width * 3 // 4) * 960 :][:960] for y in range(width * 3 // 4)]
                data = b"".join(row[x * 320 // width * 3 :][:3] for row in rows for x in range(width))
                header = header.replace("(240, 320, 3", f"({width * 3 // 4}, {width}, 3")
            file.writestr(name, b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header.encode() + data)
    return path


def of_width(work, width):
    """Keys of a sweep with images of that width: the sensor, and blurs over the same millimetres."""
    kernels = [2 * round((k - 1) / 2 * width / 320) + 1 for k in (71, 51, 21, 11, 5)]
    sensor = sensor_of_width(work, width).resolve()
    keys = {}
    for jaw in ("left", "right"):
        keys[f"optics.{jaw}.sensor"] = f'"{sensor}"'
        keys[f"gel.{jaw}.kernels_px"] = kernels
    return keys


def main():
    """All tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gripgen", default="gripgen")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--most", type=int, default=100_000, help="samples of the largest sweep")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    bench = Bench(options.gripgen, options.work)

    sizes = [n for n in (100, 1000, 10_000, 100_000) if n <= options.most]
    rows = [(n, n, *bench.sweep(samples=n, repeats=3 if n <= 1000 else 1, images="none", trace="none", shard_samples=min(1000, n // 4))) for n in sizes]
    table("samples, labels alone", rows)
    sizes = [n for n in sizes if n <= 10_000]
    rows = [(n, n, *bench.sweep(samples=n, repeats=3 if n <= 1000 else 1, shard_samples=min(250, n // 4))) for n in sizes]
    table("samples, images and traces", rows)
    rows = [(j, 1000, *bench.sweep(samples=1000, jobs=j, shard_samples=50)) for j in range(1, os.cpu_count() + 1)]
    table("threads", rows)
    rows = [(f"{s}, {c}" if s == "clean" else s, 500, *bench.sweep(samples=500, shard_samples=50, images=f'{{storage="{s}", compression="{c}"}}'))
            for s, c in [("png", "fast"), ("clean", "fast"), ("clean", "small"), ("raw", "fast"), ("none", "fast")]]
    table("images stored as", rows)
    rows = [(w, 200, *bench.sweep(samples=200, shard_samples=25, **of_width(options.work, w))) for w in (160, 320, 640, 960)]
    table("pixels across an image (4 : 3)", rows)
    rows = [(f, 100, *bench.sweep(samples=100, shard_samples=25, images=f"{{during_pull={{frames={f}}}}}")) for f in (4, 16, 64)]
    table("frames of the pull", rows)
    rows = []
    for rings in (10, 30, 100, 300):
        triangles = own_part(options.work, "ball", rings)
        rows.append((triangles, 200, *bench.sweep(config=options.work / "ball.toml", samples=200, shard_samples=25)))
    table("triangles of the part", rows)
    rows = [(m, 200, *bench.sweep(samples=200, shard_samples=25, mechanics=f'"{m}"', repeats=1)) for m in ("reduced", "rapier")]
    table("mechanics", rows)


if __name__ == "__main__":
    main()
