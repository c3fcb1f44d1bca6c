"""A Basler camera through the vendor's pylon library (the extra `pylon`), as a `CameraDevice`.

After a camera was removed the library may keep delivering frames, so removal is polled. A bad cable is
reported late or never; the watchdog detects that by missing frames.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import NoReturn

import numpy as np

from foveacam_hardware.contract import (
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    FoveaError,
    Image,
    NotConnected,
    PixelFormat,
)
from foveacam_hardware.drivers.cameras.device import ClockReading, Grab, GrabStatus
from foveacam_hardware.drivers.cameras.pixel_layout import BITS, PACKED, picture_of
from foveacam_hardware.drivers.cameras.pylon import nodes
from foveacam_hardware.drivers.cameras.pylon.library import find_serial, load_library
from foveacam_hardware.drivers.cameras.pylon.region import apply_binning
from foveacam_hardware.drivers.cameras.pylon.settings import (
    PylonOptions,
    check_settings,
    initialise_camera,
    ranges_of,
    read_back,
    write_settings,
)

logger = logging.getLogger(__name__)

READY_TIMEOUT_MS = 500
REMOVED_PERIOD_NS = 200_000_000
"""Period of asking the library whether the camera was removed, while it streams."""
LATCHES = (("TimestampLatch", "TimestampLatchValue"), ("GevTimestampControlLatch", "GevTimestampValue"))
"""Latch command and latched value: of USB3 Vision and newer cameras, and of older GigE Vision cameras."""


class PylonClock:
    """The clock of one open camera, read in nanoseconds; `tick_ns`: its unit."""

    def __init__(self, map_: nodes.Nodes, *, clock: Clock, tick_ns: float) -> None:
        self._map = map_
        self._clock = clock
        self._tick_ns = tick_ns
        self._latch = next((latch for latch in LATCHES if _has_latch(map_, latch)), None)

    def read(self) -> ClockReading | None:
        """Latch the clock and read it; None when the camera has no readable clock or it is at 0."""
        if self._latch is None:
            return None
        command, value = self._latch
        t_before_ns = self._clock.now_ns()
        self._map.GetNode(command).Execute()
        t_after_ns = self._clock.now_ns()
        latched = self._map.GetNode(value)
        latched.Node.InvalidateNode()  # the library caches the previous value
        ticks = int(latched.GetValue())
        if ticks == 0:
            return None
        t_device_ns = round(ticks * self._tick_ns)
        return ClockReading(t_device_ns=t_device_ns, t_before_ns=t_before_ns, t_after_ns=t_after_ns)


def _has_latch(map_: nodes.Nodes, latch: tuple[str, str]) -> bool:
    command, value = latch
    return nodes.can_execute(map_, command) and nodes.find(map_, (value,)) is not None


class PylonDevice:
    """One Basler camera, identified by its serial number; one thread makes every call."""

    def __init__(self, serial: str, *, clock: Clock, options: PylonOptions | None = None) -> None:
        self._serial = serial
        self._clock = clock
        self._options = options or PylonOptions()
        self._label = f"pylon camera {serial}"
        self._pylon: nodes.Vendor = None
        self._camera: nodes.Vendor = None
        self._settings: CameraSettings | None = None
        self._format = PixelFormat.MONO8
        self._tick_ns = 1.0
        self._own_clock: PylonClock | None = None
        self._period_ns = 0
        self._triggered_ns = 0
        self._asked_ns = 0

    def open(self) -> DeviceInfo:
        """Find the camera by its serial number, open it exclusively and stop it; return its identity."""
        self.close()
        pylon = load_library()
        with self._translate_errors("open it"):
            found = find_serial(pylon, self._serial)
            camera = pylon.InstantCamera()
            try:
                camera.Attach(pylon.TlFactory.GetInstance().CreateDevice(found))
                camera.Open()
                camera.MaxNumBuffer.SetValue(self._options.buffers)
            except Exception as error:  # noqa: BLE001 - whatever fails, the attached device is released
                camera.DestroyDevice()
                self._refuse_opening(error)
        self._pylon, self._camera = pylon, camera
        try:
            return self._initialise()
        except FoveaError:
            self.close()
            raise

    def close(self) -> None:
        """Release the camera; do nothing when it is closed or gone."""
        camera, self._camera = self._camera, None
        self._own_clock = self._settings = None
        if camera is None:
            return
        for release in (camera.StopGrabbing, camera.Close, camera.DestroyDevice):
            try:
                release()
            except Exception as error:  # noqa: BLE001 - the vendor's root error is known only once loaded
                logger.debug("%s: closing: %s", self._label, error)

    def ranges(self) -> CameraRanges:
        """Return the accepted values of every setting."""
        with self._translate_errors("read its ranges"):
            return ranges_of(self._map)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return those in force, read back from the camera."""
        with self._translate_errors("configure it"):
            check_settings(self._map, settings, label=self._label)
            write_settings(self._map, settings, self._options, label=self._label)
            own_binning = apply_binning(self._map, settings, self._options, label=self._label)
            taken = read_back(self._map, replace(settings, binning=own_binning), label=self._label)
        return self._remember(taken)

    def read_settings(self) -> CameraSettings:
        """Return the settings in force, bypassing the library's cache."""
        if self._settings is None:
            raise DeviceFault(f"{self._label}: it was not configured; configure it first")
        with self._translate_errors("read its settings"):
            self._map.InvalidateNodes()
            return self._remember(read_back(self._map, self._settings, label=self._label))

    def start(self) -> None:
        """Start acquisition; a triggered camera is then ready for its first trigger."""
        with self._translate_errors("start it"):
            self._open_camera().StartGrabbing(self._pylon.GrabStrategy_OneByOne)
            self._triggered_ns = self._clock.now_ns()

    def stop(self) -> None:
        """Stop acquisition; buffers not yet grabbed are lost."""
        with self._translate_errors("stop it"):
            self._open_camera().StopGrabbing()

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none arrived in time."""
        with self._translate_errors("read a frame"):
            camera = self._open_camera()
            self._poll_removal(camera)
            result = camera.RetrieveResult(max(0, round(timeout_ms)), self._pylon.TimeoutHandling_Return)
            t_host_ns = self._clock.now_ns()
            if not result.IsValid():
                return None
            try:
                return self._copy_grab(result, t_host_ns)
            finally:
                result.Release()

    def _poll_removal(self, camera: nodes.Vendor) -> None:
        """Check periodically whether the camera was removed; the check takes milliseconds."""
        now_ns = self._clock.now_ns()
        if now_ns - self._asked_ns >= REMOVED_PERIOD_NS:
            self._asked_ns = now_ns
            if camera.IsCameraDeviceRemoved():
                self._refuse_removed()

    def software_trigger(self) -> None:
        """Trigger one exposure; shortly after the previous one, wait until the camera is ready."""
        with self._translate_errors("trigger it"):
            camera = self._open_camera()
            if self._clock.now_ns() - self._triggered_ns < self._period_ns:
                camera.WaitForFrameTriggerReady(READY_TIMEOUT_MS, self._pylon.TimeoutHandling_Return)
            camera.TriggerSoftware.Execute()
            self._triggered_ns = self._clock.now_ns()

    def alive(self) -> bool:
        """Return whether the camera answers a register read that bypasses the library's cache."""
        try:
            with self._translate_errors("ask whether it is there"):
                camera = self._open_camera()
                if camera.IsCameraDeviceRemoved():
                    return False
                camera.Height.Node.InvalidateNode()
                camera.Height.GetValue()
        except FoveaError as error:
            logger.debug("%s: %s", self._label, error)
            return False
        return True

    def underruns(self) -> int:
        """Return the number of frames since `start` for which no buffer was free."""
        with self._translate_errors("read its statistics"):
            statistics = self._open_camera().GetStreamGrabberNodeMap()
            lost = nodes.read_number(statistics, ("Statistic_Buffer_Underrun_Count",))
            return round(lost + nodes.read_number(statistics, ("Statistic_Missed_Frame_Count",)))

    def read_clock(self) -> ClockReading | None:
        """Latch and read the camera's clock; None when it has no readable one."""
        if self._own_clock is None:
            return None
        with self._translate_errors("read its clock"):
            return self._own_clock.read()

    # Library calls ---------------------------------------------------------------------------------------

    @property
    def _map(self) -> nodes.Nodes:
        return self._open_camera().GetNodeMap()

    def _open_camera(self) -> nodes.Vendor:
        if self._camera is None:
            raise NotConnected(f"{self._label}: it is not open; connect it first")
        return self._camera

    def _remember(self, taken: CameraSettings) -> CameraSettings:
        self._settings = taken
        self._format = taken.pixel_format
        self._period_ns = round(1e9 / taken.frame_rate_hz) + taken.exposure_ns
        return taken

    def _initialise(self) -> DeviceInfo:
        """Bring the opened camera into a known state; return its identity."""
        with self._translate_errors("set it up"):
            map_ = self._map
            initialise_camera(map_, self._options, label=self._label)
            ticks_hz = nodes.read_number(map_, nodes.TICKS_HZ)
            self._tick_ns = 1e9 / ticks_hz if ticks_hz > 0 else 1.0
            self._own_clock = PylonClock(map_, clock=self._clock, tick_ns=self._tick_ns)
            found = self._open_camera().GetDeviceInfo()
            version = map_.GetNode("DeviceFirmwareVersion") or map_.GetNode("DeviceVersion")
            return DeviceInfo(
                vendor="Basler",
                model=str(found.GetModelName()),
                serial=str(found.GetSerialNumber()),
                version="" if version is None else str(version.GetValue()),
            )

    def _copy_grab(self, result: nodes.Vendor, t_host_ns: int) -> Grab:
        height, width = int(result.Height), int(result.Width)
        complete = (
            result.GrabSucceeded() and height > 0 and width > 0
        )  # an unplugged camera may deliver zero rows
        image = None
        if complete:
            image = self._image(result, height=height, width=width)
        ticks = int(result.TimeStamp)
        return Grab(
            status=GrabStatus.OK if complete else GrabStatus.INCOMPLETE,
            image=image,
            bits=BITS[self._format],
            number=int(result.BlockID),
            t_device_ns=round(ticks * self._tick_ns) if ticks else None,
            t_host_ns=t_host_ns,
        )

    def _image(self, result: nodes.Vendor, *, height: int, width: int) -> Image:
        if self._format in PACKED:
            packed = np.frombuffer(result.GetBuffer(), dtype=np.uint8)
            return picture_of(packed, self._format, height=height, width=width)
        with result.GetArrayZeroCopy() as sent:
            return picture_of(sent, self._format, height=height, width=width)

    # Errors ----------------------------------------------------------------------------------------------

    @contextmanager
    def _translate_errors(self, asked: str) -> Iterator[None]:
        """Translate the library's errors into the contract's."""
        try:
            yield
        except FoveaError:
            raise
        except Exception as error:
            if not _is_vendor_error(error):
                raise
            if self._camera is not None and self._camera.IsCameraDeviceRemoved():
                self._refuse_removed()
            raise DeviceFault(
                f"{self._label}: asked to {asked}, and its library answered: {_first_line(error)}; reconnect"
                " it"
            ) from error

    def _refuse_removed(self) -> NoReturn:
        raise NotConnected(
            f"{self._label}: it is gone from the bus; plug it in, it is opened again by itself"
        )

    def _refuse_opening(self, error: Exception) -> NoReturn:
        if not _is_vendor_error(error):
            raise error
        raise NotConnected(
            f"{self._label}: it is there and cannot be opened ({_first_line(error)}); close the program that"
            " holds it, and check the permissions of its device"
        ) from error


def _is_vendor_error(error: Exception) -> bool:
    """Return whether the vendor's library raised an error, by the name of its root class."""
    return any(kind.__name__ == "GenericException" for kind in type(error).__mro__)


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0].split(" : ")[0].rstrip(". ") if str(error) else type(error).__name__
