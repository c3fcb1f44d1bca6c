"""The Mirrors contract, on the controller's driver: in process on simulated time, on a pty, and on a port."""

import logging
import threading
from collections.abc import Callable

import pytest
from tests.support.devices.controllers import PATIENT, Controllers
from tests.support.devices.mirror_benches import Bench, Make, bench, controllers, make

from foveacam_hardware.contract import (
    PARKED,
    Busy,
    DeviceFault,
    FoveaError,
    Mirrors,
    MirrorVolts,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    Role,
    StereoVolts,
    Stopped,
)
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables

__all__ = ["bench", "controllers", "make"]

REST = (29490,) * 8
ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-10.0, y_v=5.0))
HALF_STEP_V = 200 / 65_535 / 2 + 1e-9
SETTLE_US, PULSE_US = 10_000, 4000
JITTER_US = 1000
"""A controller keeps its times by a loop, and one in a simulator by its host's scheduler."""


def test_the_driver_is_mirrors(bench: Bench) -> None:
    mirrors: Mirrors = bench.mirrors

    assert mirrors.info.version.startswith("2.")
    assert mirrors.limits.max_v == 170.0


def test_connect_ends_enabled_and_parked_with_bias_and_filter_in_force(bench: Bench) -> None:
    state = bench.mirrors.state

    assert (state.connected, state.enabled, state.volts, state.fault) == (True, True, PARKED, None)
    assert bench.shows(lambda pins: pins.drives[0][1] == pins.codes == REST)
    assert bench.shows(lambda pins: pins.rail_on)
    assert bench.shows(lambda pins: pins.cutoff_hz == 120)


def test_connecting_again_changes_nothing(bench: Bench) -> None:
    bench.mirrors.steer(ASIDE)
    bench.mirrors.connect()

    assert bench.mirrors.state.volts != PARKED
    assert bench.shows(lambda pins: pins.rails[1:] == [])


def test_steer_moves_the_mirrors_to_the_volts_it_returns(bench: Bench) -> None:
    actual = bench.mirrors.steer(ASIDE)

    def differences(pins: RecordingCables) -> list[float]:
        return [(pins.codes[i] - pins.codes[i + 1]) * 200 / 65_535 for i in (0, 2, 4, 6)]

    told = [actual.left.x_v, actual.left.y_v, actual.right.x_v, actual.right.y_v]
    assert told == pytest.approx([10.0, -20.0, -10.0, 5.0], abs=HALF_STEP_V)
    assert bench.mirrors.state.volts == actual
    assert bench.shows(lambda pins: differences(pins) == pytest.approx(told, abs=1e-12))


def test_a_move_from_before_a_park_is_refused_and_moves_nothing(bench: Bench) -> None:
    before = bench.mirrors.state.parks
    bench.mirrors.steer(ASIDE, unless_parked_since=before)

    bench.mirrors.park()
    with pytest.raises(Stopped, match="parked meanwhile"):
        bench.mirrors.steer(ASIDE, unless_parked_since=before)

    assert bench.mirrors.state.parks == before + 1
    assert bench.mirrors.state.volts == PARKED
    assert bench.shows(lambda pins: pins.codes == REST)
    bench.mirrors.steer(ASIDE, unless_parked_since=before + 1)


def test_switching_on_and_off_counts_as_a_park(bench: Bench) -> None:
    before = bench.mirrors.state.parks
    bench.mirrors.disable()
    bench.mirrors.enable()
    with pytest.raises(Stopped):
        bench.mirrors.steer(ASIDE, unless_parked_since=before)


def test_an_exposure_is_told_until_it_is_over(bench: Bench) -> None:
    pending = bench.mirrors.begin_exposure(ASIDE, settle_us=SETTLE_US, pulse_us=PULSE_US)
    assert bench.mirrors.state.exposing

    pending.wait()

    assert not bench.mirrors.state.exposing


def test_two_exposures_may_be_under_way_and_a_third_is_refused_before_anything_moves(bench: Bench) -> None:
    places = [ASIDE, StereoVolts(left=ASIDE.right, right=ASIDE.left)]
    begun = [bench.mirrors.begin_exposure(volts, settle_us=SETTLE_US, pulse_us=PULSE_US) for volts in places]

    with pytest.raises(Busy, match=r"while 2 are under way.*wait for the end of one"):
        bench.mirrors.begin_exposure(PARKED, settle_us=SETTLE_US, pulse_us=PULSE_US)

    receipts = [exposure.wait() for exposure in begun]
    for receipt, volts in zip(receipts, places, strict=True):
        assert receipt.volts.left.x_v == pytest.approx(volts.left.x_v, abs=HALF_STEP_V)
    assert bench.mirrors.expose(PARKED, settle_us=SETTLE_US, pulse_us=PULSE_US).volts == PARKED


