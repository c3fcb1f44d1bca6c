"""The points of a dataset on the server for PyTorch; the only importer of torch here."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import torch
from torch.utils.data import Dataset

from foveacam_client.connection import Connection
from foveacam_client.dataset_values import CameraRole
from foveacam_client.generated import models
from foveacam_client.generated.rig import Rig
from foveacam_client.pictures import decode_picture

if TYPE_CHECKING:
    from numpy.typing import NDArray

TorchItem = dict[str, torch.Tensor | int | float]


class TorchPoints(Dataset[TorchItem]):
    """Items are read in the process that asks for them; pickled with the connection, for workers alone."""

    def __init__(
        self,
        connection: Connection,
        *,
        capture_id: str,
        places: Sequence[models.PointDocument],
        cameras: Sequence[CameraRole],
    ) -> None:
        self._connection = connection
        self._capture_id = capture_id
        self._places = tuple(places)
        self.cameras = tuple(
            role for role in cameras if places and all(role in place.cameras for place in places)
        )

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, index: int) -> TorchItem:
        place = self._places[index]
        item: TorchItem = {
            "point": place.index,
            "aim_ax_deg": _number(place.aim_ax_deg),
            "aim_ay_deg": _number(place.aim_ay_deg),
            "distance_m": _number(place.distance_m),
        }
        with Rig(self._connection) as rig:
            for role in self.cameras:
                picture = rig.api.captures.picture(self._capture_id, place.index, role, "png")
                item[role] = _planes(decode_picture(picture.read()))
        return item


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _planes(picture: "NDArray[Any]") -> torch.Tensor:  # Any: uint8
    """Return a picture as (c, h, w) float32 in 0..1."""
    values = torch.from_numpy(picture).to(torch.float32) / 255.0
    return values[None] if values.ndim == 2 else values.permute(2, 0, 1).contiguous()
