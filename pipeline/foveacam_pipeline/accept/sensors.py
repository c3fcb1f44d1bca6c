"""Check of the three sensors by exposures of one scene: format, black level, noise, defective pixels.

The noise follows the photon transfer curve (EMVA 1288): the variance of a pixel between two pictures grows
with its level; the slope is the gain, the variance without light is the sensor's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    AutoMode,
    CameraSettings,
    DeviceFault,
    Frame,
    Role,
    Sighting,
    same_exposure,
)
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import TRIES, RigUnderTest, camera_of, frame_of
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged

TITLE = "Sensors: format, black level, noise, defective pixels"
SHARES = (0.25, 0.5, 0.5, 1.0)
"""Exposures as shares of the one in use; the two equal ones give the noise."""
DARK_NS = 50_000
HOT_LEVELS = 40.0
"""Grey levels above black by which a pixel without light counts as defective."""
MIDDLE_LEVELS = (20.0, 110.0)
"""Levels at half the exposure that are neither black nor clipped at the whole one."""
NOISE_BINS = 12
LEAST_PIXELS = 500
MOSAIC_RATIO = 0.06
"""Largest relative difference between the four phases of a mosaic in a picture without one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorFrames:
    """Pictures of one camera, float32 (h, w) or (h, w, 3), grey levels of 8 bits."""

    ladder: tuple[NDArray[np.float32], ...]
    exposures_ns: tuple[int, ...]
    dark: NDArray[np.float32]
    dark_ns: int
    raw: NDArray[np.uint8] | NDArray[np.uint16]
    """The picture of the longest exposure as it came."""
    bits: int
    black_level: float
    """As it is set."""


def check_sensors(
    rig: RigUnderTest, limits: AcceptanceLimits
) -> tuple[AcceptanceCheck, dict[Role, SensorFrames]]:
    """Return the result, and the pictures that it is drawn from; all settings are restored."""
    before = rig.settings()
    try:
        frames = _exposed(rig, before)
    finally:
        for role, settings in before.items():
            rig.configure(
                role,
                exposure_ns=settings.exposure_ns,
                exposure_auto=settings.exposure_auto,
                gain_db=settings.gain_db,
            )
    return judge_sensors(frames, limits), frames


def judge_sensors(frames: Mapping[Role, SensorFrames], limits: AcceptanceLimits) -> AcceptanceCheck:
    """Return the result of pictures that were taken."""
    figures: list[Measured] = []
    findings: list[NamedFault] = []
    for role, taken in frames.items():
        _judge_camera(role, taken, limits, figures, findings)
    return judged("sensors", TITLE, figures=figures, findings=findings, picture="noise")


