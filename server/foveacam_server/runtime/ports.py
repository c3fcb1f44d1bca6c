"""What the runtime's parts ask of each other, as Protocols: where frames and pictures go, who shows a fixation."""

from typing import Protocol

import numpy as np
from foveacam_hardware.contract import Frame
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from numpy.typing import NDArray


class PictureSink(Protocol):
    """Where the newest image of each view goes; latest wins, never blocks, callable from any thread."""

    def publish_frame(self, frame: Frame) -> None:
        """Offer a camera frame to the view named by its role."""
        ...

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Offer a computed picture, (h, w, 3) uint8 RGB, of the moment `t_ns` to the view `name`."""
        ...


class Viewer(Protocol):
    """The 3D pane. Calls may take milliseconds, so never from the hardware thread."""

    @property
    def port(self) -> int:
        """Port on 127.0.0.1 that the relay forwards to."""
        ...

    def show_fixation(
        self,
        fixation_id: str,
        *,
        label: str,
        point_rig_m: tuple[float, float, float],
        distance_m: float,
        distance_sigma_m: float,
        cloud: Cloud | None,
        mesh: DepthMesh | None,
    ) -> None:
        """Add or replace what stands for one fixation."""
        ...

    def remove_fixation(self, fixation_id: str) -> None:
        """Take away what stands for one fixation; harmless when there is nothing."""
        ...

    def close(self) -> None:
        """Stop serving."""
        ...
