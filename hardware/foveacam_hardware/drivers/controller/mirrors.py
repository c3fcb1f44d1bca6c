"""The mirror controller: the pair of mirrors and the trigger lines as `contract.Mirrors`.

Keeps the order of start-up. Packets and the reader thread are `session`'s, verified settings
`dialogue`'s, positions `targets`', faults of the wire `recovery`'s.
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
from foveacam_hardware.drivers.controller.exposure import ExposureUnderWay, check_times, longest_s
from foveacam_hardware.drivers.controller.guard import LinkSupervision, SessionGuard, set_watch
from foveacam_hardware.drivers.controller.identity import UNKNOWN, identify_controller
from foveacam_hardware.drivers.controller.recovery import LinkRecovery, switched_off, undone
from foveacam_hardware.drivers.controller.replies import ControllerRefusal
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.drivers.controller.traffic import NO_TRAFFIC
from foveacam_hardware.drivers.controller.update_rate import SteeringPacer, UpdateRateGovernor
from foveacam_hardware.wire.controller import PacketProperty
from foveacam_hardware.wire.link import PortLinkFactory

logger = logging.getLogger(__name__)

CLOCK_PINGS = 10
CLOCK_MAX_AGE_NS = 2_000_000_000
LOG_INFO = 3
CLOSE_TRIES = 2
"""A lost packet must not leave the rail on when nobody is there any more."""


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
        care: LinkSupervision | None = None,
    ) -> None:
        self._link_factory = link_factory
        self._clock = clock
        self._limits = limits or MirrorLimits()
        self._low_pass_hz = low_pass_hz
        self._info = DeviceInfo(vendor="FoveaCam", model="mirror controller", serial=name)
        self._care = care or LinkSupervision()
        self._watch = SessionGuard(self._care.guardian)
        self._controller = UNKNOWN
        self._procedure = threading.RLock()  # connect, close, enable, disable, expose: one at a time
        self._targets = CommandedPosition(self._limits)
        self._dialogue: ControllerRequests | None = None
        self._clock_map: ClockMap | None = None
        self._enabled = False
        self._pace = SteeringPacer(UpdateRateGovernor(ceiling_hz=self._care.ceiling_hz), clock)
        self._recovery = LinkRecovery(
            self._targets, enabled=lambda: self._enabled, probe_s=self._care.probe_s
        )

    @property
    def info(self) -> DeviceInfo:
        """Who the controller is."""
        return self._info

    @property
    def limits(self) -> MirrorLimits:
        """What is refused above the wire."""
        return self._limits

    @property
    def state(self) -> MirrorState:
        """What is known of the controller; after a fault, the volts last commanded."""
        dialogue = self._dialogue
        failure = dialogue.session.failure if dialogue else None
        connected = dialogue is not None and failure is None
        return MirrorState(
            connected=connected,
            enabled=connected and self._enabled,
            volts=self._targets.volts,
            fault=self._recovery.fault or (str(failure) if failure else None),
            guarded=connected and self._watch.watches(self._controller),
        )

    @property
    def telemetry(self) -> LinkTelemetry:
        """Traffic since the last `connect`."""
        dialogue, clock_map = self._dialogue, self._clock_map
        if dialogue is None:
            return NO_TRAFFIC
        return replace(
            dialogue.session.telemetry(),
            clock_offset_ns=clock_map.offset_ns if clock_map else 0,
            clock_drift_ppm=clock_map.drift_ppm if clock_map else None,
            lost_answers=self._recovery.lost_answers,
            update_limit_hz=self._pace.rate_hz,
        )

    def connect(self) -> None:
        """Open, identify, configure, enable and park; harmless when connected.

        A controller found enabled is switched off first: bias and filter must be known before the rail.
        """
        with self._procedure:
            if self.state.connected:
                return
            self._discard()
            try:
                session = ControllerSession(self._link_factory(), self._clock)
                self._dialogue = ControllerRequests(session, deadline_s=self._care.answer_s)
                self._start(self._dialogue)
            except FoveaError as failure:
                told = undone(self._dialogue, failure, probe_s=self._care.probe_s)
                self._discard()
                self._recovery.fault = str(told)
                raise told from failure.__cause__

    def close(self) -> None:
        """Park, switch off and release; harmless when closed."""
        with self._procedure:
            for _ in range(CLOSE_TRIES):
                try:
                    if self.state.enabled:
                        self.disable()
                except FoveaError as failure:
                    logger.warning("controller: not switched off at close: %s", failure)
            self._discard()
            self._recovery.fault = None
            self._watch.close()

    def enable(self) -> None:
        """Switch the rail on, bias first, mirrors parked; harmless when enabled."""
        with self._procedure:
            dialogue = self._connected()
            if not self._enabled:
                self._recovery.guarded(dialogue, lambda: self._switch_on(dialogue))

    def disable(self) -> None:
        """Park and switch the rail off; harmless when disabled."""
        with self._procedure:
            dialogue = self._connected()
            if self._enabled:
                dialogue.session.forget(*self._targets.park(dialogue.session))
                self._recovery.guarded(dialogue, lambda: dialogue.switch(on=False))
                self._enabled = False

    def steer(self, volts: StereoVolts) -> StereoVolts:
        """Move without waiting for a reply (before 2.0: with one); return the volts really set.

        More updates than the link keeps up with wait for their turn (`telemetry.update_limit_hz`).
        """
        dialogue = self._ready()
        self._targets.check(volts)
        self._pace.wait_turn(dialogue.session)
        actual, reply = self._targets.steer(dialogue.session, volts, t_ns=self._clock.now_ns())
        if reply is not None:
            self._recovery.guarded(dialogue, lambda: dialogue.wait(reply))
        return actual

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        """Move, settle, trigger both foveae or the one that has a camera, and return after the exposure.

        The controller gives up on an exposure shorter than the pulse or longer than the pulse + 5 ms.
        """
        with self._procedure:
            return self.begin_exposure(volts, settle_us=settle_us, pulse_us=pulse_us, without=without).wait()

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        """Ask for the same and return at once; the controller keeps the times by itself."""
        check_times(settle_us=settle_us, pulse_us=pulse_us)
        with self._procedure:
            dialogue, clock_map = self._ready(), self._clock_map
            if clock_map is None or not self._controller.has_frames:
                found = f"controller: firmware {self._info.version} has no triggered exposures"
                raise DeviceFault(f"{found}; update it to 2.0")
            age_ns = clock_map.age_ns(self._clock.now_ns())
            if age_ns is None or age_ns > CLOCK_MAX_AGE_NS:
                self._ping(dialogue)
            if not self._targets.tracked:
                # Which stream stands on the mirrors is unknown, and with it whether the controller settles.
                self.steer(volts)
                self._clock.sleep_until_ns(self._clock.now_ns() + settle_us * 1000)
            _, update, frame = self._targets.expose(
                dialogue.session,
                volts,
                settle_us=settle_us,
                pulse_us=pulse_us,
                without=without,
                t_ns=self._clock.now_ns(),
            )
        duration_s = longest_s(settle_us=settle_us, pulse_us=pulse_us)
        return ExposureUnderWay(
            dialogue, (update, frame), duration_s=duration_s, clock_map=clock_map, recovery=self._recovery
        )

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the drive filters, Hz."""
        return self._low_pass_hz

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Run the drive filters at another cut-off; a reconnect keeps it."""
        with self._procedure:
            dialogue = self._connected()
            self._recovery.guarded(dialogue, lambda: dialogue.set_low_pass(cutoff_hz))
            self._low_pass_hz = cutoff_hz

    def recover(self) -> None:
        """Start the DACs of both mirrors anew, the rail on; for a mirror that has frozen."""
        with self._procedure:
            dialogue = self._ready()
            if not self._controller.has_recovery:
                found = f"controller: firmware {self._info.version} cannot start its DACs anew"
                raise DeviceFault(f"{found}; update it to 2.1, or switch the mirrors off and on")
            self._recovery.guarded(dialogue, dialogue.recover_dacs)

    def park(self) -> None:
        """Bring both mirrors to zero differential now, past every pending request."""
        session = self._connected().session
        session.forget(*self._targets.park(session))

    def park_confirmed(self, *, within_s: float) -> None:
        """Do the same and return once the controller has acknowledged it; ask again once, for a lost byte.

        A rail that is off is at rest, whatever the controller says.
        """
        try:
            self._park_acknowledged(within_s / 2)
        except Timeout:
            self._park_acknowledged(within_s / 2)

    def _park_acknowledged(self, deadline_s: float) -> None:
        session = self._connected().session
        replies = self._targets.park(session)
        try:
            for reply in replies:
                reply.wait(deadline_s=deadline_s)
        except ControllerRefusal:
            if self._enabled:
                raise
        finally:
            session.forget(*replies)

    def ping(self) -> float:
        """Return one round trip, ms; as a watchdog it notices silence, and a controller that restarted."""
        return self._ping(self._connected())

    def _connected(self) -> ControllerRequests:
        dialogue = self._dialogue
        if dialogue is None or dialogue.session.failure is not None:
            raise NotConnected(
                f"mirrors: {self.state.fault or 'the controller is not connected'}; connect again"
            )
        return dialogue

    def _ready(self) -> ControllerRequests:
        dialogue = self._connected()
        if not self._enabled:
            raise DeviceFault("mirrors: the rail is off, nothing can move; enable the mirrors first")
        return dialogue

    def _start(self, dialogue: ControllerRequests) -> None:
        self._controller = controller = identify_controller(dialogue)
        attached = dialogue.session.identity
        self._info = controller.info(serial=attached.serial or self._info.serial, port=attached.name)
        self._watch_over(dialogue)
        agree_on_crc(dialogue, controller, self._care.crc)
        if dialogue.enabled():
            logger.warning("controller: found with the rail on; switching it off before setting the bias")
            dialogue.switch(on=False)
        dialogue.say_much(LOG_INFO)
        dialogue.set_low_pass(self._low_pass_hz)
        set_watch(dialogue, controller, self._limits)
        self._clock_map = ClockMap() if controller.has_clock else None
        for _ in range(CLOCK_PINGS):
            dialogue.ping(self._clock_map)
        self._recovery.begin()
        self._pace.begin(dialogue.session)
        self._switch_on(dialogue)

    def _watch_over(self, dialogue: ControllerRequests) -> None:
        self._watch.keep(dialogue, self._controller, targets=self._targets, low_pass_hz=self._low_pass_hz)

    def _switch_on(self, dialogue: ControllerRequests) -> None:
        dialogue.configure(PacketProperty.BIAS, self._targets.bias_code)
        try:
            dialogue.switch(on=True)
            if self._controller.has_frames:
                dialogue.create_streams(STREAMS, self._targets.rest_codes)
        except FoveaError:
            switched_off(dialogue.session, probe_s=self._care.probe_s, tries=1)
            raise
        self._targets.restart(streaming=self._controller.has_frames)
        self._enabled = True

    def _discard(self) -> None:
        dialogue, self._dialogue = self._dialogue, None
        self._enabled = False
        self._clock_map = None
        self._watch.release()
        if dialogue is not None:
            dialogue.session.close()

    def _ping(self, dialogue: ControllerRequests) -> float:
        rtt_ms, steady = self._recovery.guarded(dialogue, lambda: dialogue.ping(self._clock_map))
        if not steady:
            raise self._recovery.give_up(dialogue, "controller: it restarted by itself (its clock jumped)")
        for update in self._targets.confirm(dialogue.session) if self._enabled else ():
            self._recovery.guarded(dialogue, functools.partial(dialogue.wait, update))
        self._watch_over(dialogue)
        return rtt_ms
