"""Checks of every buffer that a camera delivers: status, shape, type, number, time.

Pure: one buffer in, one verdict out. Counting and timing are left to the caller.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from foveacam_hardware.contract import PixelFormat
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus

WRAPS = (0xFFFF, 0xFFFF_FFFF)
"""Frame numbers at which cameras wrap around: GigE Vision 1 counts from 1 to 65535 in 16 bit."""
LARGEST_GAP = 100_000
"""Largest plausible step between frame numbers; a larger one means that the camera restarted its count."""
GREY = (PixelFormat.MONO8, PixelFormat.MONO12, PixelFormat.MONO12P)


class BufferAction(StrEnum):
    """Classification of a buffer."""

    GOOD = "good"
    INCOMPLETE = "incomplete"
    """Corrupt or a repetition; it is not delivered."""
    LATE = "late"
    """Older than one already received; it is not delivered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BufferVerdict:
    """Classification of a buffer; `missing`: number of frames lost before it."""

    action: BufferAction
    seq: int
    missing: int = 0
    reason: str = ""


class FrameChecks:
    """Checks the buffers of one run of a camera and numbers its frames from `first_seq` on."""

    def __init__(
        self, pixel_format: PixelFormat, *, first_seq: int, size: tuple[int, int] | None = None
    ) -> None:
        self._grey = pixel_format in GREY
        self._size = size
        self._number: int | None = None
        self._t_device_ns: int | None = None
        self.next_seq = first_seq

    def judge(self, grab: Grab) -> BufferVerdict:
        """Classify a buffer; the first good one sets the image size that all others must have."""
        step = self._step(grab.number)
        if step < 0:
            return self._reject(BufferAction.LATE, f"frame {grab.number} came after frame {self._number}")
        if step == 0:
            return self._reject(BufferAction.INCOMPLETE, f"frame {grab.number} came twice")
        seq = self.next_seq + step - 1
        self.next_seq = seq + 1
        if grab.number is not None:
            self._number = grab.number
        reason = self._defect(grab)
        if reason is not None:
            return BufferVerdict(action=BufferAction.INCOMPLETE, seq=seq, missing=step - 1, reason=reason)
        self._t_device_ns = grab.t_device_ns
        return BufferVerdict(action=BufferAction.GOOD, seq=seq, missing=step - 1)

    def _reject(self, action: BufferAction, reason: str) -> BufferVerdict:
        return BufferVerdict(action=action, seq=self.next_seq, reason=reason)

    def _step(self, number: int | None) -> int:
        """Return the number of frames since the last one; 1 without a frame count, or when it restarted."""
        if number is None or self._number is None:
            return 1
        step = number - self._number
        if step < 0:
            for wrap in WRAPS:
                if self._number > wrap - wrap // 16 and self._number <= wrap and number < wrap // 16:
                    step += wrap
                    break
        return step if abs(step) <= LARGEST_GAP else 1

    def _defect(self, grab: Grab) -> str | None:
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
