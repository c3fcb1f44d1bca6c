"""A GigE Vision camera in this process that sends images of ours, served by libaravis' fake camera.

A third party implements the protocol, so that the driver is not tested against our own reading of it. It is
no camera of a rig: it has no mirror and no trigger line, and its software trigger, polled, takes 40 ms.
"""

import ctypes
from collections.abc import Callable
from ctypes import c_char_p, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotConnected

LIBRARY = "libaravis-0.8.so.0"
CHANNELS = {0x0108_0001: 1, 0x0108_0009: 1, 0x0218_0014: 3}
"""Channels of Mono8, BayerRG8 and RGB8 by their codes (GenICam PFNC)."""
_FILL = ctypes.CFUNCTYPE(None, c_void_p, c_void_p, c_uint32, c_uint32, c_uint32)


@dataclass(frozen=True, slots=True, kw_only=True)
class AcquisitionRequest:
    """The settings with which the client requests an image; `channels` is 3 for RGB."""

    width: int
    height: int
    channels: int
    exposure_us: int
    gain: int


class GigeCamera:
    """One camera on a network interface, serving until closed; only one per address."""

    def __init__(
        self, *, interface: str, serial: str, picture: Callable[[AcquisitionRequest], NDArray[np.uint8]]
    ) -> None:
        self._picture = picture
        self._library = _load()
        self._camera: int | None = self._library.arv_gv_fake_camera_new(interface.encode(), serial.encode())
        if self._camera is None or not self._library.arv_gv_fake_camera_is_running(self._camera):
            self.close()
            raise NotConnected(
                f"GigE Vision camera {serial}: it cannot serve on {interface}; another one is there already,"
                " or this machine has no such interface: close that one, or give the address of an interface"
            )
        self.served: AcquisitionRequest | None = None
        """The request of the last image sent."""
        self._fill = _FILL(self._on_fill)  # the library keeps no reference to it
        inner = self._library.arv_gv_fake_camera_get_fake_camera(self._camera)
        self._library.arv_fake_camera_set_fill_pattern(inner, self._fill, None)

    def close(self) -> None:
        """Leave the network; no effect when closed."""
        camera, self._camera = self._camera, None
        if camera is not None:
            self._library.g_object_unref(camera)

    def __enter__(self) -> "GigeCamera":
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def _on_fill(self, buffer: int, _context: object, exposure_us: int, gain: int, pixel_format: int) -> None:
        request = AcquisitionRequest(
            width=self._library.arv_buffer_get_image_width(buffer),
            height=self._library.arv_buffer_get_image_height(buffer),
            channels=CHANNELS[pixel_format],
            exposure_us=exposure_us,
            gain=gain,
        )
        sent = np.ascontiguousarray(self._picture(request), dtype=np.uint8)
        expected = (request.height, request.width, 3)[: 3 if request.channels == 3 else 2]
        if sent.shape != expected:
            raise ValueError(f"a picture of {expected} was asked for, not of {sent.shape}")
        unused = c_size_t()
        data = self._library.arv_buffer_get_data(buffer, ctypes.byref(unused))
        ctypes.memmove(data, sent.ctypes.data, sent.nbytes)
        self.served = request


def _load() -> Any:  # noqa: ANN401 - a foreign library
    try:
        library = ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise NotConnected(
            f"a GigE Vision camera needs {LIBRARY}, and it is not installed here; Debian and Ubuntu: apt-get"
            " install libaravis-0.8-0"
        ) from error
    for name, result, arguments in (
        ("arv_gv_fake_camera_new", c_void_p, (c_char_p, c_char_p)),
        ("arv_gv_fake_camera_is_running", c_int, (c_void_p,)),
        ("arv_gv_fake_camera_get_fake_camera", c_void_p, (c_void_p,)),
        ("arv_fake_camera_set_fill_pattern", None, (c_void_p, _FILL, c_void_p)),
        ("arv_buffer_get_image_width", c_int, (c_void_p,)),
        ("arv_buffer_get_image_height", c_int, (c_void_p,)),
        ("arv_buffer_get_data", c_void_p, (c_void_p, ctypes.POINTER(c_size_t))),
        ("g_object_unref", None, (c_void_p,)),
    ):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
