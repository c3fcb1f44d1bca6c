"""Time a camera driver and a bare loop on the same library alternately, so that other load affects both."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from statistics import median
from typing import Protocol

from foveacam_hardware.contract import Camera, CameraSettings, Timeout

PAUSE_S = 0.012
"""Pause between two triggers: longer than exposure and readout, so that the camera is ready."""
TRIGGER_TIMEOUT_MS = 1000.0
WARM_UP_FRAMES = 40
"""More frames than any buffer holds: buffered frames arrive faster than the camera sends."""


class PictureLoop(Protocol):
    """One way of reading frames from a camera that streams already."""

    def next(self) -> None:
        """Wait for the next picture as an array of its own."""
        ...

    def trigger(self) -> None:
        """Expose once, and wait for the picture; raise `Timeout` when none came."""
        ...


Entry = Callable[[CameraSettings], AbstractContextManager[PictureLoop]]
"""Opens a camera with settings and starts it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RaceSettings:
    """Number of rounds of each loop, and of frames and triggers in a round."""

    rounds: int
    frames: int
    triggers: int


def frames_per_s(race: RaceSettings, settings: CameraSettings, *entries: Entry) -> list[float]:
    """Return each entry's median rate."""
    rates_hz: list[list[float]] = [[] for _ in entries]
    for _ in range(race.rounds):
        for entry, found in zip(entries, rates_hz, strict=True):
            with entry(settings) as racer:
                for _ in range(WARM_UP_FRAMES):
                    racer.next()
                began_s = time.perf_counter()
                for _ in range(race.frames):
                    racer.next()
                found.append(race.frames / (time.perf_counter() - began_s))
    return [median(found) for found in rates_hz]


def trigger_to_array_ms(race: RaceSettings, settings: CameraSettings, *entries: Entry) -> list[float]:
    """Return each entry's median time from a software trigger to its picture."""
    times_ms: list[list[float]] = [[] for _ in entries]
    for _ in range(race.rounds):
        for entry, found in zip(entries, times_ms, strict=True):
            with entry(settings) as racer:
                for _ in range(race.triggers):
                    time.sleep(PAUSE_S)
                    began_s = time.perf_counter()
                    try:
                        racer.trigger()
                    except Timeout:
                        continue  # the camera was not ready, on a busy machine
                    found.append((time.perf_counter() - began_s) * 1e3)
    return [median(found) for found in times_ms]


class DriverLoop:
    """Any camera behind the contract, as the rig uses it."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera

    def next(self) -> None:
        """Read the next frame."""
        self._camera.read(timeout_ms=5000.0)

    def trigger(self) -> None:
        """Trigger by software and read."""
        self._camera.software_trigger()
        self._camera.read(timeout_ms=TRIGGER_TIMEOUT_MS)
