"""The mirror controller: the pair of mirrors and the trigger lines as `contract.Mirrors`.

Keeps the order of start-up. Packets and the reader thread are `controller_session`'s, verified settings
`controller_dialogue`'s, positions `controller_targets`', faults of the wire `controller_recovery`'s.
"""

import logging
import threading

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
    OutOfRange,
    StereoVolts,
    Timeout,
)
from foveacam_hardware.drivers.controller_clock import ClockMap
from foveacam_hardware.drivers.controller_dialogue import Dialogue
from foveacam_hardware.drivers.controller_exposure import await_frame, check_times, longest_s, receipt
from foveacam_hardware.drivers.controller_recovery import PROBE_DEADLINE_S, RAIL_WARNING, Recovery
from foveacam_hardware.drivers.controller_session import NO_TRAFFIC, Session
from foveacam_hardware.drivers.controller_targets import STREAMS, Targets
from foveacam_hardware.wire.controller import Property
from foveacam_hardware.wire.link import LinkFactory

logger = logging.getLogger(__name__)

DEADLINE_S = 0.3
"""For an answer; with the probes after it, a dead controller is reported within 0.9 s."""
CLOCK_PINGS = 8
CLOCK_MAX_AGE_NS = 2_000_000_000
FIRST_WITH_CLOCK = (1, 1, 0)
FIRST_WITH_FRAMES = (2, 0, 0)
LAST_KNOWN_MAJOR = 2
MAX_LOW_PASS_HZ = 1000


