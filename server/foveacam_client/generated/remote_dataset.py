# Written by .ci/generate_client.py; do not edit.
"""A dataset that a capture has made, read point by point from the server, also from its archive.

Written from `async_remote_dataset.py`.
"""

import operator
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any, SupportsIndex

from foveacam_client.connection import Connection
from foveacam_client.dataset_values import CameraRole, RemotePoint, checked_roles
from foveacam_client.generated import models
from foveacam_client.generated.operations import Operations
from foveacam_client.pictures import decode_picture
from foveacam_client.problems import ClientError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from foveacam_client.torch_points import TorchPoints


class RemoteDataset:
    """The captured points of a dataset, in the order in which they were taken: `len`, `[i]`, iteration.

    `[i]` reads the point's pictures at full size, 8 bits, the mean of a stack; `download_dataset` gives the
    files with all bits.
    """

    def __init__(
        self,
        api: Operations,
        connection: Connection,
        *,
        capture: models.CaptureDocument,
        points: models.PointsDocument,
        cameras: Collection[str] | None = None,
    ) -> None:
        self.capture = capture
        self.points = points.points
        self.skipped = points.skipped
        self.cameras = checked_roles(cameras)
        self._api = api
        self._connection = connection

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, index: SupportsIndex) -> RemotePoint:
        return self.read(index)

    def __iter__(self) -> Iterator[RemotePoint]:
        for index in range(len(self)):
            yield self.read(index)

    def read(self, index: SupportsIndex, *, bracket: int = 0) -> RemotePoint:
        """Return a point with its pictures; `bracket`: number of the exposure, from 0."""
        place = self._place(index)
        if not 0 <= bracket < max(1, place.brackets):
            raise IndexError(
                f"bracket {bracket} of point {place.index} was asked for, it has {place.brackets}, from 0"
            )
        pictures: dict[CameraRole, NDArray[Any]] = {}  # Any: dtype of the picture
        for role in self.cameras:
            if role in place.cameras:
                exposure = 0 if role == "wide" else bracket  # the wide camera takes one exposure a point
                picture = self._api.captures.picture(
                    self.capture.id, place.index, role, "png", bracket=str(exposure)
                )
                pictures[role] = decode_picture(picture.read())
        return RemotePoint(place, pictures)

    def torch(self) -> "TorchPoints":
        """Return the points as a `torch.utils.data.Dataset`; raise `ClientError` without PyTorch.

        An item: the pictures that every point has, (c, h, w) float32 in 0..1, by camera; `point`,
        `aim_ax_deg`, `aim_ay_deg`, `distance_m`, NaN where unknown. Each item is read over a connection of
        its own, so that workers of a `DataLoader` share the work.
        """
        try:
            from foveacam_client.torch_points import TorchPoints
        except ImportError as error:
            raise ClientError(
                "asked for a dataset of PyTorch, and the package torch is not installed: pip install torch"
            ) from error
        return TorchPoints(
            self._connection, capture_id=self.capture.id, places=self.points, cameras=self.cameras
        )

    def _place(self, index: SupportsIndex) -> models.PointDocument:
        number = operator.index(index)
        if not -len(self) <= number < len(self):
            raise IndexError(
                f"point {number} of dataset {self.capture.id} was asked for, it has {len(self)}, from 0"
            )
        return self.points[number]

    def __repr__(self) -> str:
        capture = self.capture
        counts = f"{len(self)} of {capture.points.planned} points"
        return f"{type(self).__name__}(id={capture.id!r}, {capture.name!r}, {capture.state}, {counts})"
