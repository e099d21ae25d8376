"""Deformation, colour and noise of one image with OpenCV and numpy, beside gripgen, as Markdown.

    python benches/peers/tactile.py --gripgen FILE [--gripgen-command COMMAND] [--taxim]

FILE is written by `cargo bench --bench tactile_stages -- FILE.json`, which COMMAND may be; FILE.f32 beside it holds the
contact and the surfaces of gripgen (with the shipped sensor's blurs and with those of a sensor that was calibrated anew), so that
all work on the same press and their heights can be compared. With --taxim
the package `taxim` (1.4.1, on JAX) is timed too, if it is installed. One thread, CPU time, the shortest of many runs.
"""

import argparse
import json
import math
import platform
import shlex
import subprocess
import time

import cv2
import numpy as np


def best_us(run, repeats=60):
    """Shortest CPU time of the process over some runs, in microseconds."""
    run()
    shortest = math.inf
    for _ in range(repeats):
        start = time.process_time()
        run()
        shortest = min(shortest, time.process_time() - start)
    return 1e6 * shortest


def deform(depth, core, kernels):
    """Taxim's pyramid on a flat gel: blur, put the core back, and a last blur."""
    z = depth
    for k in kernels:
        z = cv2.GaussianBlur(z, (k, k), 0)
        z[core] = depth[core]
    return cv2.GaussianBlur(z, (5, 5), 0)


def slopes(z):
    """Central differences, the border copies its neighbour."""
    x, y = np.zeros_like(z), np.zeros_like(z)
    x[:, 1:-1] = (z[:, 2:] - z[:, :-2]) * 0.5
    y[1:-1] = (z[2:] - z[:-2]) * 0.5
    inner = (slice(1, -1), slice(1, -1))
    return np.pad(x[inner], 1, mode="edge"), np.pad(y[inner], 1, mode="edge")


def colour(x, y, table, places):
    """A table of polynomials by slope and direction, as Taxim has it."""
    bins = table.shape[1]
    i = np.floor(np.arctan(np.hypot(x, y)) / (0.5 * np.pi / (bins - 1))).astype(int)
    j = np.floor((np.arctan2(y, x) + np.pi) / (2 * np.pi / (bins - 1))).astype(int)
    return [np.einsum("hwk,hwk->hw", channel[i, j], places) for channel in table]


def finish(rest, change, stream):
    """Noise of one grey level, and rounding."""
    noise = stream.standard_normal(rest.shape, dtype=np.float32)
    return np.clip(rest + change + noise + 0.5, 0, 255).astype(np.uint8)


