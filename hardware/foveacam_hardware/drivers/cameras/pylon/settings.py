"""Settings of Basler cameras: checked as a whole before any change, written, and read back."""

from dataclasses import dataclass

from foveacam_hardware.contract import (
    AutoMode,
    CameraRanges,
    CameraSettings,
    OutOfRange,
    TriggerSource,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.pylon import nodes
from foveacam_hardware.drivers.cameras.pylon.region import RegionOptions, set_sensor_region
from foveacam_hardware.drivers.cameras.ranges import refuse_modes

NS_PER_US = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PylonOptions(RegionOptions):
    """Wiring of a camera and sensor region to read; None for the whole sensor."""

    trigger_line: str = "Line1"
    trigger_edge: str = "rising"
    strobe_line: str | None = "Line2"
    buffers: int = 16


def initialise_camera(map_: nodes.Nodes, options: PylonOptions, *, label: str) -> None:
    """Bring an opened camera into a known state: nothing automatic, no trigger, the sensor region set."""
    for automatic in (nodes.EXPOSURE_AUTO, "GainAuto"):
        nodes.write_choice_if_there(map_, automatic, "Off")
    nodes.write_choice_if_there(map_, "AcquisitionMode", "Continuous")
    nodes.write_choice_if_there(map_, "TriggerMode", "Off")
    set_sensor_region(map_, options, label=label)


def ranges_of(map_: nodes.Nodes) -> CameraRanges:
    """Return the accepted values of every setting."""
    automatic = nodes.read_exposure_auto(map_) is not AutoMode.OFF
    exposure_us = nodes.span_of(map_, nodes.EXPOSURE_US, locked=automatic)
    return CameraRanges(
        exposure_ns=ValueRange(low=exposure_us.low * NS_PER_US, high=exposure_us.high * NS_PER_US),
        gain_db=nodes.span_of(map_, nodes.GAIN_DB),
        frame_rate_hz=nodes.span_of(map_, nodes.FRAME_RATE_HZ, locked=nodes.rate_is_free(map_)),
        black_level=nodes.span_of(map_, nodes.BLACK_LEVEL),
        pixel_formats=nodes.pixel_formats(map_),
        exposure_autos=nodes.exposure_autos(map_),
        frame_rate_auto=nodes.can_switch(map_, nodes.MANUAL_RATE),
    )


def check_settings(map_: nodes.Nodes, asked: CameraSettings, *, label: str) -> None:
    """Raise `OutOfRange` for settings that the camera does not accept, before anything is changed."""
    ranges = ranges_of(map_)
    ms = ValueRange(low=ranges.exposure_ns.low / 1e6, high=ranges.exposure_ns.high / 1e6)
    nodes.require_inside(label, "exposure", asked.exposure_ns / 1e6, ms, "ms")
    nodes.require_inside(label, "gain", asked.gain_db, ranges.gain_db, "dB")
    if not asked.frame_rate_auto:
        nodes.require_inside(label, "frame rate", asked.frame_rate_hz, ranges.frame_rate_hz, "Hz")
    nodes.require_inside(label, "black level", asked.black_level, ranges.black_level, "of its units")
    nodes.format_name(map_, asked.pixel_format, label=label)
    try:
        refuse_modes(asked, ranges)
    except OutOfRange as refused:
        raise OutOfRange(f"{label}: {refused}") from None


def write_settings(map_: nodes.Nodes, settings: CameraSettings, options: PylonOptions, *, label: str) -> None:
    """Write checked settings."""
    name = nodes.format_name(map_, settings.pixel_format, label=label)
    nodes.write_choice(map_, "PixelFormat", name, label=label)
    _write_trigger(map_, settings, options, label=label)
    nodes.write_choice_if_there(map_, nodes.EXPOSURE_AUTO, nodes.AUTO_NAMES[AutoMode.OFF])
    nodes.write_number(map_, nodes.EXPOSURE_US, settings.exposure_ns / NS_PER_US)
    nodes.write_number(map_, nodes.GAIN_DB, settings.gain_db)
    nodes.write_number(map_, nodes.BLACK_LEVEL, settings.black_level)
    nodes.switch_if_there(map_, nodes.MANUAL_RATE, on=not settings.frame_rate_auto)
    if not settings.frame_rate_auto:
        nodes.write_number(map_, nodes.FRAME_RATE_HZ, settings.frame_rate_hz)
    if settings.exposure_auto is not AutoMode.OFF:  # last: it starts from the exposure written above
        nodes.write_choice(map_, nodes.EXPOSURE_AUTO, nodes.AUTO_NAMES[settings.exposure_auto], label=label)


def read_back(map_: nodes.Nodes, asked: CameraSettings, *, label: str) -> CameraSettings:
    """Return the settings in force; the rate is limited to what the camera can achieve."""
    set_hz = nodes.read_number(map_, nodes.FRAME_RATE_HZ) or asked.frame_rate_hz
    possible_hz = nodes.read_number(map_, nodes.RESULTING_RATE_HZ) or set_hz
    return CameraSettings(
        exposure_ns=round(nodes.read_number(map_, nodes.EXPOSURE_US) * NS_PER_US),
        exposure_auto=nodes.read_exposure_auto(map_),
        gain_db=nodes.read_number(map_, nodes.GAIN_DB),
        frame_rate_hz=possible_hz if asked.frame_rate_auto else min(set_hz, possible_hz),
        frame_rate_auto=asked.frame_rate_auto,
        pixel_format=nodes.read_format(map_, label=label),
        triggered=asked.triggered,
        trigger_source=asked.trigger_source,
        black_level=nodes.read_number(map_, nodes.BLACK_LEVEL),
        binning=asked.binning,
    )


def _write_trigger(map_: nodes.Nodes, settings: CameraSettings, options: PylonOptions, *, label: str) -> None:
    """Set what starts each exposure, and the output line that signals it."""
    nodes.write_choice_if_there(map_, "TriggerSelector", "FrameStart")
    if not settings.triggered:
        nodes.write_choice_if_there(map_, "TriggerMode", "Off")
        return
    nodes.write_choice(map_, "TriggerMode", "On", label=label)
    if settings.trigger_source is TriggerSource.SOFTWARE:
        nodes.write_choice(map_, "TriggerSource", "Software", label=label)
        return
    nodes.write_choice(map_, "TriggerSource", options.trigger_line, label=label)
    edge = "FallingEdge" if options.trigger_edge == "falling" else "RisingEdge"
    nodes.write_choice(map_, "TriggerActivation", edge, label=label)
    if options.strobe_line is not None:
        nodes.write_choice(map_, "LineSelector", options.strobe_line, label=label)
        nodes.write_choice_if_there(map_, "LineMode", "Output")
        nodes.write_choice(map_, "LineSource", "ExposureActive", label=label)
