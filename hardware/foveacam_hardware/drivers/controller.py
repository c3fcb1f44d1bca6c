"""The mirror controller: the pair of mirrors and the trigger lines as `contract.Mirrors`.

Keeps the order of start-up and the answer to every fault of the wire. Packets and the reader thread
are `controller_session`'s, verified settings `controller_dialogue`'s, positions `controller_targets`'.
"""

import logging
import threading
from collections.abc import Callable
from typing import TypeVar

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
from foveacam_hardware.drivers.controller_session import NO_TRAFFIC, Arrival, Refusal, Reply, Session
from foveacam_hardware.drivers.controller_targets import STREAMS, Targets
from foveacam_hardware.drivers.controller_volts import mirror_volts
from foveacam_hardware.wire.controller import Property
from foveacam_hardware.wire.controller_payloads import FrameReport
from foveacam_hardware.wire.link import LinkFactory

logger = logging.getLogger(__name__)

_Answer = TypeVar("_Answer")

DEADLINE_S = 0.3
"""For an answer; with the probes after it, a dead controller is reported within 0.9 s."""
PROBE_DEADLINE_S = 0.2
PROBES = 2
"""The first may be swallowed by what a lost byte left of the packet before it."""
CLOCK_PINGS = 8
CLOCK_MAX_AGE_NS = 2_000_000_000
STROBE_GRACE_US = 5000
"""After the pulse, how long the controller lets an exposure last."""
MAX_U32 = 0xFFFF_FFFF
FIRST_WITH_CLOCK = (1, 1, 0)
FIRST_WITH_FRAMES = (2, 0, 0)
LAST_KNOWN_MAJOR = 2

_RAIL_WARNING = (
    "a controller that has stopped leaves the mirror rail on, and only a power cycle clears it:"
    " switch its supply off and on, then reconnect"
)
_STATE_LOST = frozenset(
    {"Cannot perform action: system is not enabled", "Unknown stream", "Unknown stream id", "System disabled"}
)

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
        self._recovery = threading.Lock()
        self._targets = Targets(self._limits)
        self._dialogue: Dialogue | None = None
        self._clock_map: ClockMap | None = None
        self._enabled = False
        self._fault: str | None = None

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
            fault=self._fault or (str(failure) if failure else None),
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
                    failure = Timeout(f"{failure}; if this is the controller's port, {_RAIL_WARNING}")
                self._fault = str(failure)
                raise failure from failure.__cause__
            self._fault = None

    def close(self) -> None:
        """Park, switch off and release; harmless when closed."""
        with self._procedure:
            if self.state.connected:
                try:
                    self.disable()
                except FoveaError as failure:
                    logger.warning("controller: not switched off at close: %s", failure)
            self._discard()
            self._fault = None

    def enable(self) -> None:
        """Switch the rail on, bias first, mirrors parked; harmless when enabled."""
        with self._procedure:
            dialogue = self._connected()
            if not self._enabled:
                self._guarded(dialogue, lambda: self._switch_on(dialogue))

    def disable(self) -> None:
        """Park and switch the rail off; harmless when disabled."""
        with self._procedure:
            dialogue = self._connected()
            if self._enabled:
                self._targets.park(dialogue.session)
                self._guarded(dialogue, lambda: dialogue.switch(on=False))
                self._enabled = False

    def steer(self, volts: StereoVolts) -> StereoVolts:
        """Move without waiting for a reply (before 2.0: with one); return the volts really set."""
        dialogue = self._ready()
        actual, reply = self._targets.steer(dialogue.session, volts, t_ns=self._clock.now_ns())
        if reply is not None:
            self._guarded(dialogue, lambda: dialogue.wait(reply))
        return actual

    def expose(self, volts: StereoVolts, *, settle_us: int, pulse_us: int) -> ExposureReceipt:
        """Move, settle, trigger both foveae, and return once the exposure is over.

        The controller gives up on an exposure shorter than the pulse or longer than the pulse + 5 ms.
        """
        _check_times(settle_us=settle_us, pulse_us=pulse_us)
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
            duration_s = (settle_us + pulse_us + STROBE_GRACE_US) * 1e-6
            arrival = self._guarded(dialogue, lambda: _await_frame(dialogue, update, frame, duration_s))
            return self._receipt(FrameReport.unpack(arrival.packet.payload), self._clock_map)

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
            self._guarded(dialogue, lambda: dialogue.configure(Property.LPF, cutoff_hz))
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
        rtt_ms, steady = self._guarded(dialogue, lambda: dialogue.ping(self._clock_map))
        if not steady:
            raise self._give_up(dialogue, "controller: it restarted by itself (its clock jumped)")
        return rtt_ms

    def _guarded(self, dialogue: Dialogue, action: Callable[[], _Answer]) -> _Answer:
        """Run a conversation; silence is looked into, and a controller that lost its state is given up."""
        try:
            return action()
        except Timeout as silence:
            self._targets.lose_track()
            self._after_silence(dialogue, silence)
            raise Timeout(
                f"{silence}; it answers again, so a packet was lost: the mirrors are parked, ask again"
            ) from silence
        except Refusal as refusal:
            self._targets.lose_track()
            if refusal.text in _STATE_LOST:
                raise self._give_up(
                    dialogue, f"{refusal}: it restarted, or another program used it"
                ) from refusal
            raise

    def _after_silence(self, dialogue: Dialogue, silence: Timeout) -> None:
        """Park; return when the controller answers again in the state it should be in, else give it up."""
        with self._recovery:
            probe = Dialogue(dialogue.session, deadline_s=PROBE_DEADLINE_S)
            for _ in range(PROBES):
                self._park_if_enabled(dialogue)
                try:
                    found_enabled = probe.enabled()
                except Timeout:
                    continue
                if found_enabled is not self._enabled:
                    raise self._give_up(dialogue, "controller: it was silent and came back in another state")
                self._park_if_enabled(dialogue)
                return
            found = f"{silence}, nor to {PROBES} more questions: it has stopped or the line is broken"
            reason = f"{found}; {_RAIL_WARNING}"
            raise Timeout(str(self._give_up(dialogue, reason))) from silence

    def _park_if_enabled(self, dialogue: Dialogue) -> None:
        if self._enabled:
            self._targets.park(dialogue.session)

    def _give_up(self, dialogue: Dialogue, reason: str) -> NotConnected:
        failure = NotConnected(reason)
        self._fault = reason
        dialogue.session.fail(failure)
        return failure

    def _receipt(self, report: FrameReport, clock_map: ClockMap) -> ExposureReceipt:
        return ExposureReceipt(
            frame_id=report.frame_id,
            t_trigger_ns=clock_map.host_ns(report.t_trigger_us),
            t_exposure_ns=clock_map.host_ns(report.t_exposure_us),
            volts=StereoVolts(left=mirror_volts(report.left), right=mirror_volts(report.right)),
        )


def _await_frame(dialogue: Dialogue, update: Reply, frame: Reply, duration_s: float) -> Arrival:
    try:
        dialogue.wait(update)
        dialogue.wait(frame, last=False)
        return dialogue.wait(frame, extra_s=duration_s)
    finally:
        dialogue.session.forget(frame)


def _check_times(*, settle_us: int, pulse_us: int) -> None:
    if not 0 < pulse_us <= MAX_U32:
        raise OutOfRange(f"a trigger pulse of {pulse_us} µs cannot be made; give 1..{MAX_U32} µs")
    if not 0 <= settle_us <= MAX_U32:
        raise OutOfRange(f"a settling time of {settle_us} µs cannot be kept; give 0..{MAX_U32} µs")
