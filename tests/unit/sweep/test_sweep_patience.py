"""When a sweep gives an eye up: soon where it never saw its marker, late at the rim of the field."""

import pytest

from foveacam_hardware.contract import InvalidInput, OutOfRange, PanTiltPose, Station, StationTarget
from foveacam_pipeline.calibrate.sweep.centring import BEYOND
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepHeader, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_run import SingleEyeLimit
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings

COLUMNS, FEW = 4, 3
SETTINGS = SweepSettings(rig_id="sim", created_utc="", give_up_after=FEW)
HEADER = SweepHeader(
    rig_id="sim",
    created_utc="",
    station=Station(
        name="markers", target=StationTarget.MARKERS, pose=PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
    ),
    layout=MarkerLayout(),
    plan=SweepPlan(columns=COLUMNS, rows=3),
    wide_size=(1440, 1080),
    fovea_size=(1440, 1080),
    max_v=170.0,
)


def pose(refused_left: str | None) -> SweepPose:
    return SweepPose(
        index=0,
        node_rad=(0.0, 0.0),
        pan_tilt=None,
        t_ns=0,
        wide={},
        left=None,
        right=None,
        left_refusal=refused_left,
    )


def poses_until_given_up(patience: SingleEyeLimit, refused_left: str) -> int:
    for times in range(1, 100):
        try:
            patience.check(pose(refused_left))
        except (InvalidInput, OutOfRange):
            return times
    raise AssertionError("it never was")


@pytest.mark.parametrize(
    ("refusal", "times"), [("marker 1 is not in view", FEW), (f"{BEYOND}: 183 V", 2 * COLUMNS)]
)
def test_an_eye_that_never_measured_is_given_up_soon_unless_it_is_only_out_of_reach(
    refusal: str, times: int
) -> None:
    assert poses_until_given_up(SingleEyeLimit(Sweep(header=HEADER), SETTINGS), refusal) == times


def test_an_eye_that_measured_once_has_two_rows_again_after_each_pose_that_it_measures() -> None:
    patience = SingleEyeLimit(Sweep(header=HEADER), SETTINGS)
    patience.check(pose(None))
    for _ in range(2):
        for _ in range(2 * COLUMNS - 1):
            patience.check(pose("blurred"))
        patience.check(pose(None))

    assert poses_until_given_up(patience, "blurred") == 2 * COLUMNS


def test_what_is_out_of_reach_is_told_as_such_with_the_eye_and_how_often() -> None:
    patience = SingleEyeLimit(Sweep(header=HEADER), SETTINGS)
    with pytest.raises(OutOfRange, match=r"the left eye was refused at 8 poses in a row.*183 V"):
        for _ in range(2 * COLUMNS):
            patience.check(pose(f"{BEYOND}: 183 V"))
