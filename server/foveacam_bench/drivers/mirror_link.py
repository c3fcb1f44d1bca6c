"""Measure the mirror controller's link on the simulated controller in its own process (`bench serial`).

Round trips beside bare pyserial in the same run; sustained position updates, counted at the DACs; damaged
bytes: the time until the driver has recovered, or has reported that it cannot.
"""

import time
from dataclasses import dataclass, field
from statistics import median

from foveacam_bench.drivers.echo_process import echo_port
from foveacam_hardware.contract import MirrorVolts, MonotonicClock, NotConnected, StereoVolts, Timeout
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage
from foveacam_hardware.wire.link import bare_round_trips_ms

LATE_PINGS = 2
"""Pings on an undamaged line that may miss the driver's deadline one after the other."""
ROUNDS = 5
"""Our and bare round trips alternate, so that other load slows both."""
PING_BYTES = bytes(range(1, 15))
"""As long as the reply to a ping on the wire."""
UNGOVERNED_HZ = 1e6
"""Above any rate of the link; the driver's usual limit is 1000 updates a second."""
SKIPS = (0, 2, 5)
"""Damaged byte of a packet: the first run length, the header, the delimiter or the byte beside it."""


@dataclass(slots=True)
class _Damages:
    """Outcomes of the damaged bytes."""

    times_s: list[float] = field(default_factory=list)
    recovered: int = 0
    reported: int = 0
    absorbed: int = 0
    parked: bool = True
    """Whether every recovery ended with both mirrors at rest, as seen at the DACs."""


def run(*, quick: bool = False) -> dict[str, float | int | bool]:
    """Measure the serial path; `quick` takes fewer samples."""
    figures: dict[str, float | int | bool] = {}
    figures |= _round_trips(count=60 if quick else 400)
    figures |= _updates(count=1000 if quick else 6000)
    damages = _Damages()
    kinds = (DamageKind.DROP,) if quick else (*DamageKind,) * 2
    for strict in (False, True):
        _measure_damage(damages, strict=strict, kinds=kinds)
    figures |= {
        "recovery_s": max(damages.times_s),
        "recovery_median_s": median(damages.times_s),
        "damages": len(damages.times_s),
        "recovered": damages.recovered,
        "reported": damages.reported,
        "absorbed": damages.absorbed,
        "parked": damages.parked,
    }
    return figures


def _round_trips(*, count: int) -> dict[str, float | int | bool]:
    ours_ms: list[float] = []
    bare_ms: list[float] = []
    with ControllerProcess(RecordingCables(), strict=True) as controller, echo_port() as echo:
        mirrors = ControllerMirrors(controller.open, MonotonicClock())
        mirrors.connect()
        for _ in range(ROUNDS):
            ours_ms += [_undisturbed_ping_ms(mirrors) for _ in range(count)]
            bare_ms += bare_round_trips_ms(echo, data=PING_BYTES, count=count)
        mirrors.close()
    p50_ms, bare_p50_ms = median(ours_ms), median(bare_ms)
    return {
        "rtt_p50_ms": p50_ms,
        "rtt_p99_ms": sorted(ours_ms)[int(0.99 * len(ours_ms))],
        "bare_rtt_p50_ms": bare_p50_ms,
        "rtt_ratio": p50_ms / bare_p50_ms,
    }


def _updates(*, count: int) -> dict[str, float | int | bool]:
    cables = RecordingCables()
    with ControllerProcess(cables, strict=True) as controller:
        mirrors = ControllerMirrors(
            controller.open, MonotonicClock(), supervision=LinkSupervision(ceiling_hz=UNGOVERNED_HZ)
        )
        mirrors.connect()
        controller.status()
        before = len(cables.drives)
        began_s, began_cpu_s = time.perf_counter(), time.thread_time()
        for step in range(count):
            mirrors.steer(_aside(1.0 + step % 100))
        cpu_s = time.thread_time() - began_cpu_s
        _undisturbed_ping_ms(mirrors)  # answered after all updates
        took_s = time.perf_counter() - began_s
        controller.status()
        moved = len(cables.drives) - before
        mirrors.close()
    return {
        "updates_per_s": moved / took_s,
        "updates_lost": count - moved,
        "update_cpu_us": cpu_s / count * 1e6,
    }


def _measure_damage(damages: _Damages, *, strict: bool, kinds: tuple[DamageKind, ...]) -> None:
    cables = RecordingCables()
    with ControllerProcess(cables, strict=strict) as controller:
        mirrors = ControllerMirrors(controller.open, MonotonicClock())
        mirrors.connect()
        for kind in kinds:
            for skip in SKIPS:
                for damage_line in (controller.damage_to_device, controller.damage_to_host):
                    _undisturbed_ping_ms(mirrors, _aside(20.0))
                    damage_line(LineDamage(kind=kind, skip=skip))
                    if _noticed(damages, mirrors, controller):
                        controller.status()
                        damages.parked &= _at_rest(cables)
                    controller.heal()
        mirrors.close()


def _undisturbed_ping_ms(
    mirrors: ControllerMirrors, position: StereoVolts | None = None, *, late: int = LATE_PINGS
) -> float:
    """Return the round trip of a ping on a line without damage, after steering to `position`, if any.

    Raise Timeout after more than `late` late answers; one alone shows that this machine stood still.
    """
    if position is not None:  # again after a late answer, which parks the mirrors
        mirrors.steer(position)
    try:
        return mirrors.ping()
    except Timeout:
        if not late:
            raise
    return _undisturbed_ping_ms(mirrors, position, late=late - 1)


def _noticed(damages: _Damages, mirrors: ControllerMirrors, controller: ControllerProcess) -> bool:
    """Ping, and reconnect if the driver has given up; return whether the damage was noticed."""
    began_s = time.perf_counter()
    try:
        mirrors.ping()
    except (Timeout, NotConnected):
        damages.times_s.append(time.perf_counter() - began_s)
        if mirrors.state.connected:
            damages.recovered += 1
        else:
            damages.reported += 1
            controller.power_cycle()
            mirrors.connect()
        return True
    damages.absorbed += 1
    return False


def _aside(x_v: float) -> StereoVolts:
    return StereoVolts(left=MirrorVolts(x_v=x_v, y_v=-x_v), right=MirrorVolts(x_v=-x_v, y_v=x_v))


def _at_rest(cables: RecordingCables) -> bool:
    plus, minus = cables.codes[0::2], cables.codes[1::2]
    return plus == minus and all(plus)
