"""The normal force of a grip, from the imprint that it leaves in the gel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

# The gel is taken for a thin layer on a stiff plate: its pressure is k times the local depth, so that F = k V whatever the shape of the body.
# k and the scatters below were read off four grasps of a golf ball of about 24 N, two on each of two gels (M. Burgess, example data of
# GitHub GelSight-lab/EstimateModulus, 2023-12-06 and 2023-12-16), over the rows from half of the largest force on, but for `_PART`.
# The law is a choice: four grasps of one ball do not tell it from others (docs/diagnosis-imprints.md). Scatters are standard deviations of
# the natural logarithm of F / V.

#: Geometric mean over the two gels, 0.0724 and 0.0855 N/mm3 (mean of two grasps each).
_PRIOR_N_PER_MM3 = 0.0787
#: Contact area of those rows, geometric mean of 308, 314, 432 and 395 mm2.
_PRIOR_AREA_MM2 = 358.0
#: Between gels. The two are 0.17 apart: a deviation of 0.12, which with one degree of freedom is worth 0.45 at 90 %;
#: taken is what a prior for Young's modulus of such gels has.
_GEL = 0.40
#: Between grasps of one body. Pooled 0.070 with two degrees of freedom, worth 0.125 at 90 %; V at 25 N differs by up to 0.17.
_GRASP = 0.14
#: Between bodies: judged, a ball of one size says nothing of it. Whoever judged it knew six grasps of rigid bodies of the same set, two of them of a
#: strawberry, so it is not independent of that body. It proved too small for soft bodies.
_PART = 0.20
#: Between the pictures of one grasp, 5 to 25 N, with the delay of the readings fitted: 0.12 to 0.17.
_PICTURE = 0.15
#: On a half-space F ~ V / sqrt(A) in place of V (0.57 E* V / a under a ball, 0.64 under a flat punch). The exponent of A is taken for anything
#: from 0 to 1/2: root of the mean square.
_AREA_EXPONENT = 0.5 / np.sqrt(3.0)
#: Contact area of an imprint whose area is not known: deviation of its logarithm from that of the scale.
_AREA_UNKNOWN = 0.7
#: Smaller areas are not told from specks of noise.
_LEAST_AREA_MM2 = 10.0
#: Volume of a gel at rest, standard deviation.
_NOISE_MM3 = 2.0
#: Largest force of a reference grasp, at least: below it the noise of the volume and the delay of the readings count too much.
_LEAST_N = 5.0
#: 95 % quantile of the normal distribution.
_Z95 = 1.6449


@dataclass(frozen=True)
class ForceScale:
    """How many newtons a mm³ of an imprint stands for, on one gel. `dataclasses.asdict(scale)` is JSON, `ForceScale(**d)` reads it."""

    #: Force of one jaw over the volume of its imprint, N/mm³.
    n_per_mm3: float
    #: Standard deviation of its natural logarithm, for the gel and bodies in general.
    sigma: float
    #: Contact area of the grasps that it comes from, mm²; that of the prior where no area was given.
    area_mm2: float
    #: Reference grasps; 0 for the prior.
    grasps: int


@dataclass(frozen=True)
class Force:
    """Normal force of one jaw, with an interval. Arrays of the shape of the volumes, float64."""

    #: Newton.
    force_n: NDArray[np.float64]
    #: 90 % interval, newton.
    low_n: NDArray[np.float64]
    high_n: NDArray[np.float64]
    #: Where the newtons come from.
    scale: ForceScale


#: Without a reference grasp.
_PRIOR = ForceScale(_PRIOR_N_PER_MM3, _GEL, _PRIOR_AREA_MM2, 0)


def force(volume_mm3: ArrayLike, area_mm2: ArrayLike | None = None, scale: ForceScale | None = None) -> Force:
    """Estimate the normal force of one jaw from the volume of its imprint, as that of `imprints.csv`.

    `volume_mm3` and `area_mm2` (the contact area) have one shape, or shapes that broadcast. Without `scale` the newtons are those of the gels of
    one published set, right to a factor of 2.3 or more (90 %); `force_scale` fits one to a grasp with a known force.

    The force is proportional to the volume, as of a thin elastic layer. The area does not move it: the interval widens as the area differs
    from that of the scale, because a thick gel would make small contacts stiffer. Without an area, a factor of 2 either way is allowed for.
    The interval is that of one picture of a grasp that was not seen before. Volumes at or below 0 are noise of a gel without contact: force 0.

    The estimate belongs to the moment of the picture; readings of a load cell may come 50 to 120 ms later.

    Raises ValueError where a value is not finite, or an area is negative.
    """
    volume = _finite("volume_mm3", volume_mm3)
    used = _PRIOR if scale is None else scale
    away = np.full(volume.shape, _AREA_UNKNOWN)
    if area_mm2 is not None:
        area = _areas(area_mm2)
        volume, area = np.broadcast_arrays(volume, area)
        away = np.log(area / max(used.area_mm2, _LEAST_AREA_MM2))
    sigma = np.sqrt(used.sigma**2 + _PART**2 + _GRASP**2 + _PICTURE**2 + (_AREA_EXPONENT * away) ** 2)
    factor = np.exp(_Z95 * sigma)
    noise = _Z95 * _NOISE_MM3
    return Force(
        force_n=used.n_per_mm3 * np.maximum(volume, 0.0),
        low_n=used.n_per_mm3 * np.maximum(volume - noise, 0.0) / factor,
        high_n=used.n_per_mm3 * np.maximum(volume + noise, noise) * factor,
        scale=used,
    )


def force_scale(
    volume_mm3: ArrayLike, area_mm2: ArrayLike | None, force_n: ArrayLike, grasp: ArrayLike | None = None
) -> ForceScale:
    """Fit the scale of one gel to imprints whose normal force is known: one grasp is enough.

    One value for each picture, [N]; `area_mm2` may be None. `grasp` tells grasps apart (any labels); without it all rows are one. The rows of a
    grasp from half of its largest force on count, by their median: hold the grip for a second, and a delay of the readings does not
    matter. Grasps count alike. Several grasps of one body take off their own scatter, not that between bodies.

    Raises ValueError where values are not finite or lengths differ, and where a grasp has no 5 N or no imprint.
    """
    volume, known = _finite("volume_mm3", volume_mm3), _finite("force_n", force_n)
    area = None if area_mm2 is None else _areas(area_mm2)
    labels = np.zeros(volume.shape, dtype=int) if grasp is None else np.asarray(grasp)
    for name, values in (("area_mm2", area), ("force_n", known), ("grasp", labels)):
        if values is not None and values.shape != volume.shape:
            raise ValueError(f"{name} has the shape {values.shape}, volume_mm3 has {volume.shape}")
    names = np.unique(labels)
    if len(names) == 0:
        raise ValueError("there is no reference grasp")
    scales, areas = [], []
    for name in names:
        rows = labels == name
        most = known[rows].max()
        if most < _LEAST_N:
            raise ValueError(f"the largest force of a reference grasp is {most:.3g} N, it must be at least {_LEAST_N:.0f} N")
        rows &= (known >= most / 2) & (volume > 3 * _NOISE_MM3)
        if not rows.any():
            raise ValueError("a reference grasp has no imprint: its volumes are not above the noise of a gel at rest")
        scales.append(np.median(np.log(known[rows] / volume[rows])))
        if area is not None:
            areas.append(np.median(np.log(area[rows])))
    return ForceScale(
        n_per_mm3=float(np.exp(np.mean(scales))),
        sigma=float(np.sqrt(_PART**2 + _GRASP**2 / len(scales))),
        area_mm2=float(np.exp(np.mean(areas))) if areas else _PRIOR_AREA_MM2,
        grasps=len(scales),
    )


def _finite(name: str, values: ArrayLike) -> NDArray[np.float64]:
    found = np.asarray(values, dtype=np.float64)
    if not np.isfinite(found).all():
        raise ValueError(f"{name} has a value that is not finite")
    return found


def _areas(values: ArrayLike) -> NDArray[np.float64]:
    found = _finite("area_mm2", values)
    if (found < 0).any():
        raise ValueError(f"area_mm2 has a negative value, {found.min():.3g}")
    return np.maximum(found, _LEAST_AREA_MM2)
