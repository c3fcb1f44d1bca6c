"""Settings of a GenICam camera through libaravis, written and read back; times there are in microseconds."""

import ctypes
import logging
from ctypes import byref, c_uint, c_uint32
from dataclasses import dataclass, replace

from foveacam_hardware.contract import (
    AutoMode,
    CameraRanges,
    CameraSettings,
    DeviceFault,
    OutOfRange,
    PixelFormat,
    TriggerSource,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.aravis.automatic import AravisAutomatic
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary
from foveacam_hardware.drivers.cameras.aravis.region import AravisRegion, RegionOptions
from foveacam_hardware.drivers.cameras.ranges import refuse_modes

logger = logging.getLogger(__name__)

CONTINUOUS = 0
NO_PACKET_SOCKET = 1
"""Stream option without libaravis's packet socket, which receives the whole network until its filter is set:
it then numbers frames from the first packet of any source and drops up to 99 of the camera's own as late.
An ordinary socket receives its own port only."""
FIXED = ValueRange(low=0.0, high=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class AravisOptions(RegionOptions):
    """Rig file options beyond the contract's settings; None leaves an option to the camera."""

    trigger_line: str = "Line0"
    falling_edge: bool = False
    strobe_line: str | None = "Line1"
    packet_size_bytes: int | None = None
    packet_delay_ns: int | None = None
    interface: str | None = None


class AravisFeatures:
    """The features of one open camera."""

    def __init__(self, library: AravisLibrary, camera: int, *, label: str) -> None:
        self._library = library
        self._camera = camera
        self._label = label
        self._automatic = AravisAutomatic(self)
        self._region = AravisRegion(self, label=label)

    def ranges(self) -> CameraRanges:
        """Return the accepted values of every setting."""
        low_us, high_us = self._bounds("exposure_time")
        return CameraRanges(
            exposure_ns=ValueRange(low=low_us * 1e3, high=high_us * 1e3),
            gain_db=self._range("gain"),
            frame_rate_hz=self._range("frame_rate"),
            black_level=self._range("black_level"),
            pixel_formats=self._pixel_formats(),
            exposure_autos=self._automatic.exposure_modes,
            frame_rate_auto=self._automatic.has_rate,
        )

    def prepare(self, options: AravisOptions) -> None:
        """Bring an opened camera into a known state: continuous acquisition, nothing automatic."""
        self.call("set_acquisition_mode", CONTINUOUS)
        self._automatic.disable_all()
        self._set_packets(options)
        if options.strobe_line is not None:
            self._strobe(options.strobe_line)

    def apply(self, settings: CameraSettings, options: AravisOptions) -> CameraSettings:
        """Write the settings; return those in force, with the binning that the camera does itself."""
        self._check_modes(settings)
        self.call("set_pixel_format_from_string", settings.pixel_format.encode())
        own_binning = self._region.apply(options, settings)
        self._automatic.set_exposure_mode(AutoMode.OFF)
        self.call("set_exposure_time", settings.exposure_ns / 1e3)
        if self.call("is_gain_available"):
            self.call("set_gain", settings.gain_db)
        if self.call("is_black_level_available"):
            self.call("set_black_level", settings.black_level)
        if settings.triggered:
            self._trigger(settings, options)
        else:
            self.call("clear_triggers")
            self._write_rate(settings)
        if settings.exposure_auto is not AutoMode.OFF:  # last: it starts from the exposure written above
            self._automatic.set_exposure_mode(settings.exposure_auto)
        return self.read_back(replace(settings, binning=own_binning))

    def has(self, feature: str) -> bool:
        """Return whether the camera has a feature now."""
        return bool(self.call("is_feature_available", feature.encode()))

    @property
    def has_registers(self) -> bool:
        """Whether it is a GigE Vision camera."""
        return bool(self._library.plain("arv_camera_is_gv_device")(self._camera))

    def text(self, feature: str) -> str:
        """Return the value of an enumeration feature."""
        word = self.call("get_string", feature.encode())
        return word.decode(errors="replace") if isinstance(word, bytes) else ""

    def choices(self, feature: str) -> frozenset[str]:
        """Return the possible values of an enumeration feature."""
        count = c_uint()
        names = self.call("dup_available_enumerations_as_strings", feature.encode(), byref(count))
        return self._strings(names, count.value)

    def choose(self, feature: str, word: str) -> None:
        """Set an enumeration feature."""
        self.call("set_string", feature.encode(), word.encode())

    def switch(self, feature: str, *, on: bool) -> None:
        """Set a boolean feature."""
        self.call("set_boolean", feature.encode(), int(on))

    def number(self, feature: str) -> float:
        """Return the value of a numeric feature."""
        value = self.call("get_float", feature.encode())
        return value if isinstance(value, float) else 0.0

    def execute(self, command: str) -> None:
        """Execute a command feature."""
        self.call("execute_command", command.encode())

    def integer(self, feature: str) -> int:
        """Return the value of a numeric feature."""
        value = self.call("get_integer", feature.encode())
        return value if isinstance(value, int) else 0

    def read_register(self, address: int) -> int:
        """Return a 32-bit register of a GigE Vision camera."""
        value = c_uint32()
        device = self._library.plain("arv_camera_get_device")(self._camera)
        self._library.call("arv_device_read_register", device, address, byref(value), label=self._label)
        return value.value

    def write_register(self, address: int, value: int) -> None:
        """Write a 32-bit register of a GigE Vision camera."""
        device = self._library.plain("arv_camera_get_device")(self._camera)
        self._library.call("arv_device_write_register", device, address, value, label=self._label)

    def call(self, name: str, *arguments: object) -> object:
        """Call the library function `arv_camera_<name>` on the camera."""
        return self._library.call(f"arv_camera_{name}", self._camera, *arguments, label=self._label)

    def read_back(self, asked: CameraSettings) -> CameraSettings:
        """Return the settings in force, for a request `asked`."""
        name = self.call("get_pixel_format_as_string")
        return replace(
            asked,
            exposure_ns=round(self._number("exposure_time") * 1e3),
            exposure_auto=self._automatic.exposure_mode(),
            gain_db=self._number("gain") if self.call("is_gain_available") else 0.0,
            frame_rate_hz=asked.frame_rate_hz if asked.triggered else self._rate_hz(asked),
            pixel_format=PixelFormat(name.decode() if isinstance(name, bytes) else ""),
            black_level=self._number("black_level") if self.call("is_black_level_available") else 0.0,
        )

    def _check_modes(self, settings: CameraSettings) -> None:
        try:
            refuse_modes(settings, self.ranges())
        except OutOfRange as refused:
            raise OutOfRange(f"{self._label}: {refused}") from None

    def _write_rate(self, settings: CameraSettings) -> None:
        """Set the frame rate, or leave it to the camera."""
        self._automatic.set_free_rate(on=settings.frame_rate_auto)
        if not settings.frame_rate_auto and self.call("is_frame_rate_available"):
            # The rate cannot exceed 1 / exposure; not every camera limits it by itself.
            self.call("set_frame_rate", min(settings.frame_rate_hz, 1e9 / settings.exposure_ns))

    def _rate_hz(self, asked: CameraSettings) -> float:
        if asked.frame_rate_auto and (resulting_hz := self._automatic.resulting_hz()) is not None:
            return resulting_hz
        return self._number("frame_rate") if self.call("is_frame_rate_available") else asked.frame_rate_hz

    def _trigger(self, settings: CameraSettings, options: AravisOptions) -> None:
        if settings.trigger_source is TriggerSource.SOFTWARE:
            self.call("set_trigger", b"Software")
        else:
            self.call("set_trigger", options.trigger_line.encode())
            if options.falling_edge:
                self.call("set_string", b"TriggerActivation", b"FallingEdge")
        if self.has("TriggerOverlap"):
            self._choose_if_possible("TriggerOverlap", b"ReadOut")  # expose during readout: doubles the rate

    def _strobe(self, line: str) -> None:
        """Signal exposures on an output line; a camera without one is logged and used without strobe."""
        if not self.has("LineSelector"):
            logger.info("%s: it has no output lines; the strobe is not available", self._label)
            return
        self._choose_if_possible("LineSelector", line.encode())
        if self.has("LineMode"):
            self._choose_if_possible("LineMode", b"Output")
        self._choose_if_possible("LineSource", b"ExposureActive")

    def _choose_if_possible(self, feature: str, choice: bytes) -> None:
        """Set an optional enumeration feature; log a warning when the camera refuses."""
        try:
            self.call("set_string", feature.encode(), choice)
        except (OutOfRange, DeviceFault) as error:
            logger.warning("%s: no %s for its %s: %s", self._label, choice.decode(), feature, error)

    def _set_packets(self, options: AravisOptions) -> None:
        if not self.has_registers:
            return
        self._library.plain("arv_camera_gv_set_stream_options")(self._camera, NO_PACKET_SOCKET)
        if options.packet_size_bytes is not None:
            self.call("gv_set_packet_size", options.packet_size_bytes)
        else:
            self._maximise_packets()
        if options.packet_delay_ns is not None:
            self.call("gv_set_packet_delay", options.packet_delay_ns)

    def _maximise_packets(self) -> None:
        try:
            self.call("gv_auto_packet_size")
        except (OutOfRange, DeviceFault) as error:
            logger.warning("%s: the size of its packets stays as it is: %s", self._label, error)

    def _pixel_formats(self) -> tuple[PixelFormat, ...]:
        count = c_uint()
        names = self.call("dup_available_pixel_formats_as_strings", byref(count))
        available = self._strings(names, count.value)
        return tuple(known for known in PixelFormat if known in available)

    def _strings(self, names: object, count: int) -> frozenset[str]:
        """Return an array of strings from the library and free it."""
        if not isinstance(names, ctypes.POINTER(ctypes.c_char_p)) or not names:
            return frozenset()
        words = frozenset(names[index].decode(errors="replace") for index in range(count))
        self._library.plain("g_free")(names)
        return words

    def _range(self, name: str) -> ValueRange:
        if not self.call(f"is_{name}_available"):
            return FIXED
        low, high = self._bounds(name)
        return ValueRange(low=low, high=high)

    def _bounds(self, name: str) -> tuple[float, float]:
        return self._library.bounds(f"arv_camera_get_{name}_bounds", self._camera, label=self._label)

    def _number(self, name: str) -> float:
        value = self.call(f"get_{name}")
        return value if isinstance(value, float) else 0.0
