"""The mirror controller as `contract.Mirrors`: both mirrors and the trigger lines.

Defines the order of start-up. Packets and the reader thread are left to `session`, verified settings to
`requests`, positions to `commanded_position`, link faults to `recovery`.
"""

import functools
import logging
import threading
from dataclasses import replace

from foveacam_hardware.contract import (
    Clock,
    DeviceFault,
    DeviceInfo,
    ExposureReceipt,
    FoveaError,
    LinkTelemetry,
    MirrorLimits,
    MirrorState,
    NotConnected,
    PendingExposure,
    Role,
    StereoVolts,
    Timeout,
)
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.commanded_position import STREAMS, CommandedPosition
from foveacam_hardware.drivers.controller.crc_agreement import agree_on_crc
from foveacam_hardware.drivers.controller.exposure import (
    ExposureUnderWay,
    PendingExposures,
    check_times,
    timeout_s,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision, SessionGuard, set_watchdog
from foveacam_hardware.drivers.controller.identity import UNKNOWN, identify_controller
from foveacam_hardware.drivers.controller.recovery import LinkRecovery, switch_off, undo_start
from foveacam_hardware.drivers.controller.replies import ControllerRefusal
from foveacam_hardware.drivers.controller.requests import ControllerRequests, check_low_pass
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.drivers.controller.traffic import NO_TRAFFIC
from foveacam_hardware.drivers.controller.update_rate import SteeringPacer, UpdateRateGovernor
from foveacam_hardware.wire.controller import PacketProperty
from foveacam_hardware.wire.link import PortLinkFactory

logger = logging.getLogger(__name__)

CLOCK_PINGS = 10
CLOCK_MAX_AGE_NS = 2_000_000_000
CLOCK_GOOD_NS = 1_000_000
"""Clock uncertainty above which an exposure is preceded by pings, `CLOCK_TRIES` at most."""
CLOCK_TRIES = 3
LOG_INFO = 3
CLOSE_TRIES = 2
"""Attempts to switch the rail off when closing, as one packet may be lost."""


class ControllerMirrors:
    """Both mirrors behind one controller; every method may be called from any thread."""

    def __init__(
        self,
        link_factory: PortLinkFactory,
        clock: Clock,
        limits: MirrorLimits | None = None,
        low_pass_hz: int = 120,
        *,
        name: str = "controller",
        supervision: LinkSupervision | None = None,
    ) -> None:
        self._link_factory = link_factory
        self._clock = clock
        self._limits = limits or MirrorLimits()
        check_low_pass(low_pass_hz)
        self._low_pass_hz = low_pass_hz
        self._info = DeviceInfo(vendor="FoveaCam", model="mirror controller", serial=name)
        self._supervision = supervision or LinkSupervision()
        self._guard = SessionGuard(self._supervision.guardian)
        self._controller = UNKNOWN
        self._procedure = threading.RLock()  # serialises connect, close, enable, disable and expose
        self._position = CommandedPosition(self._limits)
        self._requests: ControllerRequests | None = None
        self._clock_map: ClockMap | None = None
        self._enabled = False
        self._exposures = PendingExposures()
        self._pacer = SteeringPacer(
            UpdateRateGovernor(
                ceiling_hz=self._supervision.ceiling_hz,
                least_baseline_ms=self._supervision.least_baseline_ms,
            ),
            clock,
        )
        self._recovery = LinkRecovery(
            self._position, enabled=lambda: self._enabled, probe_s=self._supervision.probe_s
        )

    @property
    def info(self) -> DeviceInfo:
        """Identity of the controller."""
        return self._info

    @property
    def limits(self) -> MirrorLimits:
        """Limits beyond which commands are refused."""
        return self._limits

    @property
    def state(self) -> MirrorState:
        """State of the controller; `volts` are the last commanded ones, also after a fault."""
        requests = self._requests
        failure = requests.session.failure if requests else None
        connected = requests is not None and failure is None
        return MirrorState(
            connected=connected,
            enabled=connected and self._enabled,
            volts=self._position.volts,
            fault=self._recovery.fault or (str(failure) if failure else None),
            guarded=connected and self._guard.protects(self._controller),
            parks=self._position.parks,
            exposing=connected and self._exposures.exposing,
        )

    @property
    def telemetry(self) -> LinkTelemetry:
        """Traffic and timing since the last `connect`."""
        requests, clock_map = self._requests, self._clock_map
        if requests is None:
            return NO_TRAFFIC
        return replace(
            requests.session.telemetry(),
            clock_offset_ns=clock_map.offset_ns if clock_map else 0,
            clock_drift_ppm=clock_map.drift_ppm if clock_map else None,
            lost_answers=self._recovery.lost_answers,
            update_limit_hz=self._pacer.rate_hz,
        )

    def connect(self) -> None:
        """Open, identify, configure, enable and park; do nothing when connected.

        A controller found enabled is switched off first: bias and filter must be set before the rail is on.
        """
        with self._procedure:
            if self.state.connected:
                return
            self._discard()
            try:
                session = ControllerSession(self._link_factory(), self._clock)
                self._requests = ControllerRequests(session, deadline_s=self._supervision.answer_s)
                self._start(self._requests)
            except FoveaError as failure:
                error = undo_start(self._requests, failure, probe_s=self._supervision.probe_s)
                self._discard()
                self._recovery.fault = str(error)
                raise error from failure.__cause__

    def close(self) -> None:
        """Park, switch off and release; do nothing when closed."""
        with self._procedure:
            for _ in range(CLOSE_TRIES):
                try:
                    if self.state.enabled:
                        self.disable()
                except FoveaError as failure:
                    logger.warning("controller: not switched off at close: %s", failure)
            self._discard()
            self._recovery.fault = None
            self._guard.close()

    def enable(self) -> None:
        """Set the bias and switch the rail on, mirrors parked; do nothing when enabled."""
        with self._procedure:
            requests = self._connected()
            if not self._enabled:
                self._recovery.run(requests, lambda: self._switch_on(requests))

    def disable(self) -> None:
        """Park and switch the rail off; do nothing when disabled."""
        with self._procedure:
            requests = self._connected()
            if self._enabled:
                requests.session.forget(*self._position.park(requests.session))
                self._recovery.run(requests, lambda: requests.switch(on=False))
                self._enabled = False

    def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
        """Move without waiting for a reply (before 2.0: with one); return the volts actually set.

        Updates beyond the link's rate (`telemetry.update_limit_hz`) wait. One that waits while the mirrors
        are parked is dropped: see the contract.
        """
        requests = self._ready()
        self._position.check(volts)
        self._pacer.wait(requests.session)
        actual, reply = self._position.steer(
            requests.session, volts, t_ns=self._clock.now_ns(), unless_parked_since=unless_parked_since
        )
        if reply is not None:
            self._recovery.run(requests, lambda: requests.wait(reply))
        return actual

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Move, settle, trigger both foveae or the one with a camera, and return after the exposure.

        The controller rejects an exposure shorter than the pulse or longer than the pulse + 5 ms.
        """
        with self._procedure:
            return self.begin_exposure(volts, settle_us=settle_us, pulse_us=pulse_us, without=without).wait()

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Request an exposure, as `expose` does, and return at once; the controller does the timing."""
        check_times(settle_us=settle_us, pulse_us=pulse_us)
        with self._procedure:
            requests, clock_map = self._ready(), self._clock_map
            if clock_map is None or not self._controller.has_frames:
                found = f"controller: firmware {self._info.version} has no triggered exposures"
                raise DeviceFault(f"{found}; update it to 2.0")
            self._exposures.check_room(self._clock.now_ns())
            self._compare_clocks(requests, clock_map)
            if not self._position.stream_known:
                # With the active stream unknown, it is unknown whether the controller waits for settling.
                self.steer(volts)
                self._clock.sleep_until_ns(self._clock.now_ns() + settle_us * 1000)
            _, update, frame = self._position.expose(
                requests.session,
                volts,
                settle_us=settle_us,
                pulse_us=pulse_us,
                without=without,
                t_ns=self._clock.now_ns(),
            )
            duration_s = timeout_s(settle_us=settle_us, pulse_us=pulse_us)
            exposure = ExposureUnderWay(
                requests,
                (update, frame),
                duration_s=duration_s,
                due_ns=self._clock.now_ns() + round((duration_s + requests.deadline_s) * 1e9),
                clock_map=clock_map,
                recovery=self._recovery,
            )
            self._exposures.add(exposure)
        return exposure

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the drive filters, Hz."""
        return self._low_pass_hz

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Set the cut-off of the drive filters, Hz; it is kept across reconnects."""
        with self._procedure:
            requests = self._connected()
            self._recovery.run(requests, lambda: requests.set_low_pass(cutoff_hz))
            self._low_pass_hz = cutoff_hz

    def recover(self) -> None:
        """Restart the DACs of both mirrors with the rail on, to recover a frozen mirror."""
        with self._procedure:
            requests = self._ready()
            if not self._controller.has_recovery:
                found = f"controller: firmware {self._info.version} cannot start its DACs anew"
                raise DeviceFault(f"{found}; update it to 2.1, or switch the mirrors off and on")
            self._recovery.run(requests, requests.recover_dacs)

    def park(self) -> None:
        """Set both mirrors to zero differential volts now, ahead of every pending request."""
        session = self._connected().session
        session.forget(*self._position.park(session))

    def park_confirmed(self, *, within_s: float) -> None:
        """Park and wait for the acknowledgement; repeat once in case of a lost byte.

        With the rail off the mirrors are at rest whatever the controller answers.
        """
        try:
            self._park_acknowledged(within_s / 2)
        except Timeout:
            self._park_acknowledged(within_s / 2)

    def _park_acknowledged(self, deadline_s: float) -> None:
        session = self._connected().session
        replies = self._position.park(session)
        try:
            for reply in replies:
                reply.wait(deadline_s=deadline_s)
        except ControllerRefusal:
            if self._enabled:
                raise
        finally:
            session.forget(*replies)

    def ping(self) -> float:
        """Return the round-trip time of a ping, ms; detects silence and a restart of the controller."""
        return self._ping(self._connected())

    def _connected(self) -> ControllerRequests:
        requests = self._requests
        if requests is None or requests.session.failure is not None:
            raise NotConnected(
                f"mirrors: {self.state.fault or 'the controller is not connected'}; connect again"
            )
        return requests

    def _ready(self) -> ControllerRequests:
        requests = self._connected()
        if not self._enabled:
            raise DeviceFault("mirrors: the rail is off, nothing can move; enable the mirrors first")
        return requests

    def _start(self, requests: ControllerRequests) -> None:
        self._controller = controller = identify_controller(requests)
        attached = requests.session.identity
        self._info = controller.info(serial=attached.serial or self._info.serial, port=attached.name)
        self._hand_to_guardian(requests)
        agree_on_crc(requests, controller, self._supervision.crc)
        if requests.enabled():
            logger.warning("controller: found with the rail on; switching it off before setting the bias")
            requests.switch(on=False)
        requests.set_log_level(LOG_INFO)
        requests.set_low_pass(self._low_pass_hz)
        set_watchdog(requests, controller, self._limits)
        self._clock_map = ClockMap() if controller.has_clock else None
        for _ in range(CLOCK_PINGS):
            requests.ping(self._clock_map)
        self._recovery.begin()
        self._pacer.begin(requests.session)
        self._switch_on(requests)

    def _hand_to_guardian(self, requests: ControllerRequests) -> None:
        self._guard.hand_over(
            requests, self._controller, position=self._position, low_pass_hz=self._low_pass_hz
        )

    def _switch_on(self, requests: ControllerRequests) -> None:
        requests.configure(PacketProperty.BIAS, self._position.bias_code)
        try:
            requests.switch(on=True)
            if self._controller.has_frames:
                requests.create_streams(STREAMS, self._position.rest_codes)
        except FoveaError:
            switch_off(requests.session, probe_s=self._supervision.probe_s, tries=1)
            raise
        self._position.restart(streaming=self._controller.has_frames)
        self._enabled = True

    def _discard(self) -> None:
        requests, self._requests = self._requests, None
        self._enabled = False
        self._clock_map = None
        self._exposures.clear()
        self._guard.release()
        if requests is not None:
            requests.session.close()

    def _compare_clocks(self, requests: ControllerRequests, clock_map: ClockMap) -> None:
        """Ping if the last ping is old or was slow; after a long pause one slow ping is not exact enough."""
        for _ in range(CLOCK_TRIES):
            now_ns = self._clock.now_ns()
            age_ns, uncertainty_ns = clock_map.age_ns(now_ns), clock_map.uncertainty_ns(now_ns)
            if age_ns is not None and age_ns <= CLOCK_MAX_AGE_NS and (uncertainty_ns or 0) <= CLOCK_GOOD_NS:
                return
            self._ping(requests)

    def _ping(self, requests: ControllerRequests) -> float:
        rtt_ms, steady = self._recovery.run(requests, lambda: requests.ping(self._clock_map))
        if not steady:
            raise self._recovery.give_up(requests, "controller: it restarted by itself (its clock jumped)")
        for update in self._position.confirm(requests.session) if self._enabled else ():
            self._recovery.run(requests, functools.partial(requests.wait, update))
        self._hand_to_guardian(requests)
        return rtt_ms
