"""The sentence of an answer by a fovea and the wide camera names the same eyes as its views do."""

import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge import verdict
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.values import EyeView

POINT = LocatedPoint(
    point_rig_m=(0.0, 0.0, 2.0),
    distance_m=2.0,
    distance_sigma_m=0.01,
)
SEES, TURNED_AWAY = EyeView(sees_target=True), EyeView(sees_target=False, reason=verdict.CANNOT_TURN)
BOTH = {Role.LEFT, Role.RIGHT}


@pytest.mark.parametrize(
    ("roles", "left", "right", "words"),
    [
        (BOTH, SEES, SEES, "by each fovea against the wide view"),
        (
            BOTH,
            TURNED_AWAY,
            SEES,
            "by the right fovea and the wide camera; the left eye cannot turn",
        ),
        (
            BOTH,
            SEES,
            TURNED_AWAY,
            "by the left fovea and the wide camera; the right eye cannot turn",
        ),
        ({Role.RIGHT}, TURNED_AWAY, SEES, "by the right fovea and the wide camera; the left eye cannot turn"),
    ],
)
def test_the_sentence_names_the_eyes_that_its_views_say_see_the_target(
    roles: set[Role], left: EyeView, right: EyeView, words: str
) -> None:
    assert words in verdict.one_eyed(POINT, roles, {Role.LEFT: left, Role.RIGHT: right})
