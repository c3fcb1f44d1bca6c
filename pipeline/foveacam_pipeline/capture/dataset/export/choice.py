"""What an export is to hold."""

from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.rectify import SCALES


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportChoice:
    """`scale` of the images, where they are warped; `seeds_per_pair`: 3D points that a pair contributes.

    `on_point(index)` is called when a point is exported.
    """

    scale: float = 1.0
    seeds_per_pair: int = 100
    on_point: Callable[[int], None] | None = None

    def __post_init__(self) -> None:
        if self.scale not in SCALES:
            raise InvalidInput(f"export at scale {self.scale!r}: 0.5 or 1.0 is needed")
        if self.seeds_per_pair < 0:
            raise InvalidInput(f"{self.seeds_per_pair} points a pair: 0 or more are needed")

    def told(self, index: int) -> None:
        """Say that a point is exported."""
        if self.on_point is not None:
            self.on_point(index)
