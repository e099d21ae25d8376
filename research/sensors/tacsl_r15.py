"""A sensor file of gripgen from the GelSight R1.5 calibration of TacSL.

    python research/sensors/tacsl_r15.py FOLDER sensor.npz [--hold-deg 34] [--json figures.json]

FOLDER holds `bg.jpg`, a frame without contact of 240 x 320 pixels, and `polycalib.npz`, a table of colours by steepness and direction of the
slope of the gel, each a polynomial of second degree in the pixel position. Both come from `gelsight_r15_data` of IsaacGymEnvs, branch `tacsl`.

The sensor file holds the frame, turned by 90 degrees counter-clockwise to 320 x 240 pixels, and gripgen's own colour model, fitted to the table:
monomials of the normal up to degree 4 times polynomials of the position. The model is 0 on a gel at rest, so that no contact gives the frame
exactly; the table is not. What is fitted is therefore the table minus the mean over all directions of its flattest row, up to slopes of 45 degrees.
Normals steeper than `--hold-deg` are held there, in the fit as in gripgen.

How the table is read:

* Rows are steepness, 124 steps of (pi / 2) / 124 and one more that holds a vertical wall; columns are directions, 124 steps of 2 pi / 124 from
  -pi on, and one more that is the first again. A gel that is pressed in is high, as in Taxim.
* Positions are column and row of the frame as it is stored, 0 to 239 and 0 to 319.
* `grad_r` is red. In Taxim's own tables it is blue.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

MM_PER_PX = 0.0877
NOISE_RGB = (1.0, 0.9, 1.2)
KEYS_RGB = ("grad_r", "grad_g", "grad_b")

STORED_WIDTH, STORED_HEIGHT = 240, 320
WIDTH, HEIGHT = STORED_HEIGHT, STORED_WIDTH

STEPS = 124
STEEPNESS_STEP = np.pi / 2 / STEPS
DIRECTION_STEP = 2 * np.pi / STEPS
# Rows that are fitted: up to 45 degrees. Above that the rows of the table are copies of one.
FITTED_ROWS = np.arange(1, 62)
HOLD_DEG = 34.0

# gripgen's regression: monomials of the normal of degree 1 to 4, then six with the height, which the table knows nothing of.
NORMAL_POWERS = [(degree - k, k) for degree in range(1, 5) for k in range(degree + 1)]
NEAR_TERMS, NEAR_FIELD = len(NORMAL_POWERS) + 6, 10
SURROUNDINGS, AROUND_FIELD = 40, 6
NO_LIMIT = 1e6

# How the gel gives way: from a fit to presses of another sensor, in pixels of this one (8 mm to 0.6 mm).
KERNELS_PX = (91, 45, 23, 11, 7)
SINK_IN_FRACTION = 0.4


@dataclass
class Table:
    """Coefficients of `x^2, y^2, x y, x, y, 1` by channel (red, green, blue), steepness and direction: (3, 125, 124, 6)."""

    coefficients: np.ndarray

    @classmethod
    def read(cls, path: Path) -> "Table":
        """Reads a `polycalib.npz`; the last column, which is the first again, is left out."""
        with np.load(path) as file:
            channels = np.stack([file[key] for key in KEYS_RGB]).astype(np.float64)
        if channels.shape != (3, STEPS + 1, STEPS + 1, 6):
            raise SystemExit(f"{path}: the table has the shape {channels.shape}, it must be (3, {STEPS + 1}, {STEPS + 1}, 6)")
        return cls(channels[:, :, :STEPS])

    def turned(self) -> "Table":
        """The table of a sensor whose images are those of this one turned by 90 degrees counter-clockwise.

        A pixel (x, y) lies at (y, 239 - x) afterwards, a slope that rises in direction d rises in d - 90 degrees, 31 columns before.
        """
        c0, c1, c2, c3, c4, c5 = np.moveaxis(self.coefficients, -1, 0)
        last = STORED_WIDTH - 1
        moved = [c1, c0, -c2, c4 + last * c2, -c3 - 2 * last * c0, c5 + last * c3 + last**2 * c0]
        return Table(np.roll(np.stack(moved, axis=-1), -STEPS // 4, axis=2))

    def values(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Values at places: (3, steepness, direction, places)."""
        return self.coefficients @ np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)])


