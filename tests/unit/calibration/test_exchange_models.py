"""The authors' records as our measurements and models, and ours as theirs."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.exchange_rig import F_PX, GAIN, SIZE, WIDE, Bench

from foveacam_hardware.contract import InvalidInput, MirrorVolts, Role
from foveacam_pipeline.calibrate.exchange import (
    ExchangeRecord,
    ImportedRig,
    NominalOptics,
    RigSettings,
    bundle_of,
    extrinsic_record,
    intrinsic_record,
    intrinsics_of,
    record_of,
    rig_sweep_of,
    settings_of,
)
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.intrinsic import typed_array
from foveacam_pipeline.calibrate.fit.fit import fit_calibration
from foveacam_pipeline.models import Calibration

CREATED = "2026-02-01T10:00:00+00:00"
RIG = ImportedRig(rig_id="lab-1", fovea_size=SIZE, distance_m=5.0)


@pytest.fixture(scope="module")
def records() -> tuple[ExchangeRecord, ExchangeRecord]:
    sweep = Bench().sweep()
    left, right = (extrinsic_record(sweep, role, wide=WIDE) for role in (Role.LEFT, Role.RIGHT))
    return left, right


@pytest.fixture(scope="module")
def calibration(records: tuple[ExchangeRecord, ExchangeRecord]) -> Calibration:
    return fit_calibration(rig_sweep_of(*records, wide=WIDE, rig=RIG, optics=NominalOptics(pupil_m=0.0)))


def edited(record: ExchangeRecord, pose: int, **changes: Json) -> ExchangeRecord:
    dataset = record.inner["dataset"]
    assert isinstance(dataset, list)
    points = [dict(point) for point in dataset]
    points[pose].update(changes)
    points[pose] = {key: value for key, value in points[pose].items() if value is not None}
    return replace(record, inner={**record.inner, "dataset": points})


def solved(**changes: Json) -> ExchangeRecord:
    record = intrinsic_record(WIDE, created_utc=CREATED)
    solve = record.inner["calibration"]
    assert isinstance(solve, dict)
    return replace(record, inner={"kind": "intrinsic", "calibration": {**solve, **changes}})


def test_intrinsics_survive_there_and_back_to_the_bit() -> None:
    record = intrinsic_record(WIDE, created_utc=CREATED, rms_px=0.31, views=[([0.1, 0.2, 0.3], [1, 2, 3])])
    assert intrinsics_of(record, size=SIZE) == WIDE
    assert record.intrinsic().calibration.rms == 0.31


def test_rational_distortion_survives_too() -> None:
    rational = replace(WIDE, distortion=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8))
    assert intrinsics_of(intrinsic_record(rational, created_utc=CREATED)) == rational


def test_intrinsics_of_an_older_recording_are_plain_lists() -> None:
    record = solved(camera_matrix=WIDE.matrix.ravel().tolist(), dist_coeffs=list(WIDE.distortion))
    assert intrinsics_of(record) == WIDE


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"camera_matrix": typed_array(np.eye(2))}, "is no camera's"),
        ({"camera_matrix": typed_array(np.diag([-1.0, 1.0, 1.0]))}, "is no camera's"),
        ({"dist_coeffs": typed_array(np.zeros((1, 6)))}, "6 distortion coefficients"),
        ({"dist_coeffs": {**typed_array(np.zeros((1, 5))), "buffer": "AAAA"}}, "the buffer holds 3"),
        ({"dist_coeffs": {**typed_array(np.zeros((1, 5))), "buffer": "%"}}, "not base64"),
        ({"dist_coeffs": typed_array(np.full((1, 5), np.nan))}, "not finite"),
        ({"sensor_size": {"width": 0, "height": 3}}, "sensor_size.width"),
    ],
)
def test_a_solve_that_cannot_be_is_refused(changes: dict[str, Json], sentence: str) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        intrinsics_of(solved(**changes))


def test_the_solve_of_another_camera_is_refused() -> None:
    with pytest.raises(InvalidInput, match="of 1440 x 1080 px, this one has 640 x 480"):
        intrinsics_of(intrinsic_record(WIDE, created_utc=CREATED), size=(640, 480))


def test_a_record_in_the_wrong_place_is_refused(records: tuple[ExchangeRecord, ExchangeRecord]) -> None:
    with pytest.raises(InvalidInput, match="is extrinsic, intrinsic is needed"):
        intrinsics_of(records[0])
    with pytest.raises(InvalidInput, match="is of the right camera, one of the left camera is needed"):
        rig_sweep_of(records[1], records[0], wide=WIDE, rig=RIG, optics=NominalOptics())


def test_a_fit_to_records_points_where_the_eyes_look(calibration: Calibration) -> None:
    volts = np.random.default_rng(3).uniform(-140.0, 140.0, (200, 2))
    for role in (Role.LEFT, Role.RIGHT):
        found = np.array(
            [calibration.eye(role).mirror.angles_rad(MirrorVolts(x_v=x, y_v=y)) for x, y in volts]
        )
        miss_px = F_PX * (np.tan(found) - np.tan(volts * GAIN))
        assert (
            float(np.abs(miss_px).max()) < 0.01
        )  # a tenth of what one DAC step moves: nothing here is noisy


def test_records_rectify_rows_onto_rows(calibration: Calibration) -> None:
    centre = np.array([719.5, 539.5, 1.0])
    for ax, ay in ((0.0, 0.0), (0.12, 0.1), (-0.12, 0.08)):
        left, right = (calibration.rectification(r, ax, ay) for r in (Role.LEFT, Role.RIGHT))
        offset = np.array([300.0, 200.0, 0.0])
        assert np.abs((left - right) @ (centre + offset))[1] < 0.05


def test_a_drift_that_was_committed_there_shifts_the_angles(
    records: tuple[ExchangeRecord, ExchangeRecord],
) -> None:
    drift = ((1e-3, -2e-3), (0.0, 0.0))
    plain, shifted = (
        rig_sweep_of(*records, wide=WIDE, rig=RIG, optics=NominalOptics(), drift_rad=d)
        for d in (((0.0, 0.0), (0.0, 0.0)), drift)
    )
    np.testing.assert_allclose(
        shifted.left.angles_rad - plain.left.angles_rad, np.tile(drift[0], (81, 1)), atol=1e-12
    )
    np.testing.assert_array_equal(shifted.right.angles_rad, plain.right.angles_rad)


def test_an_older_recording_is_fitted_by_its_angles_alone(
    records: tuple[ExchangeRecord, ExchangeRecord],
) -> None:
    old = edited(records[0], 5, wide_img_points=None, wide_center_points=None)
    samples = rig_sweep_of(old, records[1], wide=WIDE, rig=RIG, optics=NominalOptics())
    assert len(samples.left.volts_v) == 81


def test_angles_without_a_distance_are_refused(records: tuple[ExchangeRecord, ExchangeRecord]) -> None:
    with pytest.raises(InvalidInput, match="do not say how far away the markers stood"):
        rig_sweep_of(*records, wide=WIDE, rig=replace(RIG, distance_m=None), optics=NominalOptics())


def test_one_record_for_both_eyes_is_refused(records: tuple[ExchangeRecord, ExchangeRecord]) -> None:
    unnamed = replace(records[0], role=None)
    with pytest.raises(InvalidInput, match="was given for both eyes"):
        rig_sweep_of(unnamed, unnamed, wide=WIDE, rig=RIG, optics=NominalOptics())


def test_corners_outside_the_image_are_another_camera_s(
    records: tuple[ExchangeRecord, ExchangeRecord],
) -> None:
    small = replace(RIG, fovea_size=(640, 480))
    with pytest.raises(InvalidInput, match="this fovea has 640 x 480; give the record of this camera"):
        rig_sweep_of(*records, wide=WIDE, rig=small, optics=NominalOptics())


def test_an_empty_record_is_refused(records: tuple[ExchangeRecord, ExchangeRecord]) -> None:
    empty = replace(records[0], inner={"kind": "extrinsic", "dataset": []})
    with pytest.raises(InvalidInput, match="holds no pose"):
        rig_sweep_of(empty, records[1], wide=WIDE, rig=RIG, optics=NominalOptics())


def test_a_bundle_holds_the_whole_rig_and_gives_it_back(calibration: Calibration) -> None:
    near, far = Bench(distance_m=2.5, name="markers near").sweep(), Bench().sweep()
    drift = ((1e-3, 0.0), (0.0, -1e-3))
    settings = RigSettings(nickname="Lab", settle_us=2000.0, drift_rad=drift)
    bundle = bundle_of(calibration, [near, far], settings=settings)
    back = settings_of(bundle)
    assert back.baseline_m == pytest.approx(calibration.baseline_m, rel=1e-12)
    assert replace(back, baseline_m=None) == settings
    assert intrinsics_of(record_of(bundle, Role.WIDE)) == WIDE
    assert record_of(bundle, Role.LEFT).id == extrinsic_record(far, Role.LEFT, wide=WIDE).id


def test_a_calibration_without_its_sweep_has_no_bundle(calibration: Calibration) -> None:
    with pytest.raises(InvalidInput, match="comes without the sweep it was fitted to"):
        bundle_of(calibration, [])


def test_a_sweep_without_a_centred_pose_has_no_record() -> None:
    sweep = Bench().sweep()
    poses = tuple(replace(p, left=replace(p.left, centred=False) if p.left else None) for p in sweep.poses)
    with pytest.raises(InvalidInput, match="left eye has no centred pose to export"):
        extrinsic_record(replace(sweep, poses=poses), Role.LEFT, wide=WIDE)
