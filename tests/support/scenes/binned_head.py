"""A Head whose frames are the 2 x 2 means of another head's, as cameras at binning 2 give them: for tests."""

from dataclasses import dataclass, replace

import numpy as np

from foveacam_hardware.contract import Frame, Head, LookOptions, Sighting, StereoVolts


def binned_frame(frame: Frame) -> Frame:
    """Return the frame at binning 2, each pixel the mean of four, rounded."""
    height, width = frame.image.shape[:2]
    four = frame.image.astype(np.float32).reshape(height // 2, 2, width // 2, 2, *frame.image.shape[2:])
    return replace(frame, image=np.rint(four.mean(axis=(1, 3))).astype(frame.image.dtype), binning=2)


def binned_sighting(sighting: Sighting) -> Sighting:
    """Return a look whose frames are binned."""
    left, right, wide = (binned_frame(frame) for frame in (sighting.left, sighting.right, sighting.wide))
    return replace(sighting, left=left, right=right, wide=wide, wide_before=())


@dataclass
class BinnedHead:
    """Bins what another head sees."""

    head: Head

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        return binned_sighting(self.head.look(volts, options=options))

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        return binned_frame(self.head.wide(max_age_ms=max_age_ms))

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        self.head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

    def set_low_pass(self, cutoff_hz: int) -> int:
        return self.head.set_low_pass(cutoff_hz)
