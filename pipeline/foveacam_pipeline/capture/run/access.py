"""The interfaces of a capture: the rig that it uses, the access to that rig, and the operator's watcher."""

from collections.abc import Callable
from typing import Protocol, TypeVar

from foveacam_hardware.contract import (
    Camera,
    Clock,
    Frame,
    Head,
    InvalidInput,
    Mirrors,
    PanTilt,
    Rail,
    TriggerHead,
)
from foveacam_pipeline.capture.run.values import CaptureReport

T = TypeVar("T")


class CaptureRig(Protocol):
    """An opened rig; used only by the work that `RigAccess` runs."""

    @property
    def rig_id(self) -> str:
        """The id that its calibrations name."""
        ...

    @property
    def name(self) -> str:
        """Its name for people."""
        ...

    @property
    def simulated(self) -> bool:
        """Whether the world is simulated."""
        ...

    @property
    def scene(self) -> str | None:
        """Name of the simulated scene."""
        ...

    @property
    def baseline_m(self) -> float:
        """Nominal distance between its mirrors."""
        ...

    @property
    def head(self) -> Head:
        """Takes looks, by trigger where the rig can."""
        ...

    @property
    def mirrors(self) -> Mirrors:
        """The controller of both mirrors."""
        ...

    @property
    def wide(self) -> Camera:
        """The fixed wide camera."""
        ...

    @property
    def left(self) -> Camera:
        """The camera of the left fovea."""
        ...

    @property
    def right(self) -> Camera:
        """The camera of the right fovea."""
        ...

    @property
    def pan_tilt(self) -> PanTilt | None:
        """The pan-tilt that turns the rig; None without one."""
        ...

    @property
    def rail(self) -> Rail | None:
        """The rail that moves the rig sideways; None without one."""
        ...


class RigAccess(Protocol):
    """Exclusive access to a rig for one capture. Errors of the work are raised by the call."""

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        ...

    @property
    def head(self) -> Head:
        """Takes looks, for fixations."""
        ...

    def check_may_move(self) -> None:
        """Raise `Stopped` or `NotConnected` when nothing may move now; may be called from the work too."""
        ...

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that steers and exposes, on the thread that owns the devices; refused like a move."""
        ...

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that moves no mirror, on the thread that owns the devices."""
        ...


class CaptureWatcher(Protocol):
    """The operator's side of a capture; called on the capture's own thread."""

    def progress(self, report: CaptureReport) -> None:
        """Receive the progress."""
        ...

    def cancelled(self) -> bool:
        """Return whether the capture is to end; captured points are kept."""
        ...

    def paused(self) -> bool:
        """Return whether the capture is to wait."""
        ...

    def ask_operator(self, request: str) -> None:
        """Ask the operator for a manual action; `paused` is true until it is done."""
        ...

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Receive the frames that were just captured."""
        ...


def trigger_head(rig: CaptureRig) -> TriggerHead:
    """Return the rig's head if it exposes both foveae by a pulse; raise InvalidInput otherwise."""
    head = rig.head
    if not isinstance(head, TriggerHead):
        raise InvalidInput(
            f"capture: rig {rig.name!r} plays a recording and exposes nothing on request;"
            " open a rig that does"
        )
    return head
