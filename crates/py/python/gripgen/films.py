"""Films of pulls: what the cameras see while the part is pulled, and what the gels do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: What `Film.state` holds: nothing of the contact has left its place on the part, some of it has, all of it has.
STATES = ("stick", "incipient", "slip")


@dataclass(frozen=True, eq=False)
class Film:
    """F frames of both jaws, left jaw first. The first one of a simulation is the grip; those of a rig begin when the jaws close.

    Cell n of the contact is entry n - 1 of the arrays `cell_...`, NaN where a jaw has fewer than 64; lengths along the pull.
    """

    #: uint8[F, 2, H, W, 3]: without the noise of the sensors in a simulation, as the cameras sent it from a rig.
    images: NDArray[np.uint8]
    #: uint8[F, 2]: 0 stick, 1 incipient slip, 2 slip (`STATES`); 255 of a rig, where nobody knows: `cells` and `depth_mm` are 0 then.
    state: NDArray[np.uint8]
    #: float64[F]: time since the start of the pull, what both jaws take, way of the gripper.
    time_s: NDArray[np.float64]
    contact_force_n: NDArray[np.float64]
    displacement_mm: NDArray[np.float64]
    #: uint8[F, 2, H, W]: number of the cell of each pixel in contact, from 1; 0 beside the contact.
    cells: NDArray[np.uint8]
    #: float32[F, 2, H, W]: how deep the part lies below the surface of the gel at rest; 0 beside the contact.
    depth_mm: NDArray[np.float32]
    #: float32[F, 2, 64]: how far the surface of the gel stays behind the gripper, how far it has moved over the part, its force.
    cell_shear_mm: NDArray[np.float32]
    cell_slip_mm: NDArray[np.float32]
    cell_force_n: NDArray[np.float32]
    #: bool[F, 2, 64]: whether the cell has left its place on the part since the grip.
    cell_slipped: NDArray[np.bool_]
    #: float64[F, 2, 2]: direction of the pull in the image, right and down.
    pull_px: NDArray[np.float64]
    #: float32[F, 2, M, 2]: column and row of each marker; M = 0 without markers.
    markers_px: NDArray[np.float32]
    #: When the first and the last cell of both jaws left its place; None where none did.
    incipient_slip_s: float | None = None
    whole_slip_s: float | None = None
    #: float64[F, 2]: when each frame of a rig arrived since the start of the pull, by the robot's clock, and when its camera took it, by
    #: its own clock; NaN in a simulation, and where a camera does not say.
    received_s: NDArray[np.float64] | None = None
    device_time_s: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def contact(self) -> NDArray[np.bool_]:
        """bool[F, 2, H, W]: which pixels are in contact."""
        return self.cells > 0

    @property
    def slip_mm(self) -> NDArray[np.float32]:
        """float32[F, 2, H, W, 2]: how far the gel has moved over the part at each pixel, right and down in the image; 0 beside the
        contact."""
        return self._field(self.cell_slip_mm)

    @property
    def shear_mm(self) -> NDArray[np.float32]:
        """float32[F, 2, H, W, 2]: how far the surface of the gel is moved by the part at each pixel, right and down in the image; 0
        beside the contact."""
        return -self._field(self.cell_shear_mm)

    def _field(self, of_cells: NDArray[np.float32]) -> NDArray[np.float32]:
        frames, jaws = of_cells.shape[:2]
        values = np.concatenate([np.zeros((frames, jaws, 1), np.float32), np.nan_to_num(of_cells)], axis=2)
        at = self.cells.reshape(frames, jaws, -1).astype(np.intp)
        along = np.take_along_axis(values, at, axis=2).reshape(self.cells.shape)
        return along[..., None] * self.pull_px[:, :, None, None, :].astype(np.float32)
