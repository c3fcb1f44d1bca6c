"""What a GenICam camera sets by itself: exposure, gain and frame rate, by the standard's names (SFNC).

Cameras differ in which of these features they have; what one lacks is passed over, and never asked for.
"""

from typing import Protocol

from foveacam_hardware.contract import AutoMode

EXPOSURE, GAIN = "ExposureAuto", "GainAuto"
MODES = {AutoMode.OFF: "Off", AutoMode.ONCE: "Once", AutoMode.CONTINUOUS: "Continuous"}
RATE_BY_HAND = ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled")
"""Off: as fast as exposure and readout allow. The second is that of older FLIR cameras."""
RESULTING_HZ = "AcquisitionResultingFrameRate"


class FeatureAccess(Protocol):
    """What is needed of an open camera."""

    def has(self, feature: str) -> bool:
        """Tell whether it has a feature now."""
        ...

    def text(self, feature: str) -> str:
        """Return the word that is chosen of a feature."""
        ...

    def choices(self, feature: str) -> frozenset[str]:
        """Return the words of a feature."""
        ...

    def choose(self, feature: str, word: str) -> None:
        """Choose one of them."""
        ...

    def switch(self, feature: str, *, on: bool) -> None:
        """Set a yes-or-no feature."""
        ...

    def number(self, feature: str) -> float:
        """Return the value of a feature."""
        ...


class AravisAutomatic:
    """The automatic modes of one open camera."""

    def __init__(self, camera: FeatureAccess) -> None:
        self._camera = camera
        words = camera.choices(EXPOSURE) if camera.has(EXPOSURE) else frozenset()
        self.exposure_modes = tuple(
            mode for mode, word in MODES.items() if mode is AutoMode.OFF or word in words
        )
        self._has_exposure = MODES[AutoMode.OFF] in words
        self._by_hand = next((name for name in RATE_BY_HAND if camera.has(name)), None)
        self._has_resulting = camera.has(RESULTING_HZ)

    @property
    def has_rate(self) -> bool:
        """Whether it can choose its frame rate itself."""
        return self._by_hand is not None

    def all_off(self) -> None:
        """Leave exposure and gain to whoever sets them."""
        self.expose(AutoMode.OFF)
        if self._camera.has(GAIN):
            self._camera.choose(GAIN, MODES[AutoMode.OFF])

    def expose(self, mode: AutoMode) -> None:
        """Let the exposure be set by itself, or not; one of its modes."""
        if self._has_exposure:
            self._camera.choose(EXPOSURE, MODES[mode])

    def exposure_mode(self) -> AutoMode:
        """Return the mode that is on; one of another name is on for good."""
        if not self._has_exposure:
            return AutoMode.OFF
        now = self._camera.text(EXPOSURE)
        return next((mode for mode, word in MODES.items() if word == now), AutoMode.CONTINUOUS)

    def run_freely(self, *, on: bool) -> None:
        """Let it choose its frame rate, or not."""
        if self._by_hand is not None:
            self._camera.switch(self._by_hand, on=not on)

    def resulting_hz(self) -> float | None:
        """Return the rate that it says it runs at; None where it does not say."""
        return (self._camera.number(RESULTING_HZ) or None) if self._has_resulting else None
