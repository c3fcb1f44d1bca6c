"""GigE Vision and USB3 Vision cameras, by the system's libaravis, behind the seam `CameraDevice`.

libaravis says that control was lost only after seconds, and blocks 2.5 s in every call until then: what is
lost is decided above, by missing frames; here calls only fail.
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
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary, interface_address, listed
from foveacam_hardware.drivers.cameras.aravis.settings import AravisFeatures, AravisOptions
from foveacam_hardware.drivers.cameras.aravis.stream import AravisStream
from foveacam_hardware.drivers.cameras.device import ClockReading, FoundCamera, Grab

logger = logging.getLogger(__name__)

SIOCGIFADDR = 0x8915  # Linux: netdevice(7)
LONGEST_NAME = 15


class AravisDevice:
    """One camera, found by its serial number; one thread makes every call."""

    def __init__(self, serial: str, *, clock: Clock, options: AravisOptions | None = None) -> None:
        self._serial = serial
        self._clock = clock
        self._options = options or AravisOptions()
        self._who = f"serial {serial}"
        self._library: AravisLibrary | None = None
        self._camera: int | None = None
        self._features: AravisFeatures | None = None
        self._stream: AravisStream | None = None
        self._taken: CameraSettings | None = None
        self._own_clock: AravisClock | None = None

    def open(self) -> DeviceInfo:
        """Find it by its serial number and take control of it; return who it is."""
        library = self._library = AravisLibrary()
        try:
            found = self._find(library)
            self._check_control()
            self._check_interface(library)
            features = self._features = AravisFeatures(library, self._handle, who=self._who)
            self._call("stop_acquisition")
            features.prepare(self._options)
            self._own_clock = AravisClock(features, clock=self._clock)
        except FoveaError:
            self.close()
            raise
        return found.info

    def close(self) -> None:
        """Release it."""
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.close()
        camera, self._camera = self._camera, None
        self._features = self._own_clock = None
        if camera is not None and self._library is not None:
            self._library.plain("g_object_unref")(camera)

    def ranges(self) -> CameraRanges:
        """Return what it accepts."""
        return self._open_features.ranges()

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return what it took."""
        self._taken = self._open_features.apply(settings, self._options)
        return self._taken

    def read_settings(self) -> CameraSettings:
        """Return what is in force."""
        if self._taken is None:
            raise DeviceFault(f"{self._who}: it was not configured; configure it first")
        self._taken = self._open_features.read_back(self._taken)
        return self._taken

    def start(self) -> None:
        """Begin to acquire."""
        if self._library is None or self._taken is None:
            raise DeviceFault(f"{self._who}: asked to start, but it was not configured; configure it first")
        self._stream = AravisStream(
            self._library,
            self._handle,
            pixel_format=self._taken.pixel_format,
            clock=self._clock,
            who=self._who,
        )
        self._call("start_acquisition")

    def stop(self) -> None:
        """Stop acquiring."""
        stream, self._stream = self._stream, None
        try:
            self._call("stop_acquisition")
        finally:
            if stream is not None:
                stream.close()

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none came in time."""
        if self._stream is None:
            raise DeviceFault(f"{self._who}: asked for a frame, but it is stopped; start it first")
        return self._stream.grab(timeout_ms=timeout_ms)

    def software_trigger(self) -> None:
        """Expose once."""
        self._call("software_trigger")

    def alive(self) -> bool:
        """Read a register, and ask whether the camera is still ours."""
        try:
            self._call("get_exposure_time")
        except FoveaError as error:
            logger.debug("%s", error)
            return False
        return self._is_ours()

    def underruns(self) -> int:
        """Return how many frames found no buffer since `start`."""
        return 0 if self._stream is None else self._stream.underruns()

    def read_clock(self) -> ClockReading | None:
        """Latch the camera's clock and read it; None where it has no such register."""
        return None if self._own_clock is None else self._own_clock.read()

    # Finding ----------------------------------------------------------------------------------------------

    def _find(self, library: AravisLibrary) -> FoundCamera:
        """Open the camera of this serial number: where it was last seen, else wherever it is now."""
        for looked in (False, True):
            if looked:
                library.plain("arv_update_device_list")()
            for name, found in listed(library):
                if found.info.serial == self._serial and self._take(library, name, last=looked):
                    return found
        others = ", ".join(sorted(found.info.serial for _, found in listed(library))) or "none"
        raise NotConnected(
            f"{self._who} is not found (cameras that answer: {others}); plug it in, or correct the serial"
        )

    def _take(self, library: AravisLibrary, name: str, *, last: bool) -> bool:
        try:
            self._camera = library.call("arv_camera_new", name.encode(), who=self._who)
        except NotConnected:
            if last:
                raise
        return self._camera is not None

    def _check_interface(self, library: AravisLibrary) -> None:
        """Refuse a camera that is reached through another network interface than the rig file says."""
        wanted = self._options.interface
        if wanted is None or not library.plain("arv_camera_is_gv_device")(self._handle):
            return
        found = interface_address(library, self._handle)
        if found not in (wanted, address_of(wanted)):
            raise NotConnected(
                f"{self._who} is to be reached through {wanted}, but it was found through {found}; connect it"
                " there, or correct the interface in the rig file"
            )

    def _check_control(self) -> None:
        if not self._is_ours():
            raise NotConnected(
                f"{self._who} is held by another program, which may look at it alone; close that program"
            )

    def _is_ours(self) -> bool:
        library = self._library
        if library is None or not library.plain("arv_camera_is_gv_device")(self._handle):
            return True
        device = library.plain("arv_camera_get_device")(self._handle)
        return bool(library.plain("arv_gv_device_is_controller")(device))

    # The library ------------------------------------------------------------------------------------------

    @property
    def _handle(self) -> int:
        if self._camera is None:
            raise NotConnected(f"{self._who} is not open; connect it")
        return self._camera

    @property
    def _open_features(self) -> AravisFeatures:
        if self._features is None:
            raise NotConnected(f"{self._who} is not open; connect it")
        return self._features

    def _call(self, name: str) -> object:
        return self._open_features.call(name)


def address_of(name: str) -> str | None:
    """Return the IPv4 address of an interface, or None when there is no such interface or it has none."""
    request = struct.pack("256s", name.encode()[:LONGEST_NAME])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, request)
        except OSError:
            return None
    return socket.inet_ntoa(answer[20:24])
