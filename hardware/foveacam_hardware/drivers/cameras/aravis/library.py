"""The system's libaravis 0.8 through ctypes: signatures of the functions used, and its errors translated.

The library is loaded when a camera is opened or searched for, so that a machine without it can use the rest.
"""

import ctypes
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_uint32, c_uint64, c_void_p
from typing import Any

from foveacam_hardware.contract import DeviceFault, DeviceInfo, FoveaError, NotConnected, OutOfRange
from foveacam_hardware.drivers.cameras.device import FoundCamera

LIBRARY = "libaravis-0.8.so.0"
DEVICE_ERRORS = b"arv-device-error-quark"
GENICAM_ERRORS = b"arv-gc-error-quark"
NOT_CONNECTED, TRANSFER, TIMEOUT, NOT_FOUND, NOT_CONTROLLER = 2, 4, 5, 6, 10
GONE = (NOT_CONNECTED, TRANSFER, TIMEOUT, NOT_FOUND)
OUT_OF_RANGE = 5
"""Error code of GenICam."""


class _GError(ctypes.Structure):
    _fields_ = (("domain", c_uint32), ("code", c_int), ("message", c_char_p))


_PLAIN: dict[str, tuple[Any, tuple[Any, ...]]] = {  # Any: ctypes' types have none in common
    "arv_update_device_list": (None, ()),
    "arv_get_n_devices": (c_uint, ()),
    "arv_get_device_id": (c_char_p, (c_uint,)),
    "arv_get_device_vendor": (c_char_p, (c_uint,)),
    "arv_get_device_model": (c_char_p, (c_uint,)),
    "arv_get_device_serial_nbr": (c_char_p, (c_uint,)),
    "arv_get_device_address": (c_char_p, (c_uint,)),
    "arv_get_device_protocol": (c_char_p, (c_uint,)),
    "arv_camera_get_device": (c_void_p, (c_void_p,)),
    "arv_camera_is_gv_device": (c_int, (c_void_p,)),
    "arv_camera_gv_set_stream_options": (None, (c_void_p, c_int)),
    "arv_gv_device_is_controller": (c_int, (c_void_p,)),
    "arv_gv_device_get_interface_address": (c_void_p, (c_void_p,)),
    "arv_gv_stream_get_port": (ctypes.c_uint16, (c_void_p,)),
    "arv_stream_push_buffer": (None, (c_void_p, c_void_p)),
    "arv_stream_timeout_pop_buffer": (c_void_p, (c_void_p, c_uint64)),
    "arv_stream_get_statistics": (None, (c_void_p, POINTER(c_uint64), POINTER(c_uint64), POINTER(c_uint64))),
    "arv_buffer_new_allocate": (c_void_p, (c_size_t,)),
    "arv_buffer_get_status": (c_int, (c_void_p,)),
    "arv_buffer_get_data": (c_void_p, (c_void_p, POINTER(c_size_t))),
    "arv_buffer_get_image_width": (c_int, (c_void_p,)),
    "arv_buffer_get_image_height": (c_int, (c_void_p,)),
    "arv_buffer_get_frame_id": (c_uint64, (c_void_p,)),
    "arv_buffer_get_timestamp": (c_uint64, (c_void_p,)),
    "g_inet_address_to_string": (c_void_p, (c_void_p,)),
    "g_inet_socket_address_get_address": (c_void_p, (c_void_p,)),
    "g_object_set": (None, (c_void_p, c_char_p, c_int, c_char_p, c_int, c_void_p)),
    "g_object_unref": (None, (c_void_p,)),
    "g_free": (None, (c_void_p,)),
    "g_error_free": (None, (c_void_p,)),
    "g_quark_to_string": (c_char_p, (c_uint32,)),
}
_BOUNDS = (None, (c_void_p, POINTER(c_double), POINTER(c_double)))
_FAILING: dict[str, tuple[Any, tuple[Any, ...]]] = {  # each has one more argument, for its GError
    "arv_camera_new": (c_void_p, (c_char_p,)),
    "arv_camera_get_vendor_name": (c_char_p, (c_void_p,)),
    "arv_camera_get_model_name": (c_char_p, (c_void_p,)),
    "arv_camera_is_feature_available": (c_int, (c_void_p, c_char_p)),
    "arv_camera_get_string": (c_char_p, (c_void_p, c_char_p)),
    "arv_camera_set_string": (None, (c_void_p, c_char_p, c_char_p)),
    "arv_camera_dup_available_enumerations_as_strings": (
        POINTER(c_char_p),
        (c_void_p, c_char_p, POINTER(c_uint)),
    ),
    "arv_camera_set_boolean": (None, (c_void_p, c_char_p, c_int)),
    "arv_camera_get_float": (c_double, (c_void_p, c_char_p)),
    "arv_camera_get_integer": (ctypes.c_int64, (c_void_p, c_char_p)),
    "arv_camera_set_integer": (None, (c_void_p, c_char_p, ctypes.c_int64)),
    "arv_camera_execute_command": (None, (c_void_p, c_char_p)),
    "arv_camera_get_sensor_size": (None, (c_void_p, POINTER(c_int), POINTER(c_int))),
    "arv_camera_get_x_offset_increment": (c_int, (c_void_p,)),
    "arv_camera_get_y_offset_increment": (c_int, (c_void_p,)),
    "arv_camera_set_region": (None, (c_void_p, c_int, c_int, c_int, c_int)),
    "arv_camera_set_acquisition_mode": (None, (c_void_p, c_int)),
    "arv_camera_start_acquisition": (None, (c_void_p,)),
    "arv_camera_stop_acquisition": (None, (c_void_p,)),
    "arv_camera_software_trigger": (None, (c_void_p,)),
    "arv_camera_create_stream": (c_void_p, (c_void_p, c_void_p, c_void_p)),
    "arv_camera_get_payload": (c_uint, (c_void_p,)),
    "arv_camera_set_exposure_time": (None, (c_void_p, c_double)),
    "arv_camera_get_exposure_time": (c_double, (c_void_p,)),
    "arv_camera_get_exposure_time_bounds": _BOUNDS,
    "arv_camera_set_gain": (None, (c_void_p, c_double)),
    "arv_camera_get_gain": (c_double, (c_void_p,)),
    "arv_camera_get_gain_bounds": _BOUNDS,
    "arv_camera_is_gain_available": (c_int, (c_void_p,)),
    "arv_camera_set_black_level": (None, (c_void_p, c_double)),
    "arv_camera_get_black_level": (c_double, (c_void_p,)),
    "arv_camera_get_black_level_bounds": _BOUNDS,
    "arv_camera_is_black_level_available": (c_int, (c_void_p,)),
    "arv_camera_set_frame_rate": (None, (c_void_p, c_double)),
    "arv_camera_get_frame_rate": (c_double, (c_void_p,)),
    "arv_camera_get_frame_rate_bounds": _BOUNDS,
    "arv_camera_is_frame_rate_available": (c_int, (c_void_p,)),
    "arv_camera_set_pixel_format_from_string": (None, (c_void_p, c_char_p)),
    "arv_camera_get_pixel_format_as_string": (c_char_p, (c_void_p,)),
    "arv_camera_dup_available_pixel_formats_as_strings": (POINTER(c_char_p), (c_void_p, POINTER(c_uint))),
    "arv_camera_set_trigger": (None, (c_void_p, c_char_p)),
    "arv_camera_clear_triggers": (None, (c_void_p,)),
    "arv_camera_gv_set_packet_size": (None, (c_void_p, c_int)),
    "arv_camera_gv_auto_packet_size": (c_uint, (c_void_p,)),
    "arv_camera_gv_set_packet_delay": (None, (c_void_p, ctypes.c_int64)),
    "arv_device_read_register": (c_int, (c_void_p, c_uint64, POINTER(c_uint32))),
    "arv_device_write_register": (c_int, (c_void_p, c_uint64, c_uint32)),
}


