"""Of suggested targets, those are kept on which both foveae verge."""

from collections.abc import Iterator

import pytest

from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.suggest import Suggestion, suggest_targets
from foveacam_pipeline.verge.values import Basis, PixelTarget
from foveacam_pipeline.verge.verify_suggestions import verified_targets
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras
from foveacam_server.rig.encoder import eight_bit

CARD = Suggestion(x_px=740.0, y_px=700.0, score=1.0)
"""On the grey card, which has no texture."""
POSTER = Suggestion(x_px=960.0, y_px=230.0, score=0.5)
CALIBRATION = load_calibration(SHIPPED / "sim-rig120.json")


@pytest.fixture(scope="module")
def bench_rig() -> Iterator[Rig]:
    warm_up()
    with open_simulated(scene="bench", inline=True) as rig:
        bin_cameras(rig, 2)
        yield rig


def verified(rig: Rig, *suggested: Suggestion, count: int = 3, seconds: float = 60.0) -> list[Suggestion]:
    until_ns = rig.clock.now_ns() + round(1e9 * seconds)
    found = verified_targets(
        rig.head, CALIBRATION, suggested, clock=rig.clock, count=count, until_ns=until_ns
    )
    return list(found)


def test_a_place_without_texture_is_left_out(bench_rig: Rig) -> None:
    assert verified(bench_rig, CARD, POSTER) == [POSTER]


def test_no_more_than_asked_for_are_looked_at_and_none_after_the_time(bench_rig: Rig) -> None:
    assert verified(bench_rig, POSTER, POSTER, count=1) == [POSTER]
    assert verified(bench_rig, POSTER, seconds=0.0) == []


def test_what_is_verified_is_answered_by_both_foveae(bench_rig: Rig) -> None:
    picture = eight_bit(bench_rig.wide.read().image, bits=8)
    suggested = suggest_targets(picture, CALIBRATION, count=10)
    found = verified(bench_rig, *suggested)
    assert len(found) == 3
    for place in found:
        target = PixelTarget(x_px=place.x_px, y_px=place.y_px)
        answer = fixate(bench_rig.head, CALIBRATION, target, clock=bench_rig.clock)
        assert answer.basis is Basis.BOTH_FOVEAE, answer.reason
