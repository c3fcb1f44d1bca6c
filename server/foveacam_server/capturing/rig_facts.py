"""What estimates of a capture need to know of a rig; read where its devices are owned."""

from dataclasses import dataclass

from foveacam_hardware.contract import CameraSettings, PixelFormat, RailLimits, ValueRange
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.plan import (
    CaptureEstimate,
    CapturePace,
    ImageSize,
    RasterPlan,
    estimate_capture,
)
from foveacam_pipeline.capture.plan.plan_estimate import READOUT_10BIT_MS, READOUT_12BIT_MS
from foveacam_pipeline.capture.run import CaptureRig, image_size, trigger_head
from foveacam_pipeline.models.calibration import Calibration

RAIL_MM_S = 50.0
"""Of a rail with a motor; deduced: the usual one of a rig file."""
EXPOSURE_CHANGE_MS = 5.0
"""Until both cameras took another exposure; deduced: one command each, while the sensors are read."""
_TWELVE_BITS = (PixelFormat.MONO12, PixelFormat.MONO12P, PixelFormat.BAYER_RG12P)


@dataclass(frozen=True, slots=True, kw_only=True)
class RigFacts:
    """A rig as estimates see it. `rail`: None without one; `rail_by_hand`: somebody pushes it."""

    settle_us: int
    fovea: CameraSettings
    wide: CameraSettings
    exposures_ns: tuple[ValueRange, ...]
    rail: RailLimits | None
    rail_by_hand: bool

    def pace(self) -> CapturePace:
        """Return what the rig takes for each thing that a capture does."""
        twelve = self.fovea.pixel_format in _TWELVE_BITS
        return CapturePace(
            settle_ms=self.settle_us / 1e3,
            exposure_ms=self.fovea.exposure_ns / 1e6,
            readout_ms=READOUT_12BIT_MS if twelve else READOUT_10BIT_MS,
            exposure_change_ms=EXPOSURE_CHANGE_MS,
            wide_period_ms=1e3 / self.wide.frame_rate_hz,
            rail_mm_s=None if self.rail_by_hand else RAIL_MM_S,
        )

    def sizes(self, calibration: Calibration) -> tuple[ImageSize, ImageSize]:
        """Return the sizes of fovea and wide images."""
        fovea = image_size(self.fovea, width=calibration.fovea_width, height=calibration.fovea_height)
        return fovea, image_size(self.wide, width=calibration.wide.width, height=calibration.wide.height)

    def estimate(
        self, plan: RasterPlan, calibration: Calibration, *, codec: ImageCodec, done: int = 0
    ) -> CaptureEstimate:
        """Return what the points from `done` on take."""
        fovea, wide = self.sizes(calibration)
        ratio = 1.0 if codec is ImageCodec.TIFF else None
        return estimate_capture(plan, self.pace(), fovea=fovea, wide=wide, done=done, stored_ratio=ratio)


def rig_facts(rig: CaptureRig) -> RigFacts:
    """Return the facts of a rig; raise InvalidInput for one that exposes nothing on request."""
    return RigFacts(
        settle_us=trigger_head(rig).settle_us,
        fovea=rig.left.settings,
        wide=rig.wide.settings,
        exposures_ns=(rig.left.ranges.exposure_ns, rig.right.ranges.exposure_ns),
        rail=None if rig.rail is None else rig.rail.limits,
        rail_by_hand=rig.rail is not None and not rig.rail.moves_itself,
    )