def test_recover_starts_the_dacs_anew_and_the_mirrors_stand_where_they_were(bench: Bench) -> None:
    actual = bench.mirrors.steer(ASIDE)
    assert bench.shows(lambda pins: pins.codes != REST)

    bench.mirrors.recover()

    assert (bench.mirrors.state.enabled, bench.mirrors.state.volts) == (True, actual)
    assert bench.mirrors.expose(ASIDE, settle_us=0, pulse_us=PULSE_US).volts == actual
    assert bench.shows(lambda pins: {codes for _, codes in pins.drives} == {REST, pins.codes})
    assert bench.shows(lambda pins: pins.codes != REST and pins.rails == pins.rails[:1])


def test_telemetry_tells_rates_round_trips_and_streams(bench: Bench) -> None:
    for step in range(20):
        bench.mirrors.steer(ASIDE if step % 2 else PARKED)
        bench.mirrors.ping()

    found = bench.mirrors.telemetry

    assert found.tx_packets > 40
    assert found.rtt_p50_ms <= found.rtt_p95_ms <= found.rtt_max_ms
    assert [stream.stream for stream in found.streams] == [0, 1]
    assert found.streams[0].volts == bench.mirrors.state.volts
    assert 60.0 <= found.update_limit_hz <= 1000.0
    assert found.lost_answers == found.bad_packets == 0


def test_a_receipt_tells_when_the_exposure_began_and_the_volts_in_force(bench: Bench) -> None:
    actual = bench.mirrors.steer(ASIDE)
    bench.mirrors.steer(PARKED)
    asked_ns = bench.clock.now_ns()

    first = bench.mirrors.expose(ASIDE, settle_us=SETTLE_US, pulse_us=PULSE_US)
    second = bench.mirrors.expose(PARKED, settle_us=SETTLE_US, pulse_us=PULSE_US)

    doubt_ns = bench.mirrors.telemetry.rtt_max_ms * 1e6 + 1000
    assert asked_ns + SETTLE_US * 1000 - doubt_ns <= first.t_trigger_ns <= bench.clock.now_ns() + doubt_ns
    for receipt in (first, second):
        late_ns = receipt.t_exposure_start_ns - receipt.t_trigger_ns
        assert 0 <= late_ns <= JITTER_US * 1000  # not the middle of 5 ms
    assert second.frame_id == first.frame_id + 1
    assert (first.volts, second.volts) == (actual, PARKED)


def test_expose_moves_settles_and_triggers(bench: Bench) -> None:
    actual = bench.mirrors.steer(ASIDE)
    bench.mirrors.steer(PARKED)

    receipt = bench.mirrors.expose(ASIDE, settle_us=SETTLE_US, pulse_us=PULSE_US)

    cables = bench.seen()
    (edge,) = cables.triggers
    moved_ns = next(t_ns for t_ns, codes in reversed(cables.drives) if codes != REST)
    assert edge.cameras == 6
    assert edge.pulse_us == pytest.approx(PULSE_US, abs=JITTER_US)
    assert 0 <= (edge.t_ns - moved_ns) / 1e3 - SETTLE_US <= JITTER_US
    # The clocks are mapped by the best of several pings: wrong by half a round trip at most, and 1 µs.
    doubt_ns = bench.mirrors.telemetry.rtt_p99_ms * 0.5e6 + 1000
    assert receipt.t_trigger_ns == pytest.approx(edge.t_ns, abs=doubt_ns)
    assert receipt.volts == actual == bench.mirrors.state.volts


def test_every_exposure_waits_for_the_mirrors_unless_they_already_stand(bench: Bench) -> None:
    for volts in (ASIDE, PARKED, ASIDE):
        bench.mirrors.expose(volts, settle_us=SETTLE_US, pulse_us=PULSE_US)
        drives, triggers = bench.cables.drives, bench.seen().triggers
        assert triggers[-1].t_ns - drives[-1][0] >= SETTLE_US * 1000

    bench.clock.sleep_until_ns(bench.clock.now_ns() + SETTLE_US * 1000)
    drives_before = len(bench.seen().drives)
    bench.mirrors.expose(ASIDE, settle_us=SETTLE_US, pulse_us=PULSE_US)
    assert len(bench.seen().drives) == drives_before