def taxim_us(is_shadowed):
    """The package's image at 320 x 240; None if it is not installed."""
    try:
        from taxim import Taxim
        sensor = Taxim(params={"sensor": {"w": 320, "h": 240, "pixmm": 0.059}}, backend="jax", device="cpu")
    except ImportError as error:
        print(f"taxim is left out: {error}\n")
        return None
    y, x = np.mgrid[:240, :320]
    # A ball of 4 mm: distance from the gel in mm, growing away from it.
    heights = (((x - 160) ** 2 + (y - 120) ** 2) * 0.059**2 / 8.0).astype(np.float32)
    return best_us(lambda: sensor.render(heights, with_shadow=is_shadowed, press_depth=1.0), 20)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gripgen", required=True, metavar="FILE")
    parser.add_argument("--gripgen-command", metavar="COMMAND")
    parser.add_argument("--taxim", action="store_true")
    options = parser.parse_args()
    if options.gripgen_command:
        subprocess.run(shlex.split(options.gripgen_command), check=True, stdout=subprocess.DEVNULL)
    with open(options.gripgen, encoding="utf-8") as file:
        ours = json.load(file)
    cv2.setNumThreads(1)
    shape = (ours["height_px"], ours["width_px"])
    depth, surface, wide_surface = np.fromfile(options.gripgen + ".f32", dtype="<f4").reshape(3, *shape)
    core = depth > np.float32(ours["restore_depth_fraction"] * ours["press_px"])
    kernels = ours["kernels_px"]
    deformed = deform(depth, core, kernels)
    calibrated = ours["calibrated"]
    wide_core = depth > np.float32(calibrated["restore_depth_fraction"] * ours["press_px"])
    wide = deform(depth, wide_core, calibrated["kernels_px"])
    stream = np.random.default_rng(1)
    table = stream.normal(size=(3, 125, 125, 6))
    v, u = np.mgrid[: shape[0], : shape[1]]
    places = np.stack([u * u, v * v, u * v, u, v, np.ones(shape)], axis=-1).astype(float)
    x, y = slopes(deformed)
    change = np.zeros((*shape, 3), np.float32)
    rest = np.full((*shape, 3), 110, np.float32)
    peers = {
        "deform": best_us(lambda: deform(depth, core, kernels)),
        "gradient": best_us(lambda: slopes(deformed)),
        "colour": best_us(lambda: colour(x, y, table, places)),
        "noise and rounding": best_us(lambda: finish(rest, change, stream)),
    }
    wide_us = best_us(lambda: deform(depth, wide_core, calibrated["kernels_px"]))
    us = ours["us"]
    fastest = [key.split(", ")[1] for key in us if key.startswith("surface, ")][-1]
    rows = [
        ("deform", us[f"surface, {fastest}"], peers["deform"]),
        ("gradient", us["gradient"], peers["gradient"]),
        ("colour", us["shade"], peers["colour"]),
        ("noise and rounding", us["finish"], peers["noise and rounding"]),
        ("image from the contact", us[f"image, {fastest}"], sum(peers.values())),
        ("deform, calibrated", us["surface of regressor"], wide_us),
        ("colour, calibrated", us["shade of regressor"], peers["colour"]),
        (
            "image from the contact, calibrated",
            us[f"image, regressor, {fastest}"],
            sum(peers.values()) - peers["deform"] + wide_us,
        ),
    ]
    print(f"Python {platform.python_version()}, OpenCV {cv2.__version__}, numpy {np.__version__}; gripgen on {fastest}\n")
    print(f"{shape[1]} x {shape[0]} pixels, {100 * ours['contact_share']:.1f} % in contact, kernels {kernels}\n")
    print("| stage | gripgen, us | OpenCV and numpy, us | ratio |\n|---|---|---|---|")
    for name, a, b in rows:
        print(f"| {name} | {a:.0f} | {b:.0f} | {b / a:.1f} |")
    print(f"| press: {ours['triangles']} triangles to contact | {us[f'press, {fastest}']:.0f} | - | - |")
    every = {kind: us[f"press and image, {kind}{fastest}"] for kind in ("", "regressor, ", "shadow, ", "regressor_shadow, ")}
    print(f"| all from the mesh | {every['']:.0f} | - | - |")
    print(f"| all from the mesh, calibrated | {every['regressor, ']:.0f} | - | - |")
    print(f"| all from the mesh, with shadow | {every['shadow, ']:.0f} | - | - |")
    print(f"| all from the mesh, calibrated, with shadow | {every['regressor_shadow, ']:.0f} | - | - |")
    for is_shadowed, kind in ((False, "regressor, "), (True, "regressor_shadow, ")):
        if options.taxim and (package := taxim_us(is_shadowed)):
            name = f"package taxim 1.4.1 (JAX), its image {'with' if is_shadowed else 'without'} shadow"
            print(f"| {name}, beside ours from the mesh | {every[kind]:.0f} | {package:.0f} | {package / every[kind]:.0f} |")
    print(f"\nKernels of the calibrated sensor: {calibrated['kernels_px']}")
    for name, a, b in (("shipped", deformed, surface), ("calibrated", wide, wide_surface)):
        print(f"Largest difference of the deformed heights, {name}: {np.abs(a - b).max():.1e} px")


if __name__ == "__main__":
    main()
