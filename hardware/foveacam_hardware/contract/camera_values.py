"""Camera settings, ranges, link states and counters, and the time budget of a triggered look."""

from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.contract.values import Binning

MARGIN_US = 500
"""Margin between the end of one look and the next move."""
EXPOSURE_TOLERANCE = 0.01
"""Fraction of the longer exposure by which the two may differ: each camera rounds to its own line time."""


class PixelFormat(StrEnum):
    """Pixel format on the wire (GenICam names); drivers convert Bayer to RGB and packed pixels to 16 bit."""

    MONO8 = "Mono8"
    MONO12 = "Mono12"
    MONO12P = "Mono12p"
    BAYER_RG8 = "BayerRG8"
    BAYER_RG12P = "BayerRG12p"
    RGB8 = "RGB8"


class TriggerSource(StrEnum):
    """What starts an exposure of a triggered camera."""

    HARDWARE = "hardware"
    """An edge on its input line, from the mirror controller."""
    SOFTWARE = "software"
    """A command: `Camera.software_trigger`."""


class AutoMode(StrEnum):
    """Mode of a camera's automatic exposure."""

    OFF = "off"
    ONCE = "once"
    """Automatic until the camera has found an exposure, then off."""
    CONTINUOUS = "continuous"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSettings:
    """Settings requested of a camera, or, as returned by `configure`, the settings in force.

    While exposure or rate are automatic, a request's `exposure_ns` and `frame_rate_hz` are their starting
    values; as read from the camera they are the values in force, at most a second old.
    """

    exposure_ns: int
    exposure_auto: AutoMode = AutoMode.OFF
    gain_db: float = 0.0
    frame_rate_hz: float = 30.0
    frame_rate_auto: bool = False
    """The camera chooses its rate: as fast as exposure and readout allow, or the rate of its video file."""
    pixel_format: PixelFormat = PixelFormat.MONO8
    triggered: bool = False
    trigger_source: TriggerSource = TriggerSource.HARDWARE
    """Ignored for a free-running camera."""
    black_level: float = 0.0
    """Black level offset in the camera's own units."""
    binning: Binning = 1
    """Pixels of the sensor along each side of a pixel of the frame, which is their mean."""

    @property
    def automatic(self) -> bool:
        """Whether the camera may change its exposure or rate by itself."""
        return self.frame_rate_auto or self.exposure_auto is not AutoMode.OFF


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueRange:
    """Accepted values of one setting, both ends included; `low == high` when it cannot be set."""

    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRanges:
    """Accepted values of every setting; values outside are refused."""

    exposure_ns: ValueRange
    gain_db: ValueRange
    frame_rate_hz: ValueRange
    black_level: ValueRange
    pixel_formats: tuple[PixelFormat, ...]
    exposure_autos: tuple[AutoMode, ...] = (AutoMode.OFF,)
    """Automatic exposure modes that the camera has."""
    frame_rate_auto: bool = False
    """Whether the camera can choose its rate itself."""
    binnings: tuple[Binning, ...] = (1,)
    """Binnings of the frames, whether the camera or the host averages."""


class CameraPhase(StrEnum):
    """State of the link to a camera."""

    CLOSED = "closed"
    OPENING = "opening"
    READY = "ready"
    """Open and configured, not started."""
    STREAMING = "streaming"
    DEGRADED = "degraded"
    """Delivers frames, but some are missing or corrupt."""
    LOST = "lost"
    BACKOFF = "backoff"
    """Lost, pausing before the next attempt to open it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraLink:
    """State of a camera's link, since when and why; `epoch` counts how often the camera was opened."""

    phase: CameraPhase
    since_ns: int = 0
    reason: str = ""
    epoch: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCounters:
    """Frame statistics of one camera since it was started."""

    delivered: int = 0
    skipped: int = 0
    """Complete frames that were overwritten by newer ones before anyone read them; not an error."""
    dropped: int = 0
    """Frames that never arrived: gaps in the camera's frame numbers, or triggers without a frame."""
    incomplete: int = 0
    late: int = 0
    underrun: int = 0
    """Frames that the camera sent while no buffer was free."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerBudget:
    """Length of the pulse that exposes both foveae (the longer exposure), and shortest interval of looks."""

    pulse_us: float
    interval_us: float

    @property
    def interval_ms(self) -> float:
        """Shortest interval of looks, ms."""
        return self.interval_us / 1e3

    @property
    def rate_hz(self) -> float:
        """Highest rate of looks."""
        return 1e6 / self.interval_us


def trigger_budget(
    exposures_us: tuple[float, float], most_rates_hz: tuple[float, float], *, settle_us: float
) -> TriggerBudget:
    """Return the budget of a look: settling, then the slower fovea's exposure or frame period, then a margin.

    `exposures_us`, `most_rates_hz`: (left, right) exposures and highest frame rates; a camera's readout
    overlaps the next move, not its next frame. Raise `InvalidInput` for times or rates that are not positive.
    """
    if not (min(exposures_us) > 0.0 and min(most_rates_hz) > 0.0 and settle_us >= 0.0):
        raise InvalidInput(
            f"trigger budget: exposures {exposures_us} µs and rates {most_rates_hz} Hz must be above 0, "
            f"the settle time {settle_us} µs not below; give the settings of both cameras"
        )
    eyes = zip(exposures_us, most_rates_hz, strict=True)
    slowest_us = max(max(exposure_us, 1e6 / rate_hz) for exposure_us, rate_hz in eyes)
    return TriggerBudget(pulse_us=max(exposures_us), interval_us=settle_us + slowest_us + MARGIN_US)


def same_exposure(left_ns: int, right_ns: int) -> bool:
    """Return whether both exposures are equal but for rounding, so that one pulse can expose both foveae."""
    return abs(left_ns - right_ns) <= EXPOSURE_TOLERANCE * max(left_ns, right_ns)