class ControllerMirrors:
    """Both mirrors behind one controller; every method may be called from any thread."""

    def __init__(
        self,
        link_factory: LinkFactory,
        clock: Clock,
        limits: MirrorLimits | None = None,
        low_pass_hz: int = 120,
        *,
        name: str = "controller",
    ) -> None:
        self._link_factory = link_factory
        self._clock = clock
        self._limits = limits or MirrorLimits()
        self._low_pass_hz = low_pass_hz
        self._info = DeviceInfo(vendor="FoveaCam", model="mirror controller", serial=name)
        self._version = (0, 0, 0)
        self._procedure = threading.RLock()  # connect, close, enable, disable, expose: one at a time
        self._targets = Targets(self._limits)
        self._dialogue: Dialogue | None = None
        self._clock_map: ClockMap | None = None
        self._enabled = False
        self._recovery = Recovery(self._targets, enabled=lambda: self._enabled)

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
        )

    @property
    def telemetry(self) -> LinkTelemetry:
        """Traffic since the last `connect`."""
        dialogue, clock_map = self._dialogue, self._clock_map
        if dialogue is None:
            return NO_TRAFFIC
        return dialogue.session.telemetry(clock_offset_ns=clock_map.offset_ns if clock_map else 0)

    def connect(self) -> None:
        """Open, identify, configure, enable and park; harmless when connected.

        A controller found enabled is switched off first: bias and filter must be known before the rail.
        """
        with self._procedure:
            if self.state.connected:
                return
            self._discard()
            try:
                session = Session(self._link_factory(), self._clock)
                self._dialogue = Dialogue(session, deadline_s=DEADLINE_S)
                self._start(self._dialogue)
            except FoveaError as failure:
                self._undo_connect()
                if isinstance(failure, Timeout):
                    failure = Timeout(f"{failure}; if this is the controller's port, {RAIL_WARNING}")
                self._recovery.fault = str(failure)
                raise failure from failure.__cause__
            self._recovery.fault = None

    def close(self) -> None:
        """Park, switch off and release; harmless when closed."""
        with self._procedure:
            if self.state.connected:
                try:
                    self.disable()
                except FoveaError as failure:
                    logger.warning("controller: not switched off at close: %s", failure)
            self._discard()
            self._recovery.fault = None

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
                self._targets.park(dialogue.session)
                self._recovery.guarded(dialogue, lambda: dialogue.switch(on=False))
                self._enabled = False

    def steer(self, volts: StereoVolts) -> StereoVolts:
        """Move without waiting for a reply (before 2.0: with one); return the volts really set."""
        dialogue = self._ready()
        actual, reply = self._targets.steer(dialogue.session, volts, t_ns=self._clock.now_ns())
        if reply is not None:
            self._recovery.guarded(dialogue, lambda: dialogue.wait(reply))
        return actual

    def expose(self, volts: StereoVolts, *, settle_us: int, pulse_us: int) -> ExposureReceipt:
        """Move, settle, trigger both foveae, and return once the exposure is over.

        The controller gives up on an exposure shorter than the pulse or longer than the pulse + 5 ms.
        """
        check_times(settle_us=settle_us, pulse_us=pulse_us)
        with self._procedure:
            dialogue = self._ready()
            if self._clock_map is None or self._version < FIRST_WITH_FRAMES:
                raise DeviceFault(
                    f"controller: firmware {self._info.version} has no triggered exposures; update it to 2.0"
                )
            age_ns = self._clock_map.age_ns(self._clock.now_ns())
            if age_ns is None or age_ns > CLOCK_MAX_AGE_NS:
                self._ping(dialogue)
            if not self._targets.tracked:
                # Which stream stands on the mirrors is unknown, and with it whether the controller settles.
                self.steer(volts)
                self._clock.sleep_until_ns(self._clock.now_ns() + settle_us * 1000)
            _, update, frame = self._targets.expose(
                dialogue.session, volts, settle_us=settle_us, pulse_us=pulse_us, t_ns=self._clock.now_ns()
            )
            duration_s = longest_s(settle_us=settle_us, pulse_us=pulse_us)
            report = self._recovery.guarded(
                dialogue, lambda: await_frame(dialogue, update, frame, duration_s=duration_s)
            )
            return receipt(report, self._clock_map)

    @property
    def low_pass_hz(self) -> int:
        """Cut-off of the drive filters, Hz."""
        return self._low_pass_hz

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Run the drive filters at another cut-off; a reconnect keeps it."""
        if not 1 <= cutoff_hz <= MAX_LOW_PASS_HZ:
            raise OutOfRange(
                f"mirrors: a filter of {cutoff_hz} Hz is outside 1 to {MAX_LOW_PASS_HZ} Hz; choose one inside"
            )
        with self._procedure:
            dialogue = self._connected()
            self._recovery.guarded(dialogue, lambda: dialogue.configure(Property.LPF, cutoff_hz))
            self._low_pass_hz = cutoff_hz

    def park(self) -> None:
        """Bring both mirrors to zero differential now; waits for no request of another thread."""
        self._targets.park(self._connected().session)

    def ping(self) -> float:
        """Return one round trip, ms; as a watchdog it notices silence, and a controller that restarted."""
        return self._ping(self._connected())

    def _connected(self) -> Dialogue:
        dialogue = self._dialogue
        if dialogue is None or dialogue.session.failure is not None:
            raise NotConnected(
                f"mirrors: {self.state.fault or 'the controller is not connected'}; connect again"
            )
        return dialogue

    def _ready(self) -> Dialogue:
        dialogue = self._connected()
        if not self._enabled:
            raise DeviceFault("mirrors: the rail is off, nothing can move; enable the mirrors first")
        return dialogue

    def _start(self, dialogue: Dialogue) -> None:
        self._version = version = dialogue.version()
        if version[0] > LAST_KNOWN_MAJOR:
            raise DeviceFault(
                f"controller: firmware {version[0]}.{version[1]} is newer than this driver (up to"
                f" {LAST_KNOWN_MAJOR}.x); update the software"
            )
        text = ".".join(map(str, version))
        self._info = DeviceInfo(
            vendor="FoveaCam", model=dialogue.name(), serial=self._info.serial, version=text
        )
        if dialogue.enabled():
            logger.warning("controller: found with the rail on; switching it off before setting the bias")
            dialogue.switch(on=False)
        dialogue.configure(Property.LPF, self._low_pass_hz)
        self._clock_map = ClockMap() if version >= FIRST_WITH_CLOCK else None
        for _ in range(CLOCK_PINGS):
            dialogue.ping(self._clock_map)
        self._switch_on(dialogue)

    def _switch_on(self, dialogue: Dialogue) -> None:
        dialogue.configure(Property.BIAS, self._targets.bias_code)
        dialogue.switch(on=True)
        streaming = self._version >= FIRST_WITH_FRAMES
        if streaming:
            dialogue.create_streams(STREAMS, self._targets.rest_codes)
        self._targets.restart(streaming=streaming)
        self._enabled = True

    def _undo_connect(self) -> None:
        dialogue = self._dialogue
        if dialogue is not None and dialogue.session.failure is None:
            try:
                Dialogue(dialogue.session, deadline_s=PROBE_DEADLINE_S).switch(on=False)
            except FoveaError as failure:
                logger.warning("controller: not switched off after a failed start: %s", failure)
        self._discard()

    def _discard(self) -> None:
        dialogue, self._dialogue = self._dialogue, None
        self._enabled = False
        self._clock_map = None
        if dialogue is not None:
            dialogue.session.close()

    def _ping(self, dialogue: Dialogue) -> float:
        rtt_ms, steady = self._recovery.guarded(dialogue, lambda: dialogue.ping(self._clock_map))
        if not steady:
            raise self._recovery.give_up(dialogue, "controller: it restarted by itself (its clock jumped)")
        return rtt_ms
