"""A GigE Vision or USB3 Vision camera through libaravis, as a `CameraDevice`.

libaravis reports a lost camera only after seconds and blocks each call for 2.5 s until then. Detecting the
loss is therefore left to the watchdog, by missing frames; here calls only fail.
"""

import fcntl
import logging
import socket
import struct

from foveacam_hardware.contract import (
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    NotConnected,
)
from foveacam_hardware.drivers.cameras.aravis.clock import AravisClock
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary, interface_address, list_cameras
from foveacam_hardware.drivers.cameras.aravis.settings import AravisFeatures, AravisOptions
from foveacam_hardware.drivers.cameras.aravis.stream import AravisStream
from foveacam_hardware.drivers.cameras.device import ClockReading, FoundCamera, Grab

logger = logging.getLogger(__name__)

SIOCGIFADDR = 0x8915  # Linux: netdevice(7)
LONGEST_NAME = 15


class AravisDevice:
    """One camera, identified by its serial number; one thread makes every call."""

    def __init__(self, serial: str, *, clock: Clock, options: AravisOptions | None = None) -> None:
        self._serial = serial
        self._clock = clock
        self._options = options or AravisOptions()
        self._label = f"serial {serial}"
        self._library: AravisLibrary | None = None
        self._camera: int | None = None
        self._features: AravisFeatures | None = None
        self._stream: AravisStream | None = None
        self._settings: CameraSettings | None = None
        self._own_clock: AravisClock | None = None

    def open(self) -> DeviceInfo:
        """Find the camera by its serial number and take control of it; return its identity."""
        library = self._library = AravisLibrary()
        try:
            found = self._find(library)
            self._check_control()
            self._check_interface(library)
            features = self._features = AravisFeatures(library, self._handle, label=self._label)
            self._call("stop_acquisition")
            features.prepare(self._options)
            self._own_clock = AravisClock(features, clock=self._clock)
        except FoveaError:
            self.close()
            raise
        return found.info

    def close(self) -> None:
        """Release the camera."""
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.close()
        camera, self._camera = self._camera, None
        self._features = self._own_clock = None
        if camera is not None and self._library is not None:
            self._library.plain("g_object_unref")(camera)

    def ranges(self) -> CameraRanges:
        """Return the accepted values of every setting."""
        return self._open_features.ranges()

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return those in force."""
        self._settings = self._open_features.apply(settings, self._options)
        return self._settings

    def read_settings(self) -> CameraSettings:
        """Return the settings in force."""
        if self._settings is None:
            raise DeviceFault(f"{self._label}: it was not configured; configure it first")
        self._settings = self._open_features.read_back(self._settings)
        return self._settings

    def start(self) -> None:
        """Start acquisition."""
        if self._library is None or self._settings is None:
            raise DeviceFault(f"{self._label}: asked to start, but it was not configured; configure it first")
        self._stream = AravisStream(
            self._library,
            self._handle,
            pixel_format=self._settings.pixel_format,
            clock=self._clock,
            label=self._label,
        )
        self._call("start_acquisition")

    def stop(self) -> None:
        """Stop acquisition."""
        stream, self._stream = self._stream, None
        try:
            self._call("stop_acquisition")
        finally:
            if stream is not None:
                stream.close()

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none arrived in time."""
        if self._stream is None:
            raise DeviceFault(f"{self._label}: asked for a frame, but it is stopped; start it first")
        return self._stream.grab(timeout_ms=timeout_ms)

    def software_trigger(self) -> None:
        """Trigger one exposure."""
        self._call("software_trigger")

    def alive(self) -> bool:
        """Return whether a register can be read and this process still controls the camera."""
        try:
            self._call("get_exposure_time")
        except FoveaError as error:
            logger.debug("%s", error)
            return False
        return self._has_control()

    def underruns(self) -> int:
        """Return the number of frames since `start` for which no buffer was free."""
        return 0 if self._stream is None else self._stream.underruns()

    def read_clock(self) -> ClockReading | None:
        """Latch and read the camera's clock; None when it has no readable one."""
        return None if self._own_clock is None else self._own_clock.read()

    # Search -----------------------------------------------------------------------------------------------

    def _find(self, library: AravisLibrary) -> FoundCamera:
        """Open the camera with this serial number, from the known device list first, then after a search."""
        for searched in (False, True):
            if searched:
                library.plain("arv_update_device_list")()
            for name, found in list_cameras(library):
                if found.info.serial == self._serial and self._open_camera(library, name, last=searched):
                    return found
        others = ", ".join(sorted(found.info.serial for _, found in list_cameras(library))) or "none"
        raise NotConnected(
            f"{self._label} is not found (cameras that answer: {others}); plug it in, or correct the serial"
        )

    def _open_camera(self, library: AravisLibrary, name: str, *, last: bool) -> bool:
        try:
            self._camera = library.call("arv_camera_new", name.encode(), label=self._label)
        except NotConnected:
            if last:
                raise
        return self._camera is not None

    def _check_interface(self, library: AravisLibrary) -> None:
        """Raise `NotConnected` for a camera reached through another interface than the rig file names."""
        wanted = self._options.interface
        if wanted is None or not library.plain("arv_camera_is_gv_device")(self._handle):
            return
        found = interface_address(library, self._handle)
        if found not in (wanted, address_of(wanted)):
            raise NotConnected(
                f"{self._label} is to be reached through {wanted}, but it was found through {found}; connect"
                " it there, or correct the interface in the rig file"
            )

    def _check_control(self) -> None:
        if not self._has_control():
            raise NotConnected(
                f"{self._label} is held by another program, which has exclusive access; close that program"
            )

    def _has_control(self) -> bool:
        library = self._library
        if library is None or not library.plain("arv_camera_is_gv_device")(self._handle):
            return True
        device = library.plain("arv_camera_get_device")(self._handle)
        return bool(library.plain("arv_gv_device_is_controller")(device))

    # Library calls ----------------------------------------------------------------------------------------

    @property
    def _handle(self) -> int:
        if self._camera is None:
            raise NotConnected(f"{self._label} is not open; connect it")
        return self._camera

    @property
    def _open_features(self) -> AravisFeatures:
        if self._features is None:
            raise NotConnected(f"{self._label} is not open; connect it")
        return self._features

    def _call(self, name: str) -> object:
        return self._open_features.call(name)


def address_of(name: str) -> str | None:
    """Return the IPv4 address of a network interface; None when it does not exist or has none."""
    request = struct.pack("256s", name.encode()[:LONGEST_NAME])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, request)
        except OSError:
            return None
    return socket.inet_ntoa(answer[20:24])