def place(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """gripgen's coordinates of a pixel: 0 in the middle of the image, -1 to 1 along its width."""
    return (x - (WIDTH - 1) / 2) * 2 / WIDTH, (y - (HEIGHT - 1) / 2) * 2 / WIDTH


def field(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The monomials of a place, `1, u, v, u^2, u v, v^2, u^3, ...`: (10, places)."""
    return np.stack([u ** (degree - k) * v**k for degree in range(4) for k in range(degree + 1)])


def by_field(table: Table) -> np.ndarray:
    """The coefficients of a turned table for the first six monomials of [`field`]."""
    c0, c1, c2, c3, c4, c5 = np.moveaxis(table.coefficients, -1, 0)
    mx, my, unit = (WIDTH - 1) / 2, (HEIGHT - 1) / 2, WIDTH / 2
    constant = c0 * mx**2 + c1 * my**2 + c2 * mx * my + c3 * mx + c4 * my + c5
    along_u = unit * (2 * c0 * mx + c2 * my + c3)
    along_v = unit * (2 * c1 * my + c2 * mx + c4)
    return np.stack([constant, along_u, along_v, c0 * unit**2, c2 * unit**2, c1 * unit**2], axis=-1)


def normals(rows: np.ndarray, hold_deg: float) -> np.ndarray:
    """Components along x and y of the unit normal in the middle of each bin, held at a steepness: (2, rows x directions)."""
    steepness = (rows + 0.5) * STEEPNESS_STEP
    direction = (np.arange(STEPS) + 0.5) * DIRECTION_STEP - np.pi
    sine = np.sin(np.minimum(steepness, np.radians(hold_deg)))
    return np.stack([-np.outer(sine, np.cos(direction)).ravel(), -np.outer(sine, np.sin(direction)).ravel()])


def monomials(normal: np.ndarray) -> np.ndarray:
    """The monomials of normals in gripgen's order: (normals, 14)."""
    return np.stack([normal[0] ** a * normal[1] ** b for a, b in NORMAL_POWERS], axis=-1)


def rms(coefficients: np.ndarray) -> np.ndarray:
    """Root mean square over all pixels and bins of polynomials of the place: (3, bins, terms) to (3,)."""
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    f = field(*place(x.ravel(), y.ravel()))[: coefficients.shape[-1]]
    products = f @ f.T / f.shape[1]
    return np.sqrt(np.einsum("cbi,ij,cbj->c", coefficients, products, coefficients) / coefficients.shape[1])


@dataclass
class Fit:
    """gripgen's model and how far it is from the table, in grey levels of red, green and blue."""

    near: np.ndarray
    hold_deg: float
    residual: np.ndarray
    of: np.ndarray


def fit(table: Table, hold_deg: float) -> Fit:
    """Least squares over all pixels and all bins of the fitted rows, each with the same weight.

    A polynomial of the place can be fitted by its coefficients: the monomials of the normal are the same at every place.
    """
    by_place = by_field(table)
    target = by_place[:, FITTED_ROWS] - by_place[:, :1].mean(axis=2, keepdims=True)
    target = target.reshape(3, -1, target.shape[-1])
    terms = monomials(normals(FITTED_ROWS, hold_deg))
    near = np.zeros((3, NEAR_TERMS, NEAR_FIELD), np.float32)
    for channel in range(3):
        solution = np.linalg.lstsq(terms, target[channel], rcond=None)[0]
        near[channel, : len(NORMAL_POWERS), : target.shape[-1]] = solution
    # What is left is that of the numbers as they are stored.
    left = target - terms @ near[:, : len(NORMAL_POWERS), : target.shape[-1]].astype(np.float64)
    return Fit(near, hold_deg, rms(left), rms(target))


def turning_error(table: Table) -> float:
    """Largest difference in grey levels between the turned table and the table as it is, over all bins that slope and every fourth pixel."""
    turned = table.turned()
    x, y = (grid.ravel().astype(np.float64) for grid in np.meshgrid(np.arange(0, WIDTH, 4), np.arange(0, HEIGHT, 4)))
    columns = (np.arange(STEPS) + STEPS // 4) % STEPS
    worst = 0.0
    for channel in range(3):
        for rows in np.array_split(np.arange(1, STEPS + 1), 16):
            before = Table(table.coefficients[channel : channel + 1, rows]).values(STORED_WIDTH - 1 - y, x)[:, :, columns]
            after = Table(turned.coefficients[channel : channel + 1, rows]).values(x, y)
            worst = max(worst, float(np.abs(after - before).max()))
    return worst


def rest_frame(path: Path) -> np.ndarray:
    """The frame without contact, turned: (240, 320, 3) bytes of red, green and blue."""
    with Image.open(path) as image:
        frame = np.asarray(image.convert("RGB"))
    if frame.shape != (STORED_HEIGHT, STORED_WIDTH, 3):
        raise SystemExit(f"{path}: the frame has the shape {frame.shape}, it must be ({STORED_HEIGHT}, {STORED_WIDTH}, 3)")
    return np.ascontiguousarray(np.rot90(frame))


def sensor_file(rest: np.ndarray, found: Fit) -> dict[str, np.ndarray]:
    """The arrays of a sensor file (`crates/tactile/src/sensor/file.rs`)."""
    # The steepest slope, then the height and the surroundings, which have no say.
    limits = np.full(2 + SURROUNDINGS, NO_LIMIT, np.float32)
    limits[0] = np.sin(np.radians(found.hold_deg))
    return {
        "gripgen_sensor": np.float64(1),
        "mm_per_px": np.float64(MM_PER_PX),
        "rest_rgb": rest,
        "noise_rgb": np.array(NOISE_RGB),
        "regressor_near": found.near,
        "regressor_around": np.zeros((3, SURROUNDINGS, AROUND_FIELD), np.float32),
        "regressor_limits": limits,
        "regressor_mm_per_px": np.float64(MM_PER_PX),
        "kernels_px": np.array(KERNELS_PX, np.float64),
        "restore_depth_fraction": np.float64(SINK_IN_FRACTION),
        "sink_in_fraction": np.float64(SINK_IN_FRACTION),
        "core_at_least": np.float64(1),
        "unverified": np.float64(1),
    }


def main() -> None:
    """Writes the sensor file and prints the figures of the fit."""
    parser = argparse.ArgumentParser(description="Makes a sensor file of gripgen from the GelSight R1.5 calibration of TacSL.")
    parser.add_argument("folder", type=Path, help="folder with bg.jpg and polycalib.npz")
    parser.add_argument("output", type=Path, help="sensor file to write (.npz)")
    parser.add_argument("--hold-deg", type=float, default=HOLD_DEG, help="steepness at which colours are held (%(default)s)")
    parser.add_argument("--json", type=Path, help="file for the figures of the fit")
    args = parser.parse_args()

    table = Table.read(args.folder / "polycalib.npz")
    found = fit(table.turned(), args.hold_deg)
    np.savez_compressed(args.output, **sensor_file(rest_frame(args.folder / "bg.jpg"), found))
    figures = {
        "hold_deg": found.hold_deg,
        "residual_rgb": found.residual.tolist(),
        "of_rgb": found.of.tolist(),
        "turning_error": turning_error(table),
        "bytes": args.output.stat().st_size,
    }
    print("grey levels, rms over pixels and slopes up to 45 degrees")
    for name, left, of in zip(("red", "green", "blue"), found.residual, found.of, strict=True):
        print(f"  {name:5} {left:.2f} left of {of:.1f}")
    print(f"turned table against the table as it is: at most {figures['turning_error']:.1g} grey levels")
    print(f"{args.output}: {figures['bytes']} bytes")
    if args.json:
        args.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
