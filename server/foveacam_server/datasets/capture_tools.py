"""Services of captures and stills, and the rig's properties for their estimates."""

from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import CameraSettings, Clock, PixelFormat, RailLimits, ValueRange
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
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import OverlayOf
from foveacam_server.rig.ports import CalibrationInForce, PictureSink

RAIL_MM_S = 50.0
"""Speed of a motorised rail; deduced: the default of a rig file."""


EXPOSURE_CHANGE_MS = 5.0
"""Time to change the exposure of both cameras; deduced: one command each, during the readout."""


_TWELVE_BITS = (PixelFormat.MONO12, PixelFormat.MONO12P, PixelFormat.BAYER_RG12P)


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureRigFacts:
    """A rig's properties for estimates. `rail`: None without one; `rail_by_hand`: the operator moves it."""

    settle_us: int
    fovea: CameraSettings
    wide: CameraSettings
    exposures_ns: tuple[ValueRange, ...]
    rail: RailLimits | None
    rail_by_hand: bool

    def pace(self) -> CapturePace:
        """Return the rig's time for each action of a capture."""
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
        """Return the estimated time and size of the points from `done` on."""
        fovea, wide = self.sizes(calibration)
        ratio = 1.0 if codec is ImageCodec.TIFF else None
        return estimate_capture(plan, self.pace(), fovea=fovea, wide=wide, done=done, stored_ratio=ratio)


def rig_facts(rig: CaptureRig) -> CaptureRigFacts:
    """Return the properties of a rig, read on its thread; raise `InvalidInput` for one without a trigger."""
    return CaptureRigFacts(
        settle_us=trigger_head(rig).settle_us,
        fovea=rig.left.settings,
        wide=rig.wide.settings,
        exposures_ns=(rig.left.ranges.exposure_ns, rig.right.ranges.exposure_ns),
        rail=None if rig.rail is None else rig.rail.limits,
        rail_by_hand=rig.rail is not None and not rig.rail.moves_itself,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureTools:
    """Services that captures need.

    `distance_m`: of the last fixation, infinite before the first. `context`: the depth of the wide view.
    """

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    sink: PictureSink
    overlay: OverlayOf
    distance_m: Callable[[], float]
    context: DepthContext
    events: EventLog
    clock: Clock
