"""What a GenICam camera is asked for through libaravis, and what it took; times in microseconds there."""

import ctypes
import logging
from ctypes import byref, c_int, c_uint, c_uint32
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
from foveacam_hardware.drivers.cameras.ranges import refuse_modes

logger = logging.getLogger(__name__)

CONTINUOUS = 0
NO_PACKET_SOCKET = 1
"""libaravis's packet socket, taken where it is allowed, hears the whole network until its filter stands: it
then numbers frames by the first packet of whatever it heard, and drops up to 99 of the camera's own as late.
An ordinary socket hears its own port only."""
FIXED = ValueRange(low=0.0, high=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class AravisOptions:
    """What a rig file says beyond the contract's settings; None leaves a thing to the camera."""

    trigger_line: str = "Line0"
    falling_edge: bool = False
    strobe_line: str | None = "Line1"
    width_px: int | None = None
    height_px: int | None = None
    offset_x_px: int | None = None
    offset_y_px: int | None = None
    packet_size_bytes: int | None = None
    packet_delay_ns: int | None = None
    interface: str | None = None


class AravisFeatures:
    """The features of one open camera."""

    def __init__(self, library: AravisLibrary, camera: int, *, who: str) -> None:
        self._library = library
        self._camera = camera
        self._who = who
        self._automatic = AravisAutomatic(self)

    def ranges(self) -> CameraRanges:
        """Return what it accepts."""
        low_us, high_us = self._bounds("exposure_time")
        return CameraRanges(
            exposure_ns=ValueRange(low=low_us * 1e3, high=high_us * 1e3),
            gain_db=self._span("gain"),
            frame_rate_hz=self._span("frame_rate"),
            black_level=self._span("black_level"),
            pixel_formats=self._pixel_formats(),
            exposure_autos=self._automatic.exposure_modes,
            frame_rate_auto=self._automatic.has_rate,
        )

    def prepare(self, options: AravisOptions) -> None:
        """Bring an opened camera into a known state: continuous, nothing automatic, the whole sensor."""
        self.call("set_acquisition_mode", CONTINUOUS)
        self._automatic.all_off()
        self._packets(options)
        if options.strobe_line is not None:
            self._strobe(options.strobe_line)

    def apply(self, settings: CameraSettings, options: AravisOptions) -> CameraSettings:
        """Ask for the settings; return what it took."""
        self._check_modes(settings)
        self.call("set_pixel_format_from_string", settings.pixel_format.encode())
        self._region(options)
        self._automatic.expose(AutoMode.OFF)
        self.call("set_exposure_time", settings.exposure_ns / 1e3)
        if self.call("is_gain_available"):
            self.call("set_gain", settings.gain_db)
        if self.call("is_black_level_available"):
            self.call("set_black_level", settings.black_level)
        if settings.triggered:
            self._trigger(settings, options)
        else:
            self.call("clear_triggers")
            self._pace(settings)
        if settings.exposure_auto is not AutoMode.OFF:  # last: it begins where the exposure was put
            self._automatic.expose(settings.exposure_auto)
        return self.read_back(settings)

    def has(self, feature: str) -> bool:
        """Tell whether the camera has a feature now."""
        return bool(self.call("is_feature_available", feature.encode()))

    @property
    def has_registers(self) -> bool:
        """Whether it is a GigE Vision camera."""
        return bool(self._library.plain("arv_camera_is_gv_device")(self._camera))

    def text(self, feature: str) -> str:
        """Return the word that is chosen of a feature."""
        word = self.call("get_string", feature.encode())
        return word.decode(errors="replace") if isinstance(word, bytes) else ""

    def choices(self, feature: str) -> frozenset[str]:
        """Return the words of a feature."""
        count = c_uint()
        names = self.call("dup_available_enumerations_as_strings", feature.encode(), byref(count))
        return self._words(names, count.value)

    def choose(self, feature: str, word: str) -> None:
        """Choose one of a feature's words."""
        self.call("set_string", feature.encode(), word.encode())

    def switch(self, feature: str, *, on: bool) -> None:
        """Set a yes-or-no feature."""
        self.call("set_boolean", feature.encode(), int(on))

    def number(self, feature: str) -> float:
        """Return the value of a feature."""
        value = self.call("get_float", feature.encode())
        return value if isinstance(value, float) else 0.0

    def execute(self, command: str) -> None:
        """Execute a command."""
        self.call("execute_command", command.encode())

    def integer(self, feature: str) -> int:
        """Return the value of a feature."""
        value = self.call("get_integer", feature.encode())
        return value if isinstance(value, int) else 0

    def read_register(self, address: int) -> int:
        """Return 32 bits of a GigE Vision camera."""
        value = c_uint32()
        device = self._library.plain("arv_camera_get_device")(self._camera)
        self._library.call("arv_device_read_register", device, address, byref(value), who=self._who)
        return value.value

    def write_register(self, address: int, value: int) -> None:
        """Write 32 bits of a GigE Vision camera."""
        device = self._library.plain("arv_camera_get_device")(self._camera)
        self._library.call("arv_device_write_register", device, address, value, who=self._who)

    def call(self, name: str, *arguments: object) -> object:
        """Call a function of the camera."""
        return self._library.call(f"arv_camera_{name}", self._camera, *arguments, who=self._who)

    def read_back(self, asked: CameraSettings) -> CameraSettings:
        """Return what is in force of what was asked for."""
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
            raise OutOfRange(f"{self._who}: {refused}") from None

    def _pace(self, settings: CameraSettings) -> None:
        """Set the frame rate, or leave it to the camera."""
        self._automatic.run_freely(on=settings.frame_rate_auto)
        if not settings.frame_rate_auto and self.call("is_frame_rate_available"):
            # A camera exposes no faster than its exposures last; not every one says so by itself.
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
            self._try("TriggerOverlap", b"ReadOut")  # expose while the last picture is read: twice as often

    def _strobe(self, line: str) -> None:
        """Let an output tell when it exposes; a camera without such a line goes without, and it is logged."""
        if not self.has("LineSelector"):
            logger.info("%s: it has no output lines; the strobe is not available", self._who)
            return
        self._try("LineSelector", line.encode())
        if self.has("LineMode"):
            self._try("LineMode", b"Output")
        self._try("LineSource", b"ExposureActive")

    def _try(self, feature: str, choice: bytes) -> None:
        """Choose what a camera may lack; it works without, and the log tells."""
        try:
            self.call("set_string", feature.encode(), choice)
        except (OutOfRange, DeviceFault) as error:
            logger.warning("%s: no %s for its %s: %s", self._who, choice.decode(), feature, error)

    def _region(self, options: AravisOptions) -> None:
        whole_width, whole_height = c_int(), c_int()
        self.call("get_sensor_size", byref(whole_width), byref(whole_height))
        width = options.width_px or whole_width.value
        height = options.height_px or whole_height.value
        if width > whole_width.value or height > whole_height.value:
            raise OutOfRange(
                f"{self._who}: asked for {width}x{height} pixels, but its sensor has {whole_width.value}x"
                f"{whole_height.value}; take a smaller part of it"
            )
        x = (whole_width.value - width) // 2 if options.offset_x_px is None else options.offset_x_px
        y = (whole_height.value - height) // 2 if options.offset_y_px is None else options.offset_y_px
        step_x, step_y = (self._whole(f"get_{axis}_offset_increment") for axis in "xy")
        self.call("set_region", x // step_x * step_x, y // step_y * step_y, width, height)

    def _packets(self, options: AravisOptions) -> None:
        if not self.has_registers:
            return
        self._library.plain("arv_camera_gv_set_stream_options")(self._camera, NO_PACKET_SOCKET)
        if options.packet_size_bytes is not None:
            self.call("gv_set_packet_size", options.packet_size_bytes)
        else:
            self._largest_packets()
        if options.packet_delay_ns is not None:
            self.call("gv_set_packet_delay", options.packet_delay_ns)

    def _largest_packets(self) -> None:
        try:
            self.call("gv_auto_packet_size")
        except (OutOfRange, DeviceFault) as error:
            logger.warning("%s: the size of its packets stays as it is: %s", self._who, error)

    def _pixel_formats(self) -> tuple[PixelFormat, ...]:
        count = c_uint()
        names = self.call("dup_available_pixel_formats_as_strings", byref(count))
        own = self._words(names, count.value)
        return tuple(known for known in PixelFormat if known in own)

    def _words(self, names: object, count: int) -> frozenset[str]:
        """Return a list of the library's, which is freed."""
        if not isinstance(names, ctypes.POINTER(ctypes.c_char_p)) or not names:
            return frozenset()
        words = frozenset(names[index].decode(errors="replace") for index in range(count))
        self._library.plain("g_free")(names)
        return words

    def _span(self, name: str) -> ValueRange:
        if not self.call(f"is_{name}_available"):
            return FIXED
        low, high = self._bounds(name)
        return ValueRange(low=low, high=high)

    def _bounds(self, name: str) -> tuple[float, float]:
        return self._library.bounds(f"arv_camera_get_{name}_bounds", self._camera, who=self._who)

    def _whole(self, name: str) -> int:
        value = self.call(name)
        return max(1, value) if isinstance(value, int) else 1

    def _number(self, name: str) -> float:
        value = self.call(f"get_{name}")
        return value if isinstance(value, float) else 0.0
