"""The file of a sweep: what was measured survives, cut-off lines and foreign files do no harm."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import (
    InvalidInput,
    PanTiltLimits,
    PanTiltPose,
    Role,
    Station,
    StationTarget,
)
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepHeader, SweepPose, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import append_pose, load_sweep, read_new_poses, save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import NodeSpacing, SweepPlan, base_pose, check_reach

STATION = Station(
    name="Markers near",
    target=StationTarget.MARKERS,
    pose=PanTiltPose(pan_rad=math.radians(-45.0), tilt_rad=0.02),
    distance_m=2.5,
)


def header(**changes: object) -> SweepHeader:
    given = {
        "rig_id": "sim-rig120",
        "created_utc": "2026-01-01T00:00:00Z",
        "station": STATION,
        "layout": MarkerLayout(),
        "plan": SweepPlan(columns=3, rows=3),
        "wide_size": (1440, 1080),
        "fovea_size": (1440, 1080),
        "max_v": 170.0,
    }
    return SweepHeader(**{**given, **changes})  # type: ignore[arg-type] # values of mixed types by name


def pose(index: int, *, seed: int = 0) -> SweepPose:
    rng = np.random.default_rng([seed, index])

    def view(marker_id: int) -> MarkerView:
        corners, places = rng.normal(700.0, 100.0, (9, 2)), rng.normal(0.0, 0.03, (9, 2))
        return MarkerView(
            id=marker_id, corners_px=corners, places_m=places, sharpness=0.7, complete=True, sigma_px=0.01
        )

    volts = (float(rng.normal()), float(rng.normal()))
    return SweepPose(
        index=index,
        node_rad=(0.1, -0.05),
        pan_tilt=PanTiltPose(pan_rad=float(rng.normal()), tilt_rad=0.1),
        t_ns=123_456_789_012,
        wide={0: view(0), 1: view(1), 2: view(2)},
        left=EyePose(volts_v=volts, corners=view(1), centred=True, rim=False, looks=2),
        right=None,
        right_refusal="marker 2 is covered",
    )


def test_new_poses_of_a_growing_file_are_read_once_each_and_a_cut_off_line_is_not_one(tmp_path: Path) -> None:
    path = tmp_path / sweep_filename(STATION)
    save_sweep(Sweep(header=header(), poses=(pose(0), pose(1))), path)
    with path.open("ab") as stream:
        stream.write(b'{"index": 2')
    first, next_byte = read_new_poses(path, start_byte=0)
    append_pose(path, pose(3))
    second, end_byte = read_new_poses(path, start_byte=next_byte)
    assert [found.index for found in first] == [0, 1]
    assert [found.index for found in second] == [3]
    assert read_new_poses(path, start_byte=end_byte) == ([], path.stat().st_size)


def test_a_sweep_comes_back_from_its_file_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / sweep_filename(STATION)
    save_sweep(Sweep(header=header()), path)
    append_pose(path, pose(0))
    append_pose(path, pose(4))

    found = load_sweep(path)

    assert path.name == "sweep-markers-near.jsonl"
    assert found.header == header()
    assert [p.index for p in found.poses] == [0, 4]
    assert found.missing == (1, 2, 3, 5, 6, 7, 8)
    assert [p.binning for p in found.poses] == [1, 1]
    wanted, read = pose(4), found.poses[1]
    assert read.left is not None and wanted.left is not None
    assert read.left.volts_v == wanted.left.volts_v
    assert np.array_equal(read.left.corners.corners_px, wanted.left.corners.corners_px)
    assert np.array_equal(read.wide[2].places_m, wanted.wide[2].places_m)
    assert read.refusal(Role.RIGHT) == "marker 2 is covered"
    assert [p.index for p in found.accepted(Role.RIGHT)] == []


def test_a_pose_keeps_the_binning_that_it_was_measured_at(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(0),)), path)
    append_pose(path, replace(pose(1), binning=2))
    before = path.read_bytes()
    path.write_bytes(before.replace(b',"binning":1', b""))  # as written before cameras could bin

    assert path.read_bytes() != before
    assert [found.binning for found in load_sweep(path).poses] == [1, 2]


def test_a_line_that_was_cut_off_is_left_out_and_the_next_pose_follows_the_whole_ones(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(0), pose(1))), path)
    path.write_bytes(path.read_bytes()[:-100])
    assert [p.index for p in load_sweep(path).poses] == [0]

    append_pose(path, pose(2))

    assert [p.index for p in load_sweep(path).poses] == [0, 2]


def test_visits_that_repeat_a_node_are_kept_in_the_order_of_measuring(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(4),)), path)
    for index, repeat in ((4, 1), (0, 1), (4, 2)):
        append_pose(path, replace(pose(index, seed=repeat), repeat=repeat, run="2026-01-01T00:00:00.000Z"))
    append_pose(path, pose(0))

    found = load_sweep(path)

    assert [p.index for p in found.poses] == [0, 4]
    assert [(p.index, p.repeat) for p in found.repeats] == [(4, 1), (0, 1), (4, 2)]
    assert {p.run for p in found.repeats} == {"2026-01-01T00:00:00.000Z"}
    assert (found.next_repeat(4), found.next_repeat(7)) == (3, 1)
    save_sweep(found, tmp_path / "again.jsonl")
    assert [p.repeat for p in load_sweep(tmp_path / "again.jsonl").repeats] == [1, 1, 2]


def test_a_file_from_before_visits_were_made_still_loads(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(0), pose(1))), path)
    lines = [json.loads(line) for line in path.read_bytes().splitlines()]
    for line in lines[1:]:
        del line["repeat"], line["run"]
    path.write_bytes(b"".join(json.dumps(line).encode() + b"\n" for line in lines))

    found = load_sweep(path)

    assert [(p.index, p.repeat, p.run) for p in found.poses] == [(0, 0, ""), (1, 0, "")]
    assert found.repeats == ()


def test_the_last_measurement_of_a_pose_counts(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(3),)), path)
    append_pose(path, pose(3, seed=1))

    (found,) = load_sweep(path).poses

    assert found.left is not None
    assert found.left.volts_v == pose(3, seed=1).left.volts_v  # type: ignore[union-attr] # it has one


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "ends before its header"),
        (b'{"format":"foveacam-cali', "ends before its header"),
        (b'{"format":"foveacam-calibration","version":2}\n', "foveacam-calibration version 2 was found"),
        (b"\x89PNG\n\n", "None version None was found"),
        (b'{"format":"foveacam-sweep","version":1,"header":{}}\n', "line 1: header.rig_id"),
    ],
)
def test_a_file_that_is_no_sweep_is_refused_by_name(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "sweep.jsonl"
    path.write_bytes(content)

    with pytest.raises(InvalidInput, match=message):
        load_sweep(path)


def test_a_damaged_line_in_the_middle_is_named(tmp_path: Path) -> None:
    path = tmp_path / "sweep.jsonl"
    save_sweep(Sweep(header=header(), poses=(pose(0), pose(1))), path)
    lines = path.read_bytes().splitlines(keepends=True)
    damaged = json.loads(lines[1])
    damaged["left"]["volts_v"] = [1.0, "much"]
    path.write_bytes(lines[0] + json.dumps(damaged).encode() + b"\n" + lines[2])

    with pytest.raises(InvalidInput, match=r"line 2: left\.volts_v\.1"):
        load_sweep(path)


def test_the_plan_is_walked_in_a_serpentine_that_is_denser_at_the_rim() -> None:
    nodes = SweepPlan().nodes_rad().reshape(9, 9, 2)

    assert np.allclose(nodes[0, 0], np.deg2rad([-9.3, -8.2]))
    assert np.allclose(nodes[0, ::-1, 0], nodes[1, :, 0])
    steps = np.diff(nodes[0, :, 0])
    assert steps[0] < 0.5 * steps[3]
    even = SweepPlan(spacing=NodeSpacing.EVEN).nodes_rad().reshape(9, 9, 2)
    assert np.allclose(np.diff(even[0, :, 0]), np.deg2rad(18.6 / 8))


@pytest.mark.parametrize(("columns", "rows"), [(9, 9), (4, 5)])
def test_by_hand_the_plan_is_walked_ring_by_ring_from_the_middle(columns: int, rows: int) -> None:
    plan = SweepPlan(columns=columns, rows=rows, spacing=NodeSpacing.EVEN)
    order = plan.outward_order()
    spread = plan.nodes_rad()[order] / [plan.half_width_rad, plan.half_height_rad] * [columns - 1, rows - 1]
    rings = np.abs(spread).max(axis=1)

    assert sorted(order) == list(range(columns * rows))
    assert np.all(np.diff(rings) > -1e-9)
    assert rings[0] < 1.1


def test_the_base_turns_so_that_the_target_appears_at_the_gaze() -> None:
    node = np.deg2rad([7.0, -5.0])
    base = base_pose(node, STATION.pose)

    p, t = STATION.pose.pan_rad, STATION.pose.tilt_rad
    target = np.array([math.cos(t) * math.sin(p), math.sin(t), math.cos(t) * math.cos(p)])
    pan = np.array(
        [
            [math.cos(base.pan_rad), 0.0, -math.sin(base.pan_rad)],
            [0.0, 1.0, 0.0],
            [math.sin(base.pan_rad), 0.0, math.cos(base.pan_rad)],
        ]
    )
    tilt = np.array(
        [
            [1.0, 0.0, 0.0],
            [0.0, math.cos(base.tilt_rad), -math.sin(base.tilt_rad)],
            [0.0, math.sin(base.tilt_rad), math.cos(base.tilt_rad)],
        ]
    )
    seen = tilt @ pan @ target
    assert np.allclose(np.arctan(seen[:2] / seen[2]), node, atol=1e-12)


def test_a_sweep_beyond_the_pan_tilt_is_refused_before_it_starts() -> None:
    limits = PanTiltLimits(
        pan_min_rad=math.radians(-50.0), pan_max_rad=1.0, tilt_min_rad=-0.5, tilt_max_rad=0.5
    )

    with pytest.raises(InvalidInput, match=r"needs the base at pan -5\d"):
        check_reach(SweepPlan(), STATION.pose, limits)
