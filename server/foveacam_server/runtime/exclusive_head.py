"""The rig as one job sees it: every look goes through the hardware thread, unless the job was cancelled."""

from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Protocol, TypeVar

from foveacam_hardware.contract import Cancelled, Frame, Sighting, StereoVolts, Timeout
from foveacam_server.runtime.ports import AssembledRig

T = TypeVar("T")

DEADLINE_S = 10.0
"""Longest that a job waits for one look; the devices' own deadlines are far shorter."""


class LookProvider(Protocol):
    """What a session asks of the hardware thread."""

    def look(
        self, volts: StereoVolts, *, settle_us: int | None = None, one_eyed: bool = False
    ) -> "Future[Sighting]":
        """Enqueue one look; `one_eyed`: the camera of one fovea may be missing."""
        ...

    def submit(self, work: Callable[[AssembledRig], T]) -> "Future[T]":
        """Enqueue any work with the rig."""
        ...

    def wide_frame(self, *, max_age_ms: float) -> "Future[Frame]":
        """Enqueue one wide frame."""
        ...


class ExclusiveHead:
    """Implements `Head` for one job."""

    def __init__(
        self, looker: LookProvider, *, cancelled: Callable[[], bool], one_eyed: bool = False
    ) -> None:
        self._looker = looker
        self._cancelled = cancelled
        self._one_eyed = one_eyed

    def look(self, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """Steer, settle, expose, and return what all three cameras saw."""
        self._check()
        answer = self._looker.look(volts, settle_us=settle_us, one_eyed=self._one_eyed)
        return answer_of(answer, asked="a look")

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        self._check()
        return answer_of(self._looker.wide_frame(max_age_ms=max_age_ms), asked="a wide frame")

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set both foveae's exposure and gain; a cancelled job may still set them back."""

        def change(rig: AssembledRig) -> None:
            rig.head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

        answer_of(self._looker.submit(change), asked="another exposure")

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Run the drive filters at another cut-off; a cancelled job may still set it back."""
        change = self._looker.submit(lambda rig: rig.head.set_low_pass(cutoff_hz))
        return answer_of(change, asked="another filter")

    def _check(self) -> None:
        if self._cancelled():
            raise Cancelled("the job was cancelled before its next look")


def answer_of(answer: "Future[T]", *, asked: str, within_s: float = DEADLINE_S) -> T:
    """Wait for a command's answer, for so long and no longer."""
    try:
        return answer.result(within_s)
    except FutureTimeout:
        answer.cancel()
        raise Timeout(
            f"asked the rig for {asked}: no answer within {within_s:g} s; look at its devices' problems",
            asked=asked,
            found=f"no answer within {within_s:g} s",
            remedy="look at the devices' problems",
        ) from None
