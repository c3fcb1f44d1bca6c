"""Reads and writes features of Basler cameras by the names of both camera families.

Older cameras use `ExposureTimeAbs`, newer ones `ExposureTime`; the first name that a camera has is used.
"""

import math
from typing import Any, TypeAlias

from foveacam_hardware.contract import AutoMode, DeviceFault, OutOfRange, PixelFormat, ValueRange

Vendor: TypeAlias = Any  # objects of the vendor's library, which ships no types
Nodes: TypeAlias = Vendor

EXPOSURE_US = ("ExposureTimeAbs", "ExposureTime")
GAIN_DB = ("Gain", "GainAbs")
BLACK_LEVEL = ("BlackLevel", "BlackLevelAbs", "BlackLevelRaw")
FRAME_RATE_HZ = ("AcquisitionFrameRateAbs", "AcquisitionFrameRate")
RESULTING_RATE_HZ = ("ResultingFrameRateAbs", "ResultingFrameRate", "BslResultingAcquisitionFrameRate")
TICKS_HZ = ("GevTimestampTickFrequency",)
"""Cameras without this feature count nanoseconds."""
MANUAL_RATE = "AcquisitionFrameRateEnable"
"""Enables a manual frame rate; off: as fast as exposure and readout allow."""
EXPOSURE_AUTO = "ExposureAuto"
AUTO_NAMES: dict[AutoMode, str] = {
    AutoMode.OFF: "Off",
    AutoMode.ONCE: "Once",
    AutoMode.CONTINUOUS: "Continuous",
}

FORMAT_NAMES: dict[PixelFormat, tuple[str, ...]] = {
    PixelFormat.MONO8: ("Mono8",),
    PixelFormat.MONO12: ("Mono12",),
    PixelFormat.MONO12P: ("Mono12p",),
    PixelFormat.BAYER_RG8: ("BayerRG8",),
    PixelFormat.BAYER_RG12P: ("BayerRG12p",),
    PixelFormat.RGB8: ("RGB8", "RGB8Packed"),
}

WRITE_ONLY, READ_ONLY, READ_WRITE = 2, 3, 4
"""The vendor's access modes; 0: the camera does not have the feature, 1: not at present."""


def find(nodes: Nodes, names: tuple[str, ...]) -> Vendor:
    """Return the first of the features that the camera has and that is readable, or None."""
    for name in names:
        node = nodes.GetNode(name)
        if node is not None and _access(node) >= READ_ONLY:
            return node
    return None


def span_of(nodes: Nodes, names: tuple[str, ...], *, locked: bool = False) -> ValueRange:
    """Return the accepted values of a feature; one that is missing or not writable has a single value.

    `locked`: the camera sets it automatically, so it is not writable now, but its limits still apply.
    """
    node = find(nodes, names)
    if node is None:
        return ValueRange(low=0.0, high=0.0)
    if _access(node) != READ_WRITE and not locked:
        return ValueRange(low=float(node.GetValue()), high=float(node.GetValue()))
    return ValueRange(low=float(node.GetMin()), high=float(node.GetMax()))


def read_number(nodes: Nodes, names: tuple[str, ...]) -> float:
    """Return a feature's value; 0 when the camera does not have it."""
    node = find(nodes, names)
    return 0.0 if node is None else float(node.GetValue())


def write_number(nodes: Nodes, names: tuple[str, ...], value: float) -> None:
    """Write a feature if it is writable; values for others have been refused before."""
    node = find(nodes, names)
    if node is None or _access(node) != READ_WRITE:
        return
    low, high = float(node.GetMin()), float(node.GetMax())
    inside = min(max(value, low), high)  # unit conversion may exceed a limit by rounding
    node.SetValue(round(inside) if isinstance(node.GetValue(), int) else inside)


def write_choice(nodes: Nodes, name: str, value: str, *, label: str) -> None:
    """Set an enumeration feature; raise `OutOfRange` that lists the possible values."""
    node = nodes.GetNode(name)
    if node is None or _access(node) < READ_ONLY:
        raise OutOfRange(f"{label}: asked for {name} = {value}, and it has no {name}; leave it out")
    if value not in (words := choices(nodes, name)):
        raise OutOfRange(
            f"{label}: asked for {name} = {value}, and it has {', '.join(words)}; choose one of these"
        )
    if node.GetValue() != value:
        node.SetValue(value)


def write_choice_if_there(nodes: Nodes, name: str, value: str) -> None:
    """Set an enumeration feature on cameras that have the feature and the value."""
    if value in choices(nodes, name) and _access(node := nodes.GetNode(name)) == READ_WRITE:
        node.SetValue(value)


