"""Automatic exposure, gain and frame rate of a GenICam camera, by the standard's feature names (SFNC).

Cameras differ in which of these features they have; missing ones are skipped and never requested.
"""

from typing import Protocol

from foveacam_hardware.contract import AutoMode

EXPOSURE, GAIN = "ExposureAuto", "GainAuto"
MODES = {AutoMode.OFF: "Off", AutoMode.ONCE: "Once", AutoMode.CONTINUOUS: "Continuous"}
MANUAL_RATE_FEATURES = ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled")
"""Features that enable a manual frame rate; off: as fast as possible. The second is of older FLIR cameras."""
RESULTING_HZ = "AcquisitionResultingFrameRate"


class FeatureAccess(Protocol):
    """Access to the features of an open camera."""

    def has(self, feature: str) -> bool:
        """Return whether the camera has a feature now."""
        ...

    def text(self, feature: str) -> str:
        """Return the value of an enumeration feature."""
        ...

    def choices(self, feature: str) -> frozenset[str]:
        """Return the possible values of an enumeration feature."""
        ...

    def choose(self, feature: str, word: str) -> None:
        """Set an enumeration feature."""
        ...

    def switch(self, feature: str, *, on: bool) -> None:
        """Set a boolean feature."""
        ...

    def number(self, feature: str) -> float:
        """Return the value of a float feature."""
        ...


class AravisAutomatic:
    """The automatic modes of one open camera."""

    def __init__(self, camera: FeatureAccess) -> None:
        self._camera = camera
        values = camera.choices(EXPOSURE) if camera.has(EXPOSURE) else frozenset()
        self.exposure_modes = tuple(
            mode for mode, word in MODES.items() if mode is AutoMode.OFF or word in values
        )
        self._has_exposure = MODES[AutoMode.OFF] in values
        self._manual_rate = next((name for name in MANUAL_RATE_FEATURES if camera.has(name)), None)
        self._has_resulting = camera.has(RESULTING_HZ)

    @property
    def has_rate(self) -> bool:
        """Whether the camera can choose its frame rate itself."""
        return self._manual_rate is not None

    def disable_all(self) -> None:
        """Switch automatic exposure and gain off."""
        self.set_exposure_mode(AutoMode.OFF)
        if self._camera.has(GAIN):
            self._camera.choose(GAIN, MODES[AutoMode.OFF])

    def set_exposure_mode(self, mode: AutoMode) -> None:
        """Set the automatic exposure mode, one of `exposure_modes`."""
        if self._has_exposure:
            self._camera.choose(EXPOSURE, MODES[mode])

    def exposure_mode(self) -> AutoMode:
        """Return the exposure mode in force; a value with a non-standard name counts as continuous."""
        if not self._has_exposure:
            return AutoMode.OFF
        now = self._camera.text(EXPOSURE)
        return next((mode for mode, word in MODES.items() if word == now), AutoMode.CONTINUOUS)

    def set_free_rate(self, *, on: bool) -> None:
        """Let the camera choose its frame rate, or not."""
        if self._manual_rate is not None:
            self._camera.switch(self._manual_rate, on=not on)

    def resulting_hz(self) -> float | None:
        """Return the frame rate that the camera reports as resulting; None when it does not report one."""
        return (self._camera.number(RESULTING_HZ) or None) if self._has_resulting else None
