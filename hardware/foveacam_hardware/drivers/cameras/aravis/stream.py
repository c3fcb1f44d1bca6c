"""The buffer stream of libaravis: full buffers are copied once and returned to the library at once.

Also enlarges the receive buffer of the library's UDP socket, which it does not expose.
"""

import ctypes
import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_size_t, c_uint64
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Image, PixelFormat
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.pixel_layout import BITS, PACKED, picture_of

logger = logging.getLogger(__name__)

SO_RCVBUFFORCE = 33  # Linux: socket(7); Python's module does not name it
OPEN_FILES = Path("/dev/fd")

BUFFERS = 10
FIXED = 0
RECEIVE_BYTES = 16 << 20
"""Receive buffer of a GigE camera's socket: about ten frames, while its thread waits for a processor."""
SUCCESS, ABORTED = 0, 7


class AravisStream:
    """The stream of one acquisition; `close` stops receiving and frees the buffers."""

    def __init__(
        self, library: AravisLibrary, camera: int, *, pixel_format: PixelFormat, clock: Clock, label: str
    ) -> None:
        self._library = library
        self._clock = clock
        self._format = pixel_format
        self._pop = library.plain("arv_stream_timeout_pop_buffer")
        self._push = library.plain("arv_stream_push_buffer")
        payload = library.call("arv_camera_get_payload", camera, label=label)
        self._stream = library.call("arv_camera_create_stream", camera, None, None, label=label)
        if library.plain("arv_camera_is_gv_device")(camera):
            untouched = (b"socket-buffer", FIXED, b"socket-buffer-size", 0)
            library.plain("g_object_set")(self._stream, *untouched, None)
            enlarge_receive_buffer(
                library.plain("arv_gv_stream_get_port")(self._stream), size_bytes=RECEIVE_BYTES
            )
        for _ in range(BUFFERS):
            self._push(self._stream, library.plain("arv_buffer_new_allocate")(payload))

    def close(self) -> None:
        """Stop receiving."""
        stream, self._stream = self._stream, None
        if stream is not None:
            self._library.plain("g_object_unref")(stream)

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none arrived in time."""
        buffer = self._pop(self._stream, max(0, round(timeout_ms * 1e3)))
        if buffer is None:
            return None
        t_host_ns = self._clock.now_ns()
        plain = self._library.plain
        status = plain("arv_buffer_get_status")(buffer)
        good = status == SUCCESS
        grab = Grab(
            status=GrabStatus.OK if good else GrabStatus.INCOMPLETE,
            image=self._image(buffer) if good else None,
            bits=BITS[self._format],
            number=plain("arv_buffer_get_frame_id")(buffer),
            t_device_ns=plain("arv_buffer_get_timestamp")(buffer) or None,
            t_host_ns=t_host_ns,
        )
        self._push(self._stream, buffer)
        return None if status == ABORTED else grab

    def underruns(self) -> int:
        """Return the number of frames for which no buffer was free."""
        completed, failures, underruns = c_uint64(), c_uint64(), c_uint64()
        self._library.plain("arv_stream_get_statistics")(
            self._stream, byref(completed), byref(failures), byref(underruns)
        )
        return underruns.value

    def _image(self, buffer: int) -> Image | None:
        plain = self._library.plain
        size = c_size_t()
        address = plain("arv_buffer_get_data")(buffer, byref(size))
        width, height = (
            plain("arv_buffer_get_image_width")(buffer),
            plain("arv_buffer_get_image_height")(buffer),
        )
        if address is None or width <= 0 or height <= 0:
            return None
        raw = np.frombuffer(memoryview((ctypes.c_uint8 * size.value).from_address(address)), dtype=np.uint8)
        pixels = _shaped(raw, self._format, height=height, width=width)
        return None if pixels is None else picture_of(pixels, self._format, height=height, width=width)


def _shaped(raw: NDArray[np.uint8], pixel_format: PixelFormat, *, height: int, width: int) -> Image | None:
    """Return the bytes as an array of pixels; None when there are too few."""
    if pixel_format in PACKED:
        return raw if raw.size >= (12 * height * width + 7) // 8 else None
    deep = pixel_format is PixelFormat.MONO12
    shape = (height, width, 3) if pixel_format is PixelFormat.RGB8 else (height, width)
    needed = height * width * (2 if deep else 1) * (3 if len(shape) == 3 else 1)
    if raw.size < needed:
        return None
    pixels = raw[:needed]
    return (pixels.view(np.uint16) if deep else pixels).reshape(shape)


def enlarge_receive_buffer(port: int, *, size_bytes: int) -> int:
    """Enlarge the receive buffer of this process's socket at a local UDP port; return its size, 0 if none.

    Sizes beyond `net.core.rmem_max` need CAP_NET_ADMIN; without it the size is limited to that.
    """
    for entry in OPEN_FILES.iterdir():
        with _udp_socket(int(entry.name)) as found:
            if found is not None and found.getsockname()[1] == port:
                return _enlarge(found, size_bytes)
    logger.warning("no socket at UDP port %d: its receive buffer stays as it is", port)
    return 0


def _enlarge(found: socket.socket, size_bytes: int) -> int:
    try:
        found.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, size_bytes)
    except OSError:  # without the right, or on another system
        found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size_bytes)
    return (
        found.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2
    )  # Linux reports twice the size, including its own overhead


@contextmanager
def _udp_socket(number: int) -> Iterator[socket.socket | None]:
    """Yield a duplicate of an IPv4 UDP socket of this process; None when the descriptor is something else."""
    try:
        duplicate = os.dup(number)
    except OSError:  # closed meanwhile
        yield None
        return
    try:
        found = socket.socket(fileno=duplicate)
    except OSError:
        os.close(duplicate)
        yield None
        return
    with found:
        plain = found.family == socket.AF_INET and found.type == socket.SOCK_DGRAM
        yield found if plain else None