class AravisLibrary:
    """The library's functions by name; raises `NotConnected` when the library is not installed."""

    def __init__(self) -> None:
        try:
            loaded = ctypes.CDLL(LIBRARY)
        except OSError as error:
            raise NotConnected(
                f"GigE and USB3 Vision cameras need {LIBRARY}, and it is not installed here ({error});"
                " Debian and Ubuntu: apt-get install libaravis-0.8-0"
            ) from error
        self._functions = {}
        for name, (result, arguments) in _PLAIN.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = result, arguments
            self._functions[name] = function
        for name, (result, arguments) in _FAILING.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = result, (*arguments, POINTER(POINTER(_GError)))
            self._functions[name] = function

    def plain(self, name: str) -> Any:  # noqa: ANN401 - a foreign function
        """Return a function that reports no error."""
        return self._functions[name]

    def call(self, name: str, *arguments: object, label: str) -> Any:  # noqa: ANN401 - whatever it returns
        """Call a function that reports errors; raise them as the contract's, with `label` as the subject."""
        failure = POINTER(_GError)()
        result = self._functions[name](*arguments, byref(failure))
        if failure:
            error = self._explain(failure.contents, name.removeprefix("arv_").replace("_", " "), label)
            self.plain("g_error_free")(failure)
            raise error
        return result

    def bounds(self, name: str, camera: int, *, label: str) -> tuple[float, float]:
        """Return the two doubles (low, high) that a bounds function returns."""
        low, high = c_double(), c_double()
        self.call(name, camera, byref(low), byref(high), label=label)
        return low.value, high.value

    def _explain(self, failure: _GError, asked: str, label: str) -> FoveaError:
        domain = self.plain("g_quark_to_string")(failure.domain)
        found = (failure.message or b"").decode(errors="replace")
        sentence = f"{label}: asked to {asked}, found: {found}"
        if domain == DEVICE_ERRORS and failure.code == NOT_CONTROLLER:
            return NotConnected(f"{sentence}; another program controls it: close that program")
        if domain == DEVICE_ERRORS and failure.code in GONE:
            return NotConnected(f"{sentence}; check its cable, its power and its address")
        if domain == GENICAM_ERRORS and failure.code == OUT_OF_RANGE:
            return OutOfRange(f"{sentence}; choose a value inside of its range")
        return DeviceFault(f"{sentence}; power it off and on, and see whether its firmware is up to date")


