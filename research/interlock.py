"""How far the formula of interlock is from bristles that give sideways: one tooth, pulled across.

    python research/interlock.py

A gel of bristles, each with a normal and a tangential spring, is pressed onto a saw of symmetric flanks and pulled over it at a constant
normal force. A tip sticks to the flank or slides on it (Coulomb). The table has the largest sideways force over the normal force, over mu: of
the formula, mu (1 + T^2) / (1 - mu^2 T^2) per point, and of bristles from nearly rigid sideways to as soft as in the normal direction.
"""

import numpy as np

MU = 0.15
PITCH_MM = 3.0
ROOTS = 120
DEPTH_MM = 0.5  # mean press


def saw(x_mm: np.ndarray, slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Height and slope of the part at x."""
    phase = np.mod(x_mm / PITCH_MM, 1.0)
    rises = phase < 0.5
    height = slope * PITCH_MM * np.where(rises, phase, 1.0 - phase)
    return height - slope * PITCH_MM / 4.0, np.where(rises, slope, -slope)


def resisting(slope: float, stiffness: float, mu: float = MU) -> float:
    """Largest sideways force over the normal force. `stiffness`: tangential over normal."""
    roots = (np.arange(ROOTS) + 0.5) / ROOTS * PITCH_MM
    bent = np.zeros(ROOTS)
    tries = np.linspace(-1.0, 1.0, 241)
    normal = DEPTH_MM * ROOTS
    lift, best, step = DEPTH_MM, 0.0, 0.008

    def excess(bent: np.ndarray, lift: float, way: float) -> np.ndarray:
        """Tangential force beyond what friction holds, with its sign; 0 where the tip sticks or floats."""
        height, m = saw(roots[:, None] + bent - way, slope)
        pressed = np.maximum(lift + height, 0.0)
        across = (pressed - m * stiffness * bent).clip(0.0)
        along = stiffness * bent + m * pressed
        return np.where(pressed > 0.0, np.sign(along) * np.maximum(np.abs(along) - mu * across, 0.0), stiffness * bent)

    for k in range(int(1.5 * PITCH_MM / step)):
        way = k * step
        bent = bent + step
        for _ in range(3):
            # The nearest place at which a tip sticks.
            reach = 0.02 + np.abs(bent).max()
            places = bent[:, None] + reach * tries
            free = np.abs(excess(places, lift, way)) <= 1e-3 * DEPTH_MM
            # A tip slides against the force that is too large.
            towards = (places - bent[:, None]) * excess(bent[:, None], lift, way) <= 0.0
            distance = np.where(free & towards, np.abs(places - bent[:, None]), np.inf)
            found = np.take_along_axis(places, distance.argmin(1)[:, None], 1)[:, 0]
            holds = np.abs(excess(bent[:, None], lift, way)[:, 0]) <= 1e-3 * DEPTH_MM
            bent = np.where(holds | ~np.isfinite(distance.min(1)), bent, found)
            pressed = np.maximum(lift + saw(roots + bent - way, slope)[0], 0.0)
            lift += (normal - pressed.sum()) / max((pressed > 0.0).sum(), 1)
        best = max(best, stiffness * bent[pressed > 0.0].sum() / pressed.sum())
    return best


def main() -> None:
    """Prints the table."""
    shares = (30.0, 3.0, 1.0)
    print(f"mu = {MU}; largest sideways over normal force, over mu")
    print("flank, deg | formula | " + " | ".join(f"k_t = {s:g} k_n" for s in shares))
    for degrees in (0, 10, 17, 25, 32):
        slope = float(np.tan(np.radians(degrees)))
        formula = (1.0 + slope**2) / (1.0 - (MU * slope) ** 2)
        of = [resisting(slope, s) / MU for s in shares]
        print(f"{degrees} | {formula:.2f} | " + " | ".join(f"{x:.2f}" for x in of))


if __name__ == "__main__":
    main()
