"""Square markers: the layout of the three of them, one of them as seen in an image, and its drawing.

Positions on a marker's plane are metres from its middle, +x to the right and +y down as printed.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, InvalidInput, Role
from foveacam_pipeline.geometry.shapes import as_finite_rows

GREEN, AMBER, BLUE = (80, 220, 100), (255, 190, 60), (90, 170, 255)
SUBPIXEL_BITS = 3
PICTURE_SCALE = 0.5
"""Size of a drawing against the sensor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerLayout:
    """Three markers in one plane on a horizontal line, one for each camera.

    `side_m`: of the black square. `spacing_m`: from the wide camera's marker to each eye's. The ids are of
    the dictionary 4X4_50.
    """

    side_m: float = 0.060
    spacing_m: float = 0.100
    wide_id: int = 0
    left_id: int = 1
    right_id: int = 2

    def __post_init__(self) -> None:
        if not (self.side_m > 0.0 and self.spacing_m > self.side_m):
            raise InvalidInput(
                f"markers of {1e3 * self.side_m:g} mm, {1e3 * self.spacing_m:g} mm apart: a side above 0 and "
                "a spacing above the side are needed; measure both on the printed target"
            )
        if len(set(self.ids)) != 3:
            raise InvalidInput(f"markers {self.ids}: three different ids are needed, one for each camera")

    @property
    def ids(self) -> tuple[int, int, int]:
        """The ids of the wide camera's, the left eye's and the right eye's marker."""
        return self.wide_id, self.left_id, self.right_id

    def id_of(self, role: Role) -> int:
        """Return the id of a camera's own marker."""
        return {Role.WIDE: self.wide_id, Role.LEFT: self.left_id, Role.RIGHT: self.right_id}[role]

    def role_of(self, marker_id: int) -> Role | None:
        """Return the camera of a marker's id, None for an unknown id."""
        return dict(zip(self.ids, (Role.WIDE, Role.LEFT, Role.RIGHT), strict=True)).get(marker_id)

    def middle_m(self, role: Role) -> NDArray[np.float64]:
        """Return the middle of a camera's marker on the target, (2,) metres from the wide one's."""
        side = {Role.WIDE: 0.0, Role.LEFT: -1.0, Role.RIGHT: 1.0}[role]
        return np.array([side * self.spacing_m, 0.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerView:
    """One marker in one image, or the mean over several images of a scene at rest.

    `corners_px`: (k, 2) float64, raw pixels: the outer corners first (clockwise from the marker's own upper
    left), then the cell corners inside. `places_m`: (k, 2) float64, their printed positions. `sharpness`:
    1 / px, the inverse of the sigma of the edges' blur. `complete`: every corner is in the image, uncovered.
    `sigma_px`: standard error of a corner, from the residuals. `white_level`: of the paper, 0 to 255.
    """

    id: int
    corners_px: NDArray[np.float64]
    places_m: NDArray[np.float64]
    sharpness: float
    complete: bool
    sigma_px: float = 0.0
    white_level: float = 0.0

    def __post_init__(self) -> None:
        corners = as_finite_rows(self.corners_px, columns=2, name=f"corners of marker {self.id}")
        if len(corners) != len(as_finite_rows(self.places_m, columns=2, name=f"places of marker {self.id}")):
            raise InvalidInput(
                f"marker {self.id}: {len(corners)} corners and {len(self.places_m)} places; "
                "give each corner one"
            )

    @property
    def blur_px(self) -> float:
        """Sigma of the edges' blur."""
        return 1.0 / self.sharpness


def draw_markers(
    image: NDArray[np.uint8],
    views: list[MarkerView],
    *,
    accepted: bool,
    aim_px: NDArray[np.float64] | None,
    binning: Binning = 1,
) -> NDArray[np.uint8]:
    """Return the picture, uint8 RGB, with the markers' outlines and corners and the aim.

    It is half the sensor's size; `binning`: of the image.
    """
    share = binning * PICTURE_SCALE
    small = cv2.resize(image, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
    picture = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small.copy()
    colour = GREEN if accepted else AMBER
    for view in views:
        outline = np.rint(view.corners_px[:4] * PICTURE_SCALE * (1 << SUBPIXEL_BITS)).astype(np.int32)
        cv2.polylines(picture, [outline], True, colour, 1, cv2.LINE_AA, SUBPIXEL_BITS)
        for x, y in np.rint(view.corners_px * PICTURE_SCALE).astype(int).tolist():
            cv2.circle(picture, (x, y), 2, BLUE, -1, cv2.LINE_AA)
    if aim_px is not None:
        x, y = np.rint(aim_px * PICTURE_SCALE).astype(int).tolist()
        cv2.drawMarker(picture, (x, y), AMBER, cv2.MARKER_CROSS, 24, 1, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)