def can_switch(nodes: Nodes, name: str) -> bool:
    """Return whether the camera has a boolean feature that is writable now."""
    node = nodes.GetNode(name)
    return node is not None and _access(node) == READ_WRITE


def can_execute(nodes: Nodes, name: str) -> bool:
    """Return whether the camera has a command that can be executed now."""
    node = nodes.GetNode(name)
    return node is not None and _access(node) in (WRITE_ONLY, READ_WRITE)


def exposure_autos(nodes: Nodes) -> tuple[AutoMode, ...]:
    """Return the automatic exposure modes; always includes off."""
    has = choices(nodes, EXPOSURE_AUTO)
    return tuple(mode for mode, name in AUTO_NAMES.items() if mode is AutoMode.OFF or name in has)


def rate_is_free(nodes: Nodes) -> bool:
    """Return whether the camera chooses its rate itself."""
    return can_switch(nodes, MANUAL_RATE) and not nodes.GetNode(MANUAL_RATE).GetValue()


def read_exposure_auto(nodes: Nodes) -> AutoMode:
    """Return the exposure mode in force; a value with a non-standard name counts as continuous."""
    if not choices(nodes, EXPOSURE_AUTO):
        return AutoMode.OFF
    now = str(nodes.GetNode(EXPOSURE_AUTO).GetValue())
    return next((mode for mode, name in AUTO_NAMES.items() if name == now), AutoMode.CONTINUOUS)


def switch_if_there(nodes: Nodes, name: str, *, on: bool) -> None:
    """Set a boolean feature on cameras that have it."""
    if can_switch(nodes, name):
        nodes.GetNode(name).SetValue(on)


def write_whole(nodes: Nodes, name: str, value: int, *, label: str) -> None:
    """Write an integer that the camera must accept exactly."""
    node = nodes.GetNode(name)
    if node is None or _access(node) != READ_WRITE:
        raise DeviceFault(f"{label}: asked for {name} = {value}, and it cannot be set now; leave it out")
    low, high, step = node.GetMin(), node.GetMax(), node.GetInc()
    if not low <= value <= high or (value - low) % step:
        raise OutOfRange(
            f"{label}: {name} {value} is not one of {low} to {high} in steps of {step}; choose one of these"
        )
    node.SetValue(value)


def choices(nodes: Nodes, name: str) -> tuple[str, ...]:
    """Return the possible values of an enumeration feature; empty when the camera does not have it."""
    node = nodes.GetNode(name)
    if node is None or _access(node) < READ_ONLY:
        return ()
    return tuple(str(word) for word in node.GetSymbolics())


def pixel_formats(nodes: Nodes) -> tuple[PixelFormat, ...]:
    """Return the pixel formats that both this program and the camera support."""
    has = choices(nodes, "PixelFormat")
    return tuple(known for known, names in FORMAT_NAMES.items() if any(name in has for name in names))


def format_name(nodes: Nodes, pixel_format: PixelFormat, *, label: str) -> str:
    """Return the camera's name of a format; raise `OutOfRange` that lists the possible ones."""
    has = choices(nodes, "PixelFormat")
    for name in FORMAT_NAMES[pixel_format]:
        if name in has:
            return name
    allowed = ", ".join(pixel_formats(nodes)) or "none that this program knows"
    raise OutOfRange(f"{label}: pixel format {pixel_format} is not one of its own; use {allowed}")


def read_format(nodes: Nodes, *, label: str) -> PixelFormat:
    """Return the pixel format in force."""
    now = str(nodes.GetNode("PixelFormat").GetValue())
    for known, names in FORMAT_NAMES.items():
        if now in names:
            return known
    raise DeviceFault(f"{label}: it sends {now}, which this program does not read; ask for another format")


def require_inside(label: str, what: str, asked: float, span: ValueRange, unit: str) -> None:
    """Raise `OutOfRange` for a value outside a range, saying so when the setting is fixed."""
    slack = 1e-9 * max(abs(span.low), abs(span.high))
    if math.isfinite(asked) and span.low - slack <= asked <= span.high + slack:
        return
    if span.low == span.high:
        raise OutOfRange(f"{label}: {what} {asked:g} {unit}: it is {span.low:g} {unit} and cannot be set")
    raise OutOfRange(
        f"{label}: {what} {asked:g} {unit} is outside {span.low:g} to {span.high:g} {unit}; choose one inside"
    )


def _access(node: Vendor) -> int:
    return int(node.GetAccessMode())
