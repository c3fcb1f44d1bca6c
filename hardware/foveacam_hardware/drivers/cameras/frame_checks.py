"""What a camera delivers is believed only after these checks: status, shape, type, number, time.

Pure: one buffer in, one verdict out. Counting and times are done by the caller.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from foveacam_hardware.contract import PixelFormat
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus

WRAPS = (0xFFFF, 0xFFFF_FFFF)
"""Largest numbers after which cameras begin again: 16 bit counts from 1 to 65535 in GigE Vision 1."""
LARGEST_GAP = 100_000
"""A number further away than this does not count the same frames any more."""
GREY = (PixelFormat.MONO8, PixelFormat.MONO12, PixelFormat.MONO12P)


class BufferAction(StrEnum):
    """What is done with a buffer."""

    GOOD = "good"
    INCOMPLETE = "incomplete"
    """Broken or a repetition: nobody sees it."""
    LATE = "late"
    """A newer one came before it: nobody sees it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BufferVerdict:
    """What a buffer is; `missing` frames before it never came."""

    fate: BufferAction
    seq: int
    missing: int = 0
    reason: str = ""


class FrameChecks:
    """Judges the buffers of one run of a camera, and numbers them on from `first_seq`."""

    def __init__(
        self, pixel_format: PixelFormat, *, first_seq: int, size: tuple[int, int] | None = None
    ) -> None:
        self._grey = pixel_format in GREY
        self._size = size
        self._number: int | None = None
        self._t_device_ns: int | None = None
        self.next_seq = first_seq

    def judge(self, grab: Grab) -> BufferVerdict:
        """Say what a buffer is; the first good one tells the size that all others must have."""
        step = self._step(grab.number)
        if step < 0:
            return self._refuse(BufferAction.LATE, f"frame {grab.number} came after frame {self._number}")
        if step == 0:
            return self._refuse(BufferAction.INCOMPLETE, f"frame {grab.number} came twice")
        seq = self.next_seq + step - 1
        self.next_seq = seq + 1
        if grab.number is not None:
            self._number = grab.number
        reason = self._broken(grab)
        if reason is not None:
            return BufferVerdict(fate=BufferAction.INCOMPLETE, seq=seq, missing=step - 1, reason=reason)
        self._t_device_ns = grab.t_device_ns
        return BufferVerdict(fate=BufferAction.GOOD, seq=seq, missing=step - 1)

    def _refuse(self, fate: BufferAction, reason: str) -> BufferVerdict:
        return BufferVerdict(fate=fate, seq=self.next_seq, reason=reason)

    def _step(self, number: int | None) -> int:
        """Return how many frames after the last one this is; 1 where nobody counts, or counts anew."""
        if number is None or self._number is None:
            return 1
        step = number - self._number
        if step < 0:
            for wrap in WRAPS:
                if self._number > wrap - wrap // 16 and self._number <= wrap and number < wrap // 16:
                    step += wrap
                    break
        return step if abs(step) <= LARGEST_GAP else 1

    def _broken(self, grab: Grab) -> str | None:
        if grab.status is not GrabStatus.OK or grab.image is None:
            return "packets are missing"
        image = grab.image
        if image.size == 0 or image.ndim != (2 if self._grey else 3):
            return f"its shape is {image.shape}"
        if image.dtype != (np.uint8 if grab.bits <= 8 else np.uint16):
            return f"it has {grab.bits} bits as {image.dtype}"
        size = (image.shape[0], image.shape[1])
        if self._size is None:
            self._size = size
        if size != self._size:
            return f"it has {size[1]}x{size[0]} pixels instead of {self._size[1]}x{self._size[0]}"
        if grab.t_device_ns is not None and grab.t_device_ns == self._t_device_ns:
            return "its time is that of the frame before"
        return None
