"""What a camera is asked for, what it took, what it can do, and how it fares."""

from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract.errors import InvalidInput

MARGIN_US = 500
"""Between the end of one look and the next move."""
SAME_SHARE = 0.01
"""By how much of the longer one both eyes' exposures may differ: each camera rounds to lines of its own."""


class PixelFormat(StrEnum):
    """What a camera sends (GenICam names). Bayer formats become RGB in the driver, packed ones 16 bit."""

    MONO8 = "Mono8"
    MONO12 = "Mono12"
    MONO12P = "Mono12p"
    BAYER_RG8 = "BayerRG8"
    BAYER_RG12P = "BayerRG12p"
    RGB8 = "RGB8"


class TriggerSource(StrEnum):
    """What a triggered camera waits for."""

    HARDWARE = "hardware"
    """An edge on its input line, from the mirror controller."""
    SOFTWARE = "software"
    """A command: `Camera.software_trigger`."""


class AutoMode(StrEnum):
    """Whether a camera sets its exposure itself."""

    OFF = "off"
    ONCE = "once"
    """Until it has found one; then it is off."""
    CONTINUOUS = "continuous"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSettings:
    """What a camera is asked for, and, as returned by `configure`, what it took.

    While a camera sets its exposure or its rate itself, `exposure_ns` and `frame_rate_hz` ask where it
    begins, and tell what is in force, as it said within the last second.
    """

    exposure_ns: int
    exposure_auto: AutoMode = AutoMode.OFF
    gain_db: float = 0.0
    frame_rate_hz: float = 30.0
    frame_rate_auto: bool = False
    """Its rate is its own: as fast as exposure and readout allow, or that of the file it plays."""
    pixel_format: PixelFormat = PixelFormat.MONO8
    triggered: bool = False
    trigger_source: TriggerSource = TriggerSource.HARDWARE
    """Of a triggered camera; without a meaning for a free-running one."""
    black_level: float = 0.0
    """Offset of black, in the camera's own units."""

    @property
    def automatic(self) -> bool:
        """Whether the camera may change any of them by itself."""
        return self.frame_rate_auto or self.exposure_auto is not AutoMode.OFF


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueRange:
    """What a camera accepts for one setting, both ends included; `low == high`: it cannot be set."""

    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRanges:
    """What a camera accepts; asking for more is refused."""

    exposure_ns: ValueRange
    gain_db: ValueRange
    frame_rate_hz: ValueRange
    black_level: ValueRange
    pixel_formats: tuple[PixelFormat, ...]
    exposure_autos: tuple[AutoMode, ...] = (AutoMode.OFF,)
    """The modes that it has."""
    frame_rate_auto: bool = False
    """Whether it can choose its rate itself."""


class CameraPhase(StrEnum):
    """How far a camera is from delivering frames."""

    CLOSED = "closed"
    OPENING = "opening"
    READY = "ready"
    """Open and configured, not started."""
    STREAMING = "streaming"
    DEGRADED = "degraded"
    """It delivers, but frames are missing or broken."""
    LOST = "lost"
    BACKOFF = "backoff"
    """Lost, and waited for until the next attempt to open it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraLink:
    """The state of a camera and why; `epoch` counts how often it was opened."""

    phase: CameraPhase
    since_ns: int = 0
    reason: str = ""
    epoch: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCounters:
    """Honest statistics of one camera since it was started."""

    delivered: int = 0
    skipped: int = 0
    """Frames that came whole and that nobody read before newer ones took their place; nothing is wrong."""
    dropped: int = 0
    """Frames that never came: by the gap in the camera's numbers, or asked for in vain."""
    incomplete: int = 0
    late: int = 0
    underrun: int = 0
    """Frames that the camera sent while there was no buffer for them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerBudget:
    """One pulse exposes both eyes, as long as the longer exposure; looks may follow each other so closely."""

    pulse_us: float
    interval_us: float

    @property
    def interval_ms(self) -> float:
        """The same in ms."""
        return self.interval_us / 1e3

    @property
    def rate_hz(self) -> float:
        """Looks a second."""
        return 1e6 / self.interval_us


def trigger_budget(
    exposures_us: tuple[float, float], most_rates_hz: tuple[float, float], *, settle_us: float
) -> TriggerBudget:
    """Return the budget of (left, right): settle, then the slower eye's exposure or frame, then a margin.

    `most_rates_hz`: at which each camera can deliver; its readout overlaps the next move, not the next frame.
    Raise InvalidInput for times and rates that cannot be.
    """
    if not (min(exposures_us) > 0.0 and min(most_rates_hz) > 0.0 and settle_us >= 0.0):
        raise InvalidInput(
            f"trigger budget: exposures {exposures_us} µs and rates {most_rates_hz} Hz must be above 0, "
            f"the settle time {settle_us} µs not below; give what both cameras run with"
        )
    eyes = zip(exposures_us, most_rates_hz, strict=True)
    slowest_us = max(max(exposure_us, 1e6 / rate_hz) for exposure_us, rate_hz in eyes)
    return TriggerBudget(pulse_us=max(exposures_us), interval_us=settle_us + slowest_us + MARGIN_US)


def same_exposure(left_ns: int, right_ns: int) -> bool:
    """Tell whether one pulse can expose both eyes: their exposures are alike but for rounding."""
    return abs(left_ns - right_ns) <= SAME_SHARE * max(left_ns, right_ns)