def list_cameras(library: AravisLibrary) -> list[tuple[str, FoundCamera]]:
    """Return the library's current device list: the id to open each camera by, and its description."""
    return [
        (
            _text(library, "arv_get_device_id", index),
            FoundCamera(
                kind="aravis",
                info=DeviceInfo(
                    vendor=_text(library, "arv_get_device_vendor", index),
                    model=_text(library, "arv_get_device_model", index),
                    serial=_text(library, "arv_get_device_serial_nbr", index),
                    version=_text(library, "arv_get_device_protocol", index),
                ),
                address=_text(library, "arv_get_device_address", index),
            ),
        )
        for index in range(library.plain("arv_get_n_devices")())
    ]


def interface_address(library: AravisLibrary, camera: int) -> str:
    """Return this machine's address on the interface through which a GigE Vision camera is reached."""
    device = library.plain("arv_camera_get_device")(camera)
    socket_address = library.plain("arv_gv_device_get_interface_address")(device)
    text = library.plain("g_inet_address_to_string")(
        library.plain("g_inet_socket_address_get_address")(socket_address)
    )
    address = ctypes.string_at(text).decode()
    library.plain("g_free")(text)
    return address


def find_cameras() -> list[FoundCamera]:
    """Search every network interface and USB; takes a second. Raise `NotConnected` without the library."""
    library = AravisLibrary()
    library.plain("arv_update_device_list")()
    return [found for _, found in list_cameras(library)]


def _text(library: AravisLibrary, name: str, index: int) -> str:
    text: bytes | None = library.plain(name)(index)
    return "" if text is None else text.decode(errors="replace")
