"""The mirrors' controller between looks: asked several times a second whether it lives, its rail as wanted.

Called by the hardware thread, but for `rail_wanted` and `check`.
"""

import threading

from foveacam_hardware.contract import Clock, FoveaError, Stopped
from foveacam_server.runtime.device_reconnector import MIRRORS, DeviceReconnector
from foveacam_server.runtime.ports import AssembledRig

PING_PERIOD_NS = 200_000_000
"""With the driver's own deadlines (0.75 s), a controller that falls silent is noticed within a second."""


class MirrorLinkMonitor:
    """Pings when it is time, and keeps the rail off while nobody shall move."""

    def __init__(self, *, clock: Clock, watch: DeviceReconnector) -> None:
        self._clock = clock
        self._watch = watch
        self._next_ns = 0
        self._rail_off = threading.Event()

    @property
    def rail_wanted(self) -> bool:
        """Whether the operator wants the rail on."""
        return not self._rail_off.is_set()

    def switch(self, rig: AssembledRig, *, on: bool) -> None:
        """Switch the mirrors' rail; off, it stays off whatever is reconnected."""
        if on:
            rig.mirrors.enable()
            self._rail_off.clear()
        else:
            self._rail_off.set()
            rig.mirrors.disable()

    def keep(self, rig: AssembledRig) -> None:
        """Ping when it is time; tell the watch what was found."""
        now_ns = self._clock.now_ns()
        if now_ns < self._next_ns or self._watch.lacking(MIRRORS) is not None:
            return
        try:
            rig.mirrors.ping()
            if self._rail_off.is_set() and rig.mirrors.state.enabled:
                rig.mirrors.disable()  # a reconnect has switched it on
        except FoveaError as error:
            self._watch.look_failed(rig, error)
        self._next_ns = self._clock.now_ns() + PING_PERIOD_NS

    def check(self) -> None:
        """Raise `Stopped` while the operator has switched the rail off."""
        if self._rail_off.is_set():
            raise Stopped(
                "asked to move: the mirrors were switched off; POST /api/v1/mirrors/enable switches them on",
                asked="move the mirrors",
                found="the mirrors were switched off",
                remedy="switch them on: POST /api/v1/mirrors/enable",
            )