def test_ordinary_work_never_trips_the_faults_of_a_strict_controller(bench: Bench) -> None:
    for step in range(60):
        volts = StereoVolts(
            left=MirrorVolts(x_v=step, y_v=-step), right=MirrorVolts(x_v=-step, y_v=2.5 * step)
        )
        for _ in range(6):
            bench.mirrors.steer(volts)
        bench.mirrors.expose(volts, settle_us=200, pulse_us=PULSE_US)
        bench.mirrors.ping()
    bench.mirrors.park()
    bench.mirrors.disable()
    bench.mirrors.enable()

    assert bench.mirrors.telemetry.bad_packets == 0
    status = bench.controller.status()
    assert (status.dead, status.malformed, status.enabled) == (False, 0, True)


def test_park_brings_both_mirrors_to_rest(bench: Bench) -> None:
    bench.mirrors.steer(ASIDE)

    bench.mirrors.park()

    assert bench.mirrors.state.volts == PARKED
    assert bench.shows(lambda pins: pins.codes == REST)


def test_park_confirmed_returns_once_the_controller_has_acknowledged(bench: Bench) -> None:
    bench.mirrors.steer(ASIDE)
    received = bench.mirrors.telemetry.rx_packets

    bench.mirrors.park_confirmed(within_s=1.0)

    assert bench.mirrors.telemetry.rx_packets > received
    assert bench.mirrors.state.volts == PARKED
    assert bench.shows(lambda pins: pins.codes == REST)


def test_park_confirmed_with_the_rail_off_needs_no_acknowledgement(bench: Bench) -> None:
    bench.mirrors.disable()

    bench.mirrors.park_confirmed(within_s=1.0)

    assert bench.shows(lambda pins: not pins.rail_on)


def test_steer_after_an_exposure_moves_the_stream_that_is_on_the_mirrors(bench: Bench) -> None:
    bench.mirrors.expose(ASIDE, settle_us=0, pulse_us=PULSE_US)
    bench.mirrors.steer(PARKED)
    assert bench.shows(lambda pins: pins.codes == REST)

    assert bench.mirrors.expose(PARKED, settle_us=0, pulse_us=PULSE_US).volts == PARKED
    bench.mirrors.steer(ASIDE)
    assert bench.shows(lambda pins: pins.codes != REST)


def test_disable_switches_the_rail_off_and_enable_on_again(bench: Bench) -> None:
    bench.mirrors.steer(ASIDE)
    bench.mirrors.disable()

    assert not bench.mirrors.state.enabled
    assert bench.mirrors.state.volts == PARKED
    with pytest.raises(DeviceFault, match="enable the mirrors first"):
        bench.mirrors.steer(ASIDE)
    bench.mirrors.enable()
    bench.mirrors.steer(ASIDE)
    assert bench.shows(lambda pins: [on for _, on in pins.rails] == [True, False, True])
    assert bench.shows(lambda pins: pins.codes != REST)


def test_close_parks_switches_off_and_ends_the_reader(bench: Bench) -> None:
    bench.mirrors.steer(ASIDE)

    bench.mirrors.close()
    bench.mirrors.close()

    assert not [thread for thread in threading.enumerate() if thread.name == "controller-reader"]
    with pytest.raises(NotConnected, match="connect again"):
        bench.mirrors.steer(ASIDE)
    assert bench.shows(lambda pins: not pins.rail_on and pins.codes == REST)


def test_before_connect_nothing_works_and_everything_says_why(make: Make) -> None:
    mirrors = make((2, 1, 0)).mirrors

    actions: list[Callable[[], object]] = [
        mirrors.enable,
        mirrors.disable,
        mirrors.park,
        mirrors.ping,
        lambda: mirrors.steer(PARKED),
        lambda: mirrors.expose(PARKED, settle_us=0, pulse_us=1),
    ]
    for action in actions:
        with pytest.raises(NotConnected, match="not connected"):
            action()
    assert not mirrors.state.connected
    assert mirrors.telemetry.tx_packets == 0


@pytest.mark.parametrize(("settle_us", "pulse_us"), [(0, 0), (0, -5), (-1, 100), (2**32, 100), (0, 2**32)])
def test_times_that_cannot_be_are_refused(bench: Bench, settle_us: int, pulse_us: int) -> None:
    with pytest.raises(OutOfRange, match="µs"):
        bench.mirrors.expose(PARKED, settle_us=settle_us, pulse_us=pulse_us)


def test_a_missing_strobe_is_told_in_the_controllers_words_and_the_next_frame_works(bench: Bench) -> None:
    bench.cables.exposure_us[Role.RIGHT] = None
    with pytest.raises(DeviceFault, match=r"Strobe timeout.*strobe cables"):
        bench.mirrors.expose(ASIDE, settle_us=0, pulse_us=PULSE_US)
    bench.cables.exposure_us[Role.RIGHT] = 5000

    receipt = bench.mirrors.expose(PARKED, settle_us=SETTLE_US, pulse_us=PULSE_US)

    assert receipt.volts == PARKED
    cables = bench.seen()
    assert cables.triggers[-1].t_ns - cables.drives[-1][0] >= SETTLE_US * 1000
    bench.mirrors.steer(ASIDE)
    assert bench.seen().codes != REST


