"""Changes of a camera's settings, and the exposure modes that hardware-triggered foveae refuse."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraSettings,
    OutOfRange,
    PixelFormat,
    Role,
    TriggerSource,
)

FOVEAE = (Role.LEFT, Role.RIGHT)
SETTING_NAMES = (
    "exposure_ns",
    "exposure_auto",
    "gain_db",
    "black_level",
    "frame_rate_hz",
    "frame_rate_auto",
    "pixel_format",
)
REST_NAMES = tuple("exposure_ms" if name == "exposure_ns" else name for name in SETTING_NAMES)
"""The settings by their names in REST."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraChange:
    """The settings to change; None: unchanged.

    An exposure or rate without a mode switches the automatic off.
    """

    exposure_ns: int | None = None
    exposure_auto: AutoMode | None = None
    gain_db: float | None = None
    black_level: float | None = None
    frame_rate_hz: float | None = None
    frame_rate_auto: bool | None = None
    pixel_format: PixelFormat | None = None

    @property
    def changes(self) -> Mapping[str, object]:
        """The changed settings by name, with the modes that they imply."""
        every = {name: getattr(self, name) for name in SETTING_NAMES}
        if self.exposure_auto is None and self.exposure_ns is not None:
            every["exposure_auto"] = AutoMode.OFF
        if self.frame_rate_auto is None and self.frame_rate_hz is not None:
            every["frame_rate_auto"] = False
        return {name: value for name, value in every.items() if value is not None}

    @property
    def lasting(self) -> Mapping[str, object]:
        """The settings to restore at every start, without `once`: a found exposure is not searched again."""
        changes = dict(self.changes)
        if self.exposure_auto is AutoMode.ONCE:
            changes["exposure_auto"] = AutoMode.OFF
        return changes

    def applied_to(self, settings: CameraSettings) -> CameraSettings:
        """Return `settings` with the changes."""
        return replace(settings, **self.changes)  # type: ignore[arg-type]  # each is of its field's type


def waits_for_pulses(role: Role, settings: CameraSettings) -> bool:
    """Return whether the camera is a fovea triggered by the controller's pulse."""
    return role in FOVEAE and settings.triggered and settings.trigger_source is TriggerSource.HARDWARE


def refuse_own_exposure(camera: Camera, asked: CameraSettings) -> None:
    """Raise `OutOfRange` for automatic exposure of a hardware-triggered fovea: one pulse exposes both."""
    if asked.exposure_auto is AutoMode.OFF or not waits_for_pulses(camera.role, asked):
        return
    raise OutOfRange(
        f"camera {camera.role}: asked to set its exposure itself ({asked.exposure_auto}), but one pulse "
        "exposes both foveae alike",
        asked=f"an exposure of its own for camera {camera.role}",
        found="one pulse exposes both foveae alike",
        remedy='ask for "once" with linked, which finds one exposure for both',
    )
