"""What a capture needs of a rig, of whoever owns it, and of whoever watches."""

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
    """An opened rig; touched by the work that `RigAccess` runs, and by nothing else."""

    @property
    def rig_id(self) -> str:
        """What its calibrations name."""
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
        """Looks; in two steps where it can."""
        ...

    @property
    def mirrors(self) -> Mirrors:
        """Both mirrors' controller."""
        ...

    @property
    def wide(self) -> Camera:
        """The fixed camera."""
        ...

    @property
    def left(self) -> Camera:
        """The left fovea's."""
        ...

    @property
    def right(self) -> Camera:
        """The right fovea's."""
        ...

    @property
    def pan_tilt(self) -> PanTilt | None:
        """What turns the rig."""
        ...

    @property
    def rail(self) -> Rail | None:
        """What moves the rig sideways."""
        ...


class RigAccess(Protocol):
    """The way to a rig that one capture has to itself. Errors of the work come back from the call."""

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        ...

    @property
    def head(self) -> Head:
        """Looks, for fixations."""
        ...

    def check_may_move(self) -> None:
        """Raise `Stopped` or `NotConnected` when nothing may move now; callable from the work too."""
        ...

    def moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that steers and exposes, where the devices are owned; refused like a move."""
        ...

    def still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that moves no mirror, where the devices are owned."""
        ...


class CaptureWatcher(Protocol):
    """The operator's side of a capture; called on the capture's own thread."""

    def progress(self, report: CaptureReport) -> None:
        """Take note of how far it is."""
        ...

    def cancelled(self) -> bool:
        """Tell whether it shall end; what was taken is kept."""
        ...

    def paused(self) -> bool:
        """Tell whether it shall wait."""
        ...

    def ask(self, wish: str) -> None:
        """Ask the operator to do something by hand; `paused` until it is done."""
        ...

    def saw(self, frames: tuple[Frame, ...]) -> None:
        """Look at what was just taken."""
        ...


def trigger_head(rig: CaptureRig) -> TriggerHead:
    """Return the head of a rig that exposes both foveae by a pulse; raise InvalidInput for another."""
    head = rig.head
    if not isinstance(head, TriggerHead):
        raise InvalidInput(
            f"capture: rig {rig.name!r} plays a recording and exposes nothing on request;"
            " open a rig that does"
        )
    return head
