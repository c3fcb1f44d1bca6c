"""The mirror controller on virtual time, with everything that can happen to it as a step.

After each step the driver measures by a ping; whenever it then says enabled, the rail is on and the outputs
are those of its volts. The bench takes random steps; the tests let hypothesis choose them.
"""

from collections.abc import Callable
from contextlib import suppress

from foveacam_bench.faults.trial_checks import FalsePosition, require
from foveacam_hardware.contract import FoveaError, MirrorLimits, MirrorVolts, StereoVolts, VirtualClock
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.controller.volts import bias_code, mirror_codes
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController

LIMITS = MirrorLimits()
SUPPLY_S = 0.1
"""Shortest time for which a supply stays on; a restart is recognised by the clock, to 50 ms."""
SETTLE_US, PULSE_US = 100, 4000


class MirrorTrial:
    """A controller, its far end and the truth; the methods of `STEPS` and `steer` are the steps."""

    def __init__(self, *, strict: bool) -> None:
        self.clock = VirtualClock(1_000_000_000)
        self._cables = RecordingCables()
        self._controller = LoopbackController(self.clock, self._cables, strict=strict)
        self._mirrors = ControllerMirrors(self._controller.open, self.clock, LIMITS)

    def connect(self) -> None:
        """Connect, as the server does."""
        with suppress(FoveaError):
            self._mirrors.connect()

    def enable(self) -> None:
        """Switch the rail on."""
        with suppress(FoveaError):
            self._mirrors.enable()

    def disable(self) -> None:
        """Switch the rail off."""
        with suppress(FoveaError):
            self._mirrors.disable()

    def steer(self, share: float) -> None:
        """Steer to a share of the range, -1 to 1, each axis to another volt."""
        with suppress(FoveaError):
            self._mirrors.steer(_volts(share))

    def expose(self, share: float) -> None:
        """Steer to a share of the range and expose."""
        with suppress(FoveaError):
            self._mirrors.expose(_volts(share), settle_us=SETTLE_US, pulse_us=PULSE_US)

    def park(self) -> None:
        """Park."""
        with suppress(FoveaError):
            self._mirrors.park()

    def close(self) -> None:
        """Close the mirrors."""
        self._mirrors.close()

    def wait(self, wait_s: float) -> None:
        """Let time pass without requests."""
        self.clock.sleep_until_ns(self.clock.now_ns() + round(wait_s * 1e9))

    def silence(self) -> None:
        """Make the controller silent: it ignores its input and sends nothing."""
        self._controller.configure(silent=True)

    def end_silence(self) -> None:
        """Make it respond again."""
        self._controller.configure(silent=False)

    def lose_power(self) -> None:
        """Switch its supply off and on."""
        self.wait(SUPPLY_S)
        self._controller.power_cycle()

    def stop_for_good(self) -> None:
        """Let it hang with its rail on, as after a packet that lost bytes."""
        self._controller.die()

    def unplug(self) -> None:
        """Pull its cable, which is its supply."""
        self.wait(SUPPLY_S)
        self._controller.unplug()

    def unplug_link_alone(self) -> None:
        """Pull its cable; its supply stays."""
        self._controller.unplug(keep_power=True)

    def plug(self) -> None:
        """Plug its cable in again."""
        self._controller.plug()

    def check(self) -> None:
        """Measure, and compare the driver's state with the truth; raise `TrialFailed` or `FalsePosition`."""
        with suppress(FoveaError):
            self._mirrors.ping()
        state, far_end = self._mirrors.state, self._controller.far_end
        answers = not (far_end.silent or far_end.dead or far_end.unplugged)
        require(answers or not state.connected, f"connected to a controller that does not answer: {state}")
        require(state.connected or not state.enabled, state)
        if not state.enabled:
            return
        bias = bias_code(LIMITS)
        codes = (*mirror_codes(state.volts.left, bias=bias), *mirror_codes(state.volts.right, bias=bias))
        if not self._cables.rail_on or self._cables.codes != codes:
            found = f"rail {'on' if self._cables.rail_on else 'off'}, codes {self._cables.codes}"
            raise FalsePosition(f"mirrors: the driver reports {state.volts}, and it is {found}")

    def recover(self) -> None:
        """Repair everything: it must be usable at the first connect."""
        self.end_silence()
        self.plug()
        self.lose_power()
        with suppress(FoveaError):
            self._mirrors.ping()
        self._mirrors.connect()
        self._mirrors.enable()
        self._mirrors.steer(_volts(0.25))
        self.check()
        require(self._mirrors.state.enabled, "the mirrors were enabled and are not")
        self._mirrors.close()


STEPS: tuple[Callable[[MirrorTrial], None], ...] = (
    MirrorTrial.connect,
    MirrorTrial.enable,
    MirrorTrial.disable,
    MirrorTrial.park,
    MirrorTrial.close,
    MirrorTrial.silence,
    MirrorTrial.end_silence,
    MirrorTrial.lose_power,
    MirrorTrial.stop_for_good,
    MirrorTrial.unplug,
    MirrorTrial.unplug_link_alone,
    MirrorTrial.plug,
)
"""Steps without an argument."""


def _volts(share: float) -> StereoVolts:
    full_v = share * LIMITS.max_v
    return StereoVolts(
        left=MirrorVolts(x_v=full_v, y_v=-0.5 * full_v),
        right=MirrorVolts(x_v=0.25 * full_v, y_v=0.75 * full_v),
    )
