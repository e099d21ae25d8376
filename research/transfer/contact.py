"""Parts as height maps and an elastic gel that they are pressed into. Nothing here comes from gripgen.

Lengths in mm, forces in N, pressures in MPa. Arrays are [rows (y), columns (x)]; x is the long axis of a part.
"""

import numpy as np
from scipy import fft
from scipy.ndimage import gaussian_filter

CELL_MM = 0.35
PAD = (72, 96)  # cells of a pad: 25.2 x 33.6 mm
VIEW = (60, 80)  # cells that the camera sees: 21 x 28 mm
POISSON = 0.48
STEEP = 3.0  # fall of a wall outside an outline
KINDS = ("cylinder", "flat", "ball", "teeth", "hex", "ring", "ellipsoid", "stepped", "grooved", "cross")

Part = dict[str, float | str]


def draw_part(kind: str, rng: np.random.Generator) -> Part:
    """Sizes of one part."""
    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    return {
        "kind": kind, "radius": between(4, 15), "length": between(12, 45), "width": between(6, 30),
        "pitch": between(2, 6), "tooth": rng.uniform(0.2, 0.4), "step": rng.uniform(0.5, 1.5), "hole": rng.uniform(0.4, 0.8),
        "long": between(15, 60), "edge": rng.uniform(0.1, 0.5),
    }


