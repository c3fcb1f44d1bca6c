"""What the runtime asks of its neighbours, as Protocols: a rig, a place for pictures, a 3D pane."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame, MarkerPrint, RailPlace, Station
from foveacam_hardware.simulated_faults import FaultInjector
from foveacam_pipeline.capture.run.access import CaptureRig
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.verge.values import Basis
from foveacam_web.scene_values import EyeGaze, MeasurementDrawing, RigShape


class RigProblem(Protocol):
    """One thing that is wrong with one device, for the operator."""

    @property
    def device(self) -> str:
        """Name of the device in the rig: `wide`, `left`, `right`, `mirrors`, `pan_tilt`, `rail`."""
        ...

    @property
    def detail(self) -> str:
        """What was asked and what was found."""
        ...

    @property
    def remedy(self) -> str | None:
        """What to do about it, where the device knows."""
        ...


class AssembledRig(CaptureRig, Protocol):
    """An assembled rig, with more than a capture needs of it.

    One thread calls it, but for `mirrors.park`, `pan_tilt.hold` and `rail.hold`. `settle_us`: how long a look
    waits between its move and its exposure, unless it is told otherwise.
    """

    settle_us: int

    @property
    def replayed(self) -> bool:
        """Whether it plays a recording, whose mirrors go where they were recorded."""
        ...

    @property
    def clock(self) -> Clock:
        """Clock of every time stamp."""
        ...

    @property
    def stations(self) -> Sequence[Station]:
        """Where the rig looks to be calibrated."""
        ...

    @property
    def markers(self) -> MarkerPrint:
        """What it is calibrated with."""
        ...

    @property
    def rail_places(self) -> Sequence[RailPlace]:
        """Places on the rail that have names."""
        ...

    @property
    def breakable(self) -> FaultInjector | None:
        """What breaks it on purpose; None when it is not simulated."""
        ...

    @property
    def problems(self) -> Sequence[RigProblem]:
        """What is wrong with which device as of the last `connect`."""
        ...

    def connect(self) -> object:
        """Connect every device that is not connected; list in `problems` what could not be."""
        ...

    def close(self) -> None:
        """Park, then release every device."""
        ...


class CameraKeeper(Protocol):
    """What keeps cameras as the operator wants them; called by the hardware thread alone."""

    def restore(self, rig: AssembledRig) -> None:
        """Give each camera that was opened what is kept for it."""
        ...

    def notice(self, rig: AssembledRig) -> None:
        """See what cameras have set themselves to."""
        ...


class PictureSink(Protocol):
    """Where the newest image of each view goes; latest wins, never blocks, callable from any thread."""

    def publish_frame(self, frame: Frame, *, meta: Mapping[str, object] | None = None) -> None:
        """Offer a camera frame to the view named by its role; `meta` is its overlay."""
        ...

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Offer a computed picture, (h, w, 3) uint8 RGB, of the moment `t_ns` to the view `name`."""
        ...

    def watched(self, view: str) -> bool:
        """Tell whether anybody looks at `view`."""
        ...

    def wants_every(self, view: str) -> bool:
        """Tell whether somebody wants `view` as fast as the rig can bring it."""
        ...


class SceneViewer(Protocol):
    """The 3D pane. Calls may take milliseconds, so never from the hardware thread."""

    @property
    def socket_path(self) -> Path:
        """Unix socket that the relay forwards to."""
        ...

    def show_fixation(
        self,
        fixation_id: str,
        *,
        label: str,
        point_rig_m: tuple[float, float, float],
        distance_m: float,
        distance_sigma_m: float,
        basis: Basis,
        cloud: Cloud | None,
        mesh: DepthMesh | None,
    ) -> None:
        """Add or replace what stands for one fixation."""
        ...

    def show_limits(
        self,
        fixation_id: str,
        *,
        label: str,
        direction_deg: tuple[float, float],
        nearest_m: float,
        farthest_m: float | None,
    ) -> None:
        """Add or replace what stands for a fixation of which only limits of the distance are known."""
        ...

    def show_field(
        self, content: bytes, *, from_rig_m: tuple[float, float, float], to_rig_m: tuple[float, float, float]
    ) -> None:
        """Show the surface of a whole field (GLB, +y up) in place of another, seen from there to there."""
        ...

    def remove_field(self) -> None:
        """Take it away; harmless when there is none."""
        ...

    def show_surroundings(self, mesh: DepthMesh, *, bring: bool = False) -> None:
        """Show the coarse surface of the whole wide view; `bring`: let the viewers look at it."""
        ...

    def remove_surroundings(self) -> None:
        """Take it away; harmless when there is none."""
        ...

    def show_rig(self, shape: RigShape) -> None:
        """Draw the rig itself."""
        ...

    def show_gaze(
        self, *, left: EyeGaze | None, right: EyeGaze | None, distance_m: float | None = None
    ) -> None:
        """Turn the foveae, or hide one whose gaze nobody knows; at most a few times a second."""
        ...

    def remove_fixation(self, fixation_id: str) -> None:
        """Take away what stands for one fixation; harmless when there is nothing."""
        ...

    def show_measurement(self, measurement_id: str, drawing: MeasurementDrawing) -> None:
        """Add or replace what stands for one measurement."""
        ...

    def remove_measurement(self, measurement_id: str) -> None:
        """Take away what stands for one measurement; harmless when there is nothing."""
        ...

    def close(self) -> None:
        """Stop serving."""
        ...