def photon_transfer(frames: SensorFrames) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return levels above black and variances of a pixel there, (k,) each, from the two equal exposures."""
    one, two = frames.ladder[1], frames.ladder[2]
    level = ((one + two) / 2.0).ravel() - frames.black_level
    half_squares = ((one - two) ** 2 / 2.0).ravel()
    edges = np.linspace(5.0, 220.0, NOISE_BINS + 1)
    places = np.digitize(level, edges) - 1
    found = [places == index for index in range(NOISE_BINS)]
    kept = [inside for inside in found if int(inside.sum()) >= LEAST_PIXELS]
    levels = np.array([float(level[inside].mean()) for inside in kept])
    variances = np.array([float(half_squares[inside].mean()) for inside in kept])
    return levels, variances


def _exposed(rig: RigUnderTest, before: Mapping[Role, CameraSettings]) -> dict[Role, SensorFrames]:
    taken: dict[Role, list[Frame]] = {role: [] for role in Role}
    dark: dict[Role, Frame] = {}
    whole_ns = before[Role.LEFT].exposure_ns
    shortest_ns = rig.on_device(
        lambda devices: max(camera_of(devices, role).ranges.exposure_ns.low for role in Role)
    )
    dark_ns = max(DARK_NS, round(shortest_ns))
    for exposure_ns in (dark_ns, *(round(share * whole_ns) for share in SHARES)):
        rig.configure(Role.WIDE, exposure_ns=exposure_ns, exposure_auto=AutoMode.OFF)
        rig.access.head.expose_foveae(exposure_ns=exposure_ns, gain_db=before[Role.LEFT].gain_db)
        sighting = _exposed_alike(rig)
        for role in Role:
            if exposure_ns == dark_ns:
                dark[role] = frame_of(sighting, role)
            else:
                taken[role].append(frame_of(sighting, role))
    return {role: _frames_of(taken[role], dark[role], before[role]) for role in Role}


def _exposed_alike(rig: RigUnderTest) -> Sighting:
    """Return a look whose wide frame has the exposure in force: that camera runs freely, and may lag."""
    wanted_ns = rig.settings()[Role.WIDE].exposure_ns
    for _ in range(TRIES):
        sighting = rig.look()
        if same_exposure(sighting.wide.exposure_ns, wanted_ns):
            return sighting
    raise DeviceFault(
        f"the wide camera still exposes for {sighting.wide.exposure_ns / 1e6:g} ms after {TRIES} looks",
        asked=f"{wanted_ns / 1e6:g} ms",
        remedy="restart the camera",
    )


def _frames_of(taken: list[Frame], dark: Frame, settings: CameraSettings) -> SensorFrames:
    return SensorFrames(
        ladder=tuple(_levels(frame) for frame in taken),
        exposures_ns=tuple(frame.exposure_ns for frame in taken),
        dark=_levels(dark),
        dark_ns=dark.exposure_ns,
        raw=taken[-1].image,
        bits=taken[-1].bits,
        black_level=settings.black_level,
    )


def _levels(frame: Frame) -> NDArray[np.float32]:
    return frame.image.astype(np.float32) / np.float32(2 ** (frame.bits - 8))


def _judge_camera(
    role: Role,
    frames: SensorFrames,
    limits: AcceptanceLimits,
    figures: list[Measured],
    findings: list[NamedFault],
) -> None:
    """Add a camera's figures and findings; a wrong format makes the others meaningless."""

    def name(fault: Fault, detail: str) -> None:
        findings.append(NamedFault(fault=fault, subject=str(role), detail=f"the {role} camera: {detail}"))

    wrong = _wrong_format(frames)
    if wrong is not None:
        name(Fault.PIXEL_FORMAT, wrong)
        return
    hot = float(np.mean(frames.dark > frames.black_level + HOT_LEVELS))
    figures.append(
        Measured(name=f"{role}: defective pixels", value=round(hot, 7), unit="", high=limits.hot_fraction)
    )
    if hot > limits.hot_fraction:
        pixels = frames.dark.shape[0] * frames.dark.shape[1]
        most = f"at most {round(limits.hot_fraction * pixels)} of {pixels} may be"
        name(
            Fault.HOT_PIXELS,
            f"{round(hot * pixels)} pixels are bright after {frames.dark_ns / 1e6:.2g} ms, {most}",
        )
    black = _black_level(frames)
    off = black - frames.black_level
    figures.append(
        Measured(
            name=f"{role}: black level against the set one",
            value=round(off, 2),
            unit="grey levels",
            low=-limits.black_level,
            high=limits.black_level,
        )
    )
    if abs(off) > limits.black_level:
        name(Fault.BLACK_LEVEL, f"no light gives {black:.1f}, set to {frames.black_level:g} of 255")
    levels, variances = photon_transfer(frames)
    slope, own = _line(levels, variances)
    noise = float(np.sqrt(max(own, 0.0)))
    figures.append(Measured(name=f"{role}: grey levels an electron makes", value=round(slope, 5), unit=""))
    figures.append(
        Measured(
            name=f"{role}: noise without light", value=round(noise, 3), unit="grey levels", high=limits.noise
        )
    )
    if noise > limits.noise:
        name(Fault.NOISE, f"its noise without light is {noise:.1f} grey levels (standard deviation)")


def _wrong_format(frames: SensorFrames) -> str | None:
    """Return what is wrong with the format of a camera's pictures, None when nothing is."""
    values = np.unique(frames.raw)
    values = values[values < 2**frames.bits - 1]  # a clipped picture ends anywhere
    step = int(np.gcd.reduce(np.diff(values).astype(np.int64))) if len(values) > 2 else 1
    if step > 1:
        return f"only every {step}th grey level occurs, so {step.bit_length() - 1} of its bits are lost"
    picture = frames.ladder[1] if frames.ladder[1].ndim == 2 else frames.ladder[1].mean(axis=2)
    even = picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]
    phases = [float(even[y::2, x::2].mean()) - frames.black_level for y in (0, 1) for x in (0, 1)]
    unlike = max(phases) / max(min(phases), 1e-3) - 1.0
    if unlike > MOSAIC_RATIO:
        return f"its pixels alternate by {100 * unlike:.0f} %: the mosaic of a colour sensor, taken as grey"
    return None


def _black_level(frames: SensorFrames) -> float:
    """Return the level without light, extrapolated over exposures at pixels of middle brightness."""
    half = (frames.ladder[1] + frames.ladder[2]) / 2.0
    middle = (half > MIDDLE_LEVELS[0]) & (half < MIDDLE_LEVELS[1])
    exposures = np.array(frames.exposures_ns, dtype=np.float64)
    levels = np.array([float(each[middle].mean()) for each in frames.ladder])
    return float(np.polyfit(exposures, levels, 1)[1])


def _line(levels: NDArray[np.float64], variances: NDArray[np.float64]) -> tuple[float, float]:
    """Return slope and offset of variance over level."""
    slope, offset = np.polyfit(levels, variances, 1).tolist()
    return float(slope), float(offset)