def height_map(part: Part, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distance of the surface below its highest plane at points of the part."""
    kind, radius, length, width = part["kind"], part["radius"], part["length"], part["width"]

    def round_of(at: np.ndarray, r: float) -> np.ndarray:
        inside = r - np.sqrt(np.clip(r * r - at * at, 0, None))
        return inside + STEEP * np.clip(np.abs(at) - r, 0, None)

    def wall(at: np.ndarray, size: float) -> np.ndarray:
        return STEEP * np.clip(np.abs(at) - size / 2, 0, None)

    if kind == "cylinder":
        z = round_of(y, radius) + wall(x, length)
    elif kind == "flat":
        z = wall(x, length) + wall(y, width)
    elif kind == "ball":
        z = round_of(np.hypot(x, y), radius + 4)
    elif kind == "teeth":
        wave = np.clip(1.6 * np.cos(2 * np.pi * x / part["pitch"]), -1, 1)
        z = part["tooth"] * part["pitch"] * (1 - wave) / 2 + wall(y, width) + round_of(x, 2 * radius + 5)
    elif kind == "hex":
        z = np.tan(np.pi / 3) * np.clip(np.abs(y) - radius / 2, 0, None) + wall(x, length)
    elif kind == "ring":
        outer = radius + 3
        middle, band = outer * (1 + part["hole"]) / 2, outer * (1 - part["hole"])
        z = wall(np.hypot(x, y) - middle, band)
    elif kind == "ellipsoid":
        z = round_of(y, radius) + round_of(x, part["long"])
    elif kind == "stepped":
        z = round_of(y, radius) + np.where(x > 0, part["step"], 0.0) + wall(x, length)
    elif kind == "grooved":
        groove = np.clip(4 * np.cos(2 * np.pi * x / part["pitch"]) - 2, 0, 1)
        z = part["step"] * groove + wall(x, length) + wall(y, width)
    else:
        z = np.minimum(wall(x, length) + wall(y, width / 3), wall(y, length) + wall(x, width / 3))
    return np.clip(z, 0, 9.0)


def gap_of(part: Part, offset_mm: float, angle_deg: float, side_mm: float, tilt_deg: tuple[float, float]) -> np.ndarray:
    """Gap between a pad and a part that is gripped `offset_mm` from its middle, turned and tilted."""
    x, y = np.meshgrid((np.arange(PAD[1]) - PAD[1] / 2 + 0.5) * CELL_MM, (np.arange(PAD[0]) - PAD[0] / 2 + 0.5) * CELL_MM)
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    z = height_map(part, c * x + s * y + offset_mm, -s * x + c * y + side_mm)
    z = gaussian_filter(z, part["edge"] / CELL_MM, mode="nearest")
    z += np.tan(np.radians(tilt_deg[0])) * x + np.tan(np.radians(tilt_deg[1])) * y
    return z - z.min()


def compliance(modulus_mpa: np.ndarray, thickness_mm: np.ndarray) -> np.ndarray:
    """Transform of the response of layers that are bonded to a rigid back: mm per MPa, [pads, frequencies]."""
    ky = 2 * np.pi * np.fft.fftfreq(PAD[0], CELL_MM)[:, None]
    kx = 2 * np.pi * np.fft.rfftfreq(PAD[1], CELL_MM)[None]
    q = np.hypot(kx, ky)[None]
    h, e = thickness_mm[:, None, None], modulus_mpa[:, None, None]
    t, k = np.clip(q * h, 1e-6, 30.0), 3 - 4 * POISSON
    shape = (2 * k * np.sinh(2 * t) - 4 * t) / (2 * k * np.cosh(2 * t) + 1 + k * k + 4 * t * t)
    flat = h * (1 + POISSON) * (1 - 2 * POISSON) / (1 - POISSON) / e  # uniform pressure on a bonded layer
    with np.errstate(divide="ignore", invalid="ignore"):
        out = 2 * (1 - POISSON**2) / (e * q) * shape
    return np.where(q == 0, flat, out).astype(np.float32)


def press(gap: np.ndarray, force_n: np.ndarray, modulus_mpa: np.ndarray, thickness_mm: np.ndarray,
          stiffening: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Pressure and displacement of pads [N, rows, columns] at given forces: conjugate gradients with an active set.

    The layer is linear; its modulus grows by 1 + stiffening (depth / thickness)^2 with the depth found, by a fixed point.
    """
    gap = gap.astype(np.float32)
    response = compliance(modulus_mpa, thickness_mm)
    area = CELL_MM**2
    load = (force_n / area).astype(np.float32)[:, None, None]

    def total(a: np.ndarray) -> np.ndarray:
        return a.sum((1, 2), keepdims=True)

    pressure = np.where(gap < np.quantile(gap, 0.2, axis=(1, 2), keepdims=True) + 1e-6, 1.0, 0.0).astype(np.float32)
    pressure *= load / total(pressure)
    stiffer = np.ones_like(load)
    for rounds in (40, 25, 25):
        def bent(p: np.ndarray, by: np.ndarray = stiffer) -> np.ndarray:
            return fft.irfft2(fft.rfft2(p) * response, s=PAD) / by

        direction, before, restart = np.zeros_like(pressure), np.ones_like(load), np.zeros_like(load)
        for _ in range(rounds):
            touch = pressure > 0
            count = np.maximum(total(touch), 1)
            g = bent(pressure) + gap
            g = g - total(np.where(touch, g, 0)) / count
            size = total(np.where(touch, g * g, 0)) + 1e-20
            direction = np.where(touch, g + restart * size / before * direction, 0)
            before = size
            r = bent(direction)
            r = r - total(np.where(touch, r, 0)) / count
            step = total(np.where(touch, g * direction, 0)) / (total(np.where(touch, r * direction, 0)) + 1e-20)
            pressure = np.clip(np.where(touch, pressure - step * direction, 0), 0, None)
            overlap = ~(pressure > 0) & (g < 0)
            restart = np.where(total(overlap) > 0, 0.0, 1.0).astype(np.float32)
            pressure = np.where(overlap, np.abs(step) * -g, pressure)
            pressure = pressure * (load / np.maximum(total(pressure), 1e-12))
        moved = bent(pressure)
        deep = moved.max((1, 2), keepdims=True) / thickness_mm[:, None, None]
        stiffer = (1 + stiffening * np.minimum(deep, 1.5) ** 2).astype(np.float32)
    return pressure, bent(pressure)


def view_of(field: np.ndarray) -> np.ndarray:
    """What the camera sees of pads."""
    top, left = (PAD[0] - VIEW[0]) // 2, (PAD[1] - VIEW[1]) // 2
    return field[..., top:top + VIEW[0], left:left + VIEW[1]]
