"""Basler cameras, by the vendor's library (the extra `pylon`), behind the seam `CameraDevice`.

Once a camera was removed, the library may go on handing out frames, so it is asked now and then. With a bad
cable it says so late or never: the watchdog above judges silence by itself.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
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
from foveacam_hardware.drivers.cameras.pylon.settings import (
    PylonOptions,
    check,
    ranges_of,
    read_back,
    settle_in,
    write,
)

logger = logging.getLogger(__name__)

READY_TIMEOUT_MS = 500
REMOVED_PERIOD_NS = 200_000_000
"""How often the library is asked whether the camera was removed, while it streams."""
LATCHES = (("TimestampLatch", "TimestampLatchValue"), ("GevTimestampControlLatch", "GevTimestampValue"))
"""The command and the value: of USB3 Vision cameras and newer ones, of older GigE Vision cameras."""


class PylonClock:
    """The clock of one open camera; `tick_ns`: what it counts in."""

    def __init__(self, map_: nodes.Nodes, *, clock: Clock, tick_ns: float) -> None:
        self._map = map_
        self._clock = clock
        self._tick_ns = tick_ns
        self._latch = next((latch for latch in LATCHES if _has(map_, latch)), None)

    def read(self) -> ClockReading | None:
        """Take the time and read it; None when the camera keeps none that can be read, or it stands at 0."""
        if self._latch is None:
            return None
        command, value = self._latch
        t_before_ns = self._clock.now_ns()
        self._map.GetNode(command).Execute()
        t_after_ns = self._clock.now_ns()
        told = self._map.GetNode(value)
        told.Node.InvalidateNode()  # the library remembers the time before
        ticks = int(told.GetValue())
        if ticks == 0:
            return None
        t_device_ns = round(ticks * self._tick_ns)
        return ClockReading(t_device_ns=t_device_ns, t_before_ns=t_before_ns, t_after_ns=t_after_ns)


def _has(map_: nodes.Nodes, latch: tuple[str, str]) -> bool:
    command, value = latch
    return nodes.can_execute(map_, command) and nodes.find(map_, (value,)) is not None


class PylonDevice:
    """One Basler camera, found by its serial number; one thread makes every call."""

    def __init__(self, serial: str, *, clock: Clock, options: PylonOptions | None = None) -> None:
        self._serial = serial
        self._clock = clock
        self._options = options or PylonOptions()
        self._who = f"pylon camera {serial}"
        self._pylon: nodes.Vendor = None
        self._camera: nodes.Vendor = None
        self._taken: CameraSettings | None = None
        self._format = PixelFormat.MONO8
        self._tick_ns = 1.0
        self._own_clock: PylonClock | None = None
        self._period_ns = 0
        self._triggered_ns = 0
        self._asked_ns = 0

    def open(self) -> DeviceInfo:
        """Find it by its serial number, take it, stop whatever it does; return who it is."""
        self.close()
        pylon = load_library()
        with self._vendor("open it"):
            found = find_serial(pylon, self._serial)
            camera = pylon.InstantCamera()
            try:
                camera.Attach(pylon.TlFactory.GetInstance().CreateDevice(found))
                camera.Open()
                camera.MaxNumBuffer.SetValue(self._options.buffers)
            except Exception as error:  # noqa: BLE001 - whatever fails, what was attached is let go
                camera.DestroyDevice()
                self._refuse_opening(error)
        self._pylon, self._camera = pylon, camera
        try:
            return self._settle_in()
        except FoveaError:
            self.close()
            raise

    def close(self) -> None:
        """Release it; harmless when closed or gone."""
        camera, self._camera = self._camera, None
        self._own_clock = self._taken = None
        if camera is None:
            return
        for release in (camera.StopGrabbing, camera.Close, camera.DestroyDevice):
            try:
                release()
            except Exception as error:  # noqa: BLE001 - the vendor's root error is known only once loaded
                logger.debug("%s: closing: %s", self._who, error)

    def ranges(self) -> CameraRanges:
        """Return what it accepts."""
        with self._vendor("read its ranges"):
            return ranges_of(self._map)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply the settings while stopped; return what it took, read back from it."""
        with self._vendor("configure it"):
            check(self._map, settings, who=self._who)
            write(self._map, settings, self._options, who=self._who)
            taken = read_back(self._map, settings, who=self._who)
        return self._runs_with(taken)

    def read_settings(self) -> CameraSettings:
        """Return what is in force, past the library's memory of it."""
        if self._taken is None:
            raise DeviceFault(f"{self._who}: it was not configured; configure it first")
        with self._vendor("read its settings"):
            self._map.InvalidateNodes()
            return self._runs_with(read_back(self._map, self._taken, who=self._who))

    def start(self) -> None:
        """Begin to acquire; a camera that waits for triggers is ready for the first one."""
        with self._vendor("start it"):
            self._opened().StartGrabbing(self._pylon.GrabStrategy_OneByOne)
            self._triggered_ns = self._clock.now_ns()

    def stop(self) -> None:
        """Stop acquiring; buffers not yet grabbed are gone."""
        with self._vendor("stop it"):
            self._opened().StopGrabbing()

    def grab(self, *, timeout_ms: float) -> Grab | None:
        """Return the next buffer, or None when none came in time."""
        with self._vendor("read a frame"):
            camera = self._opened()
            self._refuse_removed_now_and_then(camera)
            result = camera.RetrieveResult(max(0, round(timeout_ms)), self._pylon.TimeoutHandling_Return)
            t_host_ns = self._clock.now_ns()
            if not result.IsValid():
                return None
            try:
                return self._taken_out(result, t_host_ns)
            finally:
                result.Release()

    def _refuse_removed_now_and_then(self, camera: nodes.Vendor) -> None:
        """Ask the library whether the camera was removed; not for every frame, as it takes milliseconds."""
        now_ns = self._clock.now_ns()
        if now_ns - self._asked_ns >= REMOVED_PERIOD_NS:
            self._asked_ns = now_ns
            if camera.IsCameraDeviceRemoved():
                self._refuse_removed()

    def software_trigger(self) -> None:
        """Expose once; soon after the one before, once the camera is ready."""
        with self._vendor("trigger it"):
            camera = self._opened()
            if self._clock.now_ns() - self._triggered_ns < self._period_ns:
                camera.WaitForFrameTriggerReady(READY_TIMEOUT_MS, self._pylon.TimeoutHandling_Return)
            camera.TriggerSoftware.Execute()
            self._triggered_ns = self._clock.now_ns()

    def alive(self) -> bool:
        """Return whether it still answers: a register is read, past the library's memory of it."""
        try:
            with self._vendor("ask whether it is there"):
                camera = self._opened()
                if camera.IsCameraDeviceRemoved():
                    return False
                camera.Height.Node.InvalidateNode()
                camera.Height.GetValue()
        except FoveaError as error:
            logger.debug("%s: %s", self._who, error)
            return False
        return True

    def underruns(self) -> int:
        """Return how many frames found no buffer since `start`."""
        with self._vendor("read its statistics"):
            statistics = self._opened().GetStreamGrabberNodeMap()
            lost = nodes.read_number(statistics, ("Statistic_Buffer_Underrun_Count",))
            return round(lost + nodes.read_number(statistics, ("Statistic_Missed_Frame_Count",)))

    def read_clock(self) -> ClockReading | None:
        """Latch the camera's clock and read it; None where it has none."""
        if self._own_clock is None:
            return None
        with self._vendor("read its clock"):
            return self._own_clock.read()

    # What the vendor's library is asked ------------------------------------------------------------------

    @property
    def _map(self) -> nodes.Nodes:
        return self._opened().GetNodeMap()

    def _opened(self) -> nodes.Vendor:
        if self._camera is None:
            raise NotConnected(f"{self._who}: it is not open; connect it first")
        return self._camera

    def _runs_with(self, taken: CameraSettings) -> CameraSettings:
        self._taken = taken
        self._format = taken.pixel_format
        self._period_ns = round(1e9 / taken.frame_rate_hz) + taken.exposure_ns
        return taken

    def _settle_in(self) -> DeviceInfo:
        """Bring the camera into a known state after it was opened."""
        with self._vendor("set it up"):
            map_ = self._map
            settle_in(map_, self._options, who=self._who)
            ticks_hz = nodes.read_number(map_, nodes.TICKS_HZ)
            self._tick_ns = 1e9 / ticks_hz if ticks_hz > 0 else 1.0
            self._own_clock = PylonClock(map_, clock=self._clock, tick_ns=self._tick_ns)
            who = self._opened().GetDeviceInfo()
            version = map_.GetNode("DeviceFirmwareVersion") or map_.GetNode("DeviceVersion")
            return DeviceInfo(
                vendor="Basler",
                model=str(who.GetModelName()),
                serial=str(who.GetSerialNumber()),
                version="" if version is None else str(version.GetValue()),
            )

    def _taken_out(self, result: nodes.Vendor, t_host_ns: int) -> Grab:
        height, width = int(result.Height), int(result.Width)
        whole = result.GrabSucceeded() and height > 0 and width > 0  # an unplugged camera may give no rows
        image = None
        if whole:
            image = self._picture(result, height=height, width=width)
        ticks = int(result.TimeStamp)
        return Grab(
            status=GrabStatus.OK if whole else GrabStatus.INCOMPLETE,
            image=image,
            bits=BITS[self._format],
            number=int(result.BlockID),
            t_device_ns=round(ticks * self._tick_ns) if ticks else None,
            t_host_ns=t_host_ns,
        )

    def _picture(self, result: nodes.Vendor, *, height: int, width: int) -> Image:
        if self._format in PACKED:
            packed = np.frombuffer(result.GetBuffer(), dtype=np.uint8)
            return picture_of(packed, self._format, height=height, width=width)
        with result.GetArrayZeroCopy() as sent:
            return picture_of(sent, self._format, height=height, width=width)

    # What went wrong, in words ---------------------------------------------------------------------------

    @contextmanager
    def _vendor(self, asked: str) -> Iterator[None]:
        """Turn the library's errors into the contract's."""
        try:
            yield
        except FoveaError:
            raise
        except Exception as error:
            if not _is_vendors(error):
                raise
            if self._camera is not None and self._camera.IsCameraDeviceRemoved():
                self._refuse_removed()
            raise DeviceFault(
                f"{self._who}: asked to {asked}, and its library answered: {_first_line(error)}; reconnect it"
            ) from error

    def _refuse_removed(self) -> NoReturn:
        raise NotConnected(f"{self._who}: it is gone from the bus; plug it in, it is opened again by itself")

    def _refuse_opening(self, error: Exception) -> NoReturn:
        if not _is_vendors(error):
            raise error
        raise NotConnected(
            f"{self._who}: it is there and cannot be opened ({_first_line(error)}); close the program that"
            " holds it, and check the permissions of its device"
        ) from error


def _is_vendors(error: Exception) -> bool:
    """Tell whether the vendor's library raised it: its root error, known without importing it."""
    return any(kind.__name__ == "GenericException" for kind in type(error).__mro__)


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0].split(" : ")[0].rstrip(". ") if str(error) else type(error).__name__
