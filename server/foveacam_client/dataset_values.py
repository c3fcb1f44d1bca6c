"""A point of a dataset with its pictures, and the cameras that took them."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from foveacam_client.generated import models
from foveacam_client.measured import distance_text
from foveacam_client.problems import ClientError

if TYPE_CHECKING:
    from numpy.typing import NDArray

CameraRole: TypeAlias = Literal["left", "right", "wide"]
ROLES: tuple[CameraRole, ...] = ("left", "right", "wide")


@dataclass(frozen=True, slots=True)
class RemotePoint:
    """A captured point; `place`: its number in the plan, aim, distance, and the cameras that took it.

    `pictures`: (h, w) or (h, w, 3) uint8, RGB, by camera; those that were asked for and taken.
    """

    place: models.PointDocument
    pictures: "Mapping[CameraRole, NDArray[Any]]" = field(repr=False)  # Any: dtype of the picture

    @property
    def index(self) -> int:
        """The point's number in the plan, from 0."""
        return self.place.index

    @property
    def left(self) -> "NDArray[Any] | None":  # Any: as above
        """The left fovea's picture; None where it was not asked for or not taken."""
        return self.pictures.get("left")

    @property
    def right(self) -> "NDArray[Any] | None":  # Any: as above
        """The right fovea's picture; None where it was not asked for or not taken."""
        return self.pictures.get("right")

    @property
    def wide(self) -> "NDArray[Any] | None":  # Any: as above
        """The wide picture; None where it was not asked for or not taken."""
        return self.pictures.get("wide")

    def __repr__(self) -> str:
        aim = (
            "unknown aim"
            if self.place.aim_ax_deg is None or self.place.aim_ay_deg is None
            else f"aim ({self.place.aim_ax_deg:.2f}°, {self.place.aim_ay_deg:.2f}°)"
        )
        pictures = ", ".join(f"{role} {picture.shape}" for role, picture in self.pictures.items())
        distance = distance_text(self.place.distance_m, None)
        return f"RemotePoint(index={self.index}, {aim}, {distance}, {pictures or 'no pictures'})"


def checked_roles(cameras: Collection[str] | None) -> tuple[CameraRole, ...]:
    """Return the cameras that are asked for, all without a choice; raise `ClientError` for others."""
    if cameras is None:
        return ROLES
    unknown = [name for name in cameras if name not in ROLES]
    if unknown or isinstance(cameras, str) or not cameras:
        raise ClientError(
            f"asked for the cameras {cameras!r} of a dataset; give a list, one or more of {', '.join(ROLES)}"
        )
    return tuple(role for role in ROLES if role in cameras)