def test_telemetry_counts_the_traffic(bench: Bench) -> None:
    before = bench.mirrors.telemetry
    for _ in range(10):
        bench.mirrors.ping()
        bench.mirrors.steer(PARKED)

    # Each ping but the first also has the silent update before it confirmed.
    after = bench.mirrors.telemetry
    assert after.tx_packets - before.tx_packets == 29
    assert after.rx_packets - before.rx_packets == 19
    assert after.tx_bytes - before.tx_bytes > 20 * 6
    assert after.rx_bytes - before.rx_bytes > 10 * 6
    assert 0 <= after.rtt_p50_ms <= after.rtt_p99_ms


def test_log_pushes_reach_the_log(make: Make, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="foveacam_hardware"):
        make((2, 1, 0)).mirrors.connect()

    assert [said for said in caplog.messages if said.startswith("controller: [INFO]")]


def test_before_2_steering_goes_by_actuate_and_exposures_are_refused(make: Make) -> None:
    bench = make((1, 1, 0))
    bench.mirrors.connect()

    actual = bench.mirrors.steer(ASIDE)
    assert bench.mirrors.state.volts == actual
    assert bench.seen().codes != REST
    with pytest.raises(DeviceFault, match=r"1\.1\.0 has no triggered exposures"):
        bench.mirrors.expose(ASIDE, settle_us=0, pulse_us=PULSE_US)
    bench.mirrors.park()
    assert bench.seen().codes == REST
    bench.mirrors.close()
    assert bench.controller.status().malformed == 0


def test_before_1_1_pings_work_without_a_clock(make: Make) -> None:
    bench = make((1, 0, 0))
    bench.mirrors.connect()

    assert bench.mirrors.ping() >= 0
    assert bench.mirrors.telemetry.clock_offset_ns == 0


def test_firmware_of_the_future_is_refused_and_nothing_stays_open(make: Make) -> None:
    bench = make((3, 0, 0))

    with pytest.raises(DeviceFault, match=r"3\.0 is newer"):
        bench.mirrors.connect()

    assert not bench.mirrors.state.connected
    assert "newer" in (bench.mirrors.state.fault or "")
    bench.controller.status()
    assert bench.cables.rails == []
    assert not [thread for thread in threading.enumerate() if thread.name == "controller-reader"]


def test_a_failed_start_is_undone(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = make((2, 1, 0))

    def refuse(*_: object) -> None:
        raise DeviceFault("streams are out of order")

    with monkeypatch.context() as patched, pytest.raises(DeviceFault, match="out of order"):
        patched.setattr(
            "foveacam_hardware.drivers.controller.requests.ControllerRequests.create_streams", refuse
        )
        bench.mirrors.connect()

    bench.controller.status()
    assert [on for _, on in bench.cables.rails] == [True, False]
    assert not bench.mirrors.state.connected
    bench.mirrors.connect()
    assert bench.mirrors.state.enabled
    assert bench.mirrors.state.fault is None


def test_a_controller_found_enabled_is_switched_off_and_started_properly(make: Make) -> None:
    bench = make((2, 1, 0))
    bench.mirrors.connect()
    bench.mirrors.steer(ASIDE)
    dialogue = bench.mirrors._requests
    assert dialogue is not None
    dialogue.session.close()  # as a host does that was killed

    bench.mirrors.connect()

    assert bench.mirrors.state.volts == PARKED
    cables = bench.seen()
    assert [on for _, on in cables.rails] == [True, False, True]
    off_ns = next(t_ns for t_ns, on in cables.rails if not on)
    assert all(codes == REST for t_ns, codes in cables.drives if t_ns >= off_ns)


def test_a_second_driver_is_told_that_the_port_is_held(controllers: Controllers) -> None:
    process = controllers.fresh(RecordingCables(), strict=False)
    first = ControllerMirrors(process.open, MonotonicClock(), supervision=PATIENT)
    first.connect()
    second = ControllerMirrors(process.open, MonotonicClock(), supervision=PATIENT)
    with pytest.raises(NotConnected, match="held by another program"):
        second.connect()
    assert "held" in (second.state.fault or "")
    first.steer(ASIDE)
    first.close()
    second.connect()
    second.close()


def test_errors_of_the_driver_are_of_the_one_tree(bench: Bench) -> None:
    bench.controller.power_cycle()
    with pytest.raises(FoveaError, match="restarted"):
        bench.mirrors.expose(ASIDE, settle_us=0, pulse_us=PULSE_US)
    assert not bench.mirrors.state.connected
