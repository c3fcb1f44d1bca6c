"""Protocols of the rig, its calibration, the sink of pictures and the 3D pane."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Clock, Frame, MarkerPrint, RailPlace, Station
from foveacam_hardware.simulated_faults import FaultInjector
from foveacam_pipeline.capture.run.access import CaptureRig
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_pace import ExpectedRate
from foveacam_web.scene_values import EyeGaze, FixationDrawing, LimitsDrawing, MeasurementDrawing, RigShape


class RigProblem(Protocol):
    """A problem of one device, for the operator."""

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
        """What to do about it, if known."""
        ...


class RigOpeningWatch(Protocol):
    """Follows the opening of a rig, device by device."""

    def begins(self, device: str) -> None:
        """Record that a device is being opened."""
        ...

    def ends(self, device: str, problem: RigProblem | None) -> None:
        """Record that a device is open, or why it is not."""
        ...


class AssembledRig(CaptureRig, Protocol):
    """An assembled rig, with more than a capture needs.

    Called by one thread, except `mirrors.park`, `pan_tilt.hold` and `rail.hold`. `settle_us`: wait of a look
    between its move and its exposure, unless the look has its own.
    """

    settle_us: int
    working_binning: Binning
    """Binning of looks, live views and sessions that choose no other."""

    @property
    def replayed(self) -> bool:
        """Whether it plays a recording, so that the mirrors have their recorded positions."""
        ...

    @property
    def clock(self) -> Clock:
        """Clock of every time stamp."""
        ...

    @property
    def stations(self) -> Sequence[Station]:
        """Poses of the pan-tilt for calibration."""
        ...

    @property
    def markers(self) -> MarkerPrint:
        """The printed markers that it is calibrated with."""
        ...

    @property
    def rail_places(self) -> Sequence[RailPlace]:
        """Named positions of the rail."""
        ...

    @property
    def breakable(self) -> FaultInjector | None:
        """Injects faults into a simulated rig; None for a real one."""
        ...

    @property
    def problems(self) -> Sequence[RigProblem]:
        """Problems of devices at the last `connect`."""
        ...

    def connect(self, *, watch: RigOpeningWatch | None = None) -> object:
        """Connect every device that is not connected; list those that failed in `problems`."""
        ...

    def close(self) -> None:
        """Park, then release every device."""
        ...


class CalibrationInForce(Protocol):
    """Provides the rig's calibration in force."""

    @property
    def current(self) -> Calibration | None:
        """The calibration in force; None without one."""
        ...

    @property
    def problem(self) -> str | None:
        """Why no calibration is in force."""
        ...

    def require(self) -> Calibration:
        """Return the calibration in force; raise `NotCalibrated` without one."""
        ...


class CameraKeeper(Protocol):
    """Restores and stores camera settings; called by the hardware thread only."""

    def restore(self, rig: AssembledRig) -> None:
        """Apply its stored settings to each camera that was opened."""
        ...

    def notice(self, rig: AssembledRig) -> None:
        """Store exposures found by the cameras' own `once`."""
        ...

    def forget(self) -> None:
        """Forget the cameras of a rig that was closed."""
        ...


class PictureSink(Protocol):
    """Takes the newest image of each view; latest wins, never blocks, callable from any thread."""

    def publish_frame(self, frame: Frame, *, meta: OverlayDocument | None = None) -> None:
        """Publish a camera frame in the view named by its role; `meta` is its overlay."""
        ...

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Publish a computed picture, (h, w, 3) uint8 RGB, of the time `t_ns` in the view `name`."""
        ...

    def expect(self, view: str, expected: ExpectedRate | None) -> None:
        """State the rate at which `view` should come; None: none is promised."""
        ...

    def watched(self, view: str) -> bool:
        """Return whether `view` has a viewer."""
        ...

    def wants_every(self, view: str) -> bool:
        """Return whether `view` is recorded at full rate."""
        ...


class SceneViewer(Protocol):
    """The 3D pane. Calls may take milliseconds, so never from the hardware thread."""

    @property
    def socket_path(self) -> Path:
        """Unix socket that the relay forwards to."""
        ...

    def show_fixation(self, fixation_id: str, drawing: FixationDrawing) -> None:
        """Add or replace the drawing of a fixation."""
        ...

    def show_limits(self, fixation_id: str, drawing: LimitsDrawing) -> None:
        """Add or replace the drawing of a fixation with only limits of its distance."""
        ...

    def show_field(
        self, content: bytes, *, from_rig_m: tuple[float, float, float], to_rig_m: tuple[float, float, float]
    ) -> None:
        """Show the surface of a whole field (GLB, +y up) in place of another, and set the viewers' camera."""
        ...

    def remove_field(self) -> None:
        """Remove the field's surface, if there is one."""
        ...

    def show_surroundings(self, mesh: DepthMesh, backdrop: DepthMesh, *, bring: bool = False) -> None:
        """Show the coarse surface of the whole wide view; `bring`: turn viewers to it."""
        ...

    def remove_surroundings(self) -> None:
        """Remove the surface of the wide view, if there is one."""
        ...

    def show_rig(self, shape: RigShape) -> None:
        """Draw the rig."""
        ...

    def show_gaze(
        self, *, left: EyeGaze | None, right: EyeGaze | None, distance_m: float | None = None
    ) -> None:
        """Turn the foveae, or hide one whose gaze is unknown; at most a few times a second."""
        ...

    def relabel_fixation(self, fixation_id: str, label: str) -> None:
        """Give the drawing of a fixation another name, if there is one."""
        ...

    def remove_fixation(self, fixation_id: str) -> None:
        """Remove the drawing of a fixation, if there is one."""
        ...

    def show_measurement(self, measurement_id: str, drawing: MeasurementDrawing) -> None:
        """Add or replace the drawing of a measurement."""
        ...

    def remove_measurement(self, measurement_id: str) -> None:
        """Remove the drawing of a measurement, if there is one."""
        ...

    def show_trail(self, target_id: str, label: str, points_rig_m: list[tuple[float, float, float]]) -> None:
        """Add or replace the trail of a followed target, oldest point first."""
        ...

    def remove_trail(self, target_id: str) -> None:
        """Remove the trail of a followed target, if there is one."""
        ...

    def close(self) -> None:
        """Stop serving."""
        ...
