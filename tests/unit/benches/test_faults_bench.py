"""The bench of faults: its figures are those of the far end, and they turn bad when something is bad."""

import pytest

from foveacam_bench.faults import all_kinds, false_positions, limits
from foveacam_bench.faults.positioner_trial import KINDS, PositionerTrial
from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_bench.faults.trial_checks import FalsePosition
from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.drivers.controller import commanded_position as controller_targets
from foveacam_hardware.drivers.positioners import grbl_board

REST = (29_490,) * 8


def test_senseless_commands_never_leave_the_limits_and_are_refused_in_words() -> None:
    tally = FaultTally()

    figures = limits.measure(tally, True)

    assert tally.limit_violations == 0
    assert figures["command_sequences"] == 500
    assert figures["commands_refused"] > 100
    assert figures["commands_unforeseen"] == 0


def test_a_driver_without_limits_would_be_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(controller_targets, "check_limits", lambda *_args, **_kwargs: None)
    tally = FaultTally()

    limits.measure(tally, True)

    assert tally.limit_violations > 0


@pytest.mark.parametrize(
    ("codes", "violations"),
    [
        (REST, 0),
        ((0,) * 8, 0),  # no power
        ((29_490 + 27_852, 29_490 - 27_852, *REST[2:]), 0),  # 170 V
        ((29_490 + 27_853, 29_490 - 27_853, *REST[2:]), 1),
        ((29_490 + 28_000, 29_490 + 28_000, *REST[2:]), 1),  # no difference, but far from the bias
        ((*REST[:7], 65_535), 1),
    ],
)
def test_drives_outside_the_limits_are_counted(codes: tuple[int, ...], violations: int) -> None:
    cables = LimitCables(MirrorLimits())

    cables.set_codes(0, codes)

    assert cables.violations == violations


def test_the_tally_takes_faults_of_every_part() -> None:
    tally = FaultTally()
    for detected_s, recovered_s, parked in ((0.5, 1.0, True), (None, 0.1, True), (0.9, None, False)):
        tally.add_fault(kind="cut", detected_s=detected_s, recovered_s=recovered_s, parked=parked)
    tally.add_sequence()

    figures = tally.figures()

    assert (figures["sequences"], figures["faults"], figures["absorbed"]) == (1, 3, 1)
    assert (figures["detected_p95_s"], figures["recovered_p95_s"]) == (0.9, 1.0)
    assert (figures["hangs"], figures["unparked"]) == (1, 1)


def test_every_part_of_the_bench_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    def part(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
        tally.add_sequence()
        return {"quick": quick}

    monkeypatch.setattr(all_kinds, "PARTS", (part, part))

    figures = all_kinds.run(quick=True)

    assert figures["sequences"] == 2
    assert figures["quick"] is True


def test_no_positioner_and_no_mirror_claims_a_false_position() -> None:
    tally = FaultTally()

    figures = false_positions.measure(tally, True)

    assert (figures["false_homed"], figures["false_volts"], tally.hangs) == (0, 0, 0)
    assert (figures["false_homed_runs"], figures["false_volts_runs"]) == (25, 10)


def test_a_board_that_is_believed_to_run_on_would_be_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grbl_board, "has_mark", lambda *_: True)
    kind = next(kind for kind in KINDS if kind.name == "grbl without switches")
    trial = PositionerTrial(kind)
    trial.connect()
    trial.confirm_zero()
    trial.move(0.5)
    trial.wait(3.0)

    trial.unplug()
    trial.check()
    trial.plug()
    trial.connect()

    with pytest.raises(FalsePosition, match=r"it reports \(0.0, 0.0\), and stands at"):
        trial.check()
