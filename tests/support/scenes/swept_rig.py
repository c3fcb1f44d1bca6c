"""Sweeps of a simulated rig as the procedures would measure them: its truth, with noise on the corners."""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, PanTiltPose, Role, Station, StationTarget
from foveacam_hardware.sim.faults import ThermalMountDrift
from foveacam_hardware.sim.mirror import built_law
from foveacam_hardware.sim.optics import EyeProjection, FoldedEye, WideLens, built_assembly, rotation
from foveacam_hardware.sim.rest_deviation import LIGHT_PER_TILT
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepHeader, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_pipeline.models import Intrinsics
from foveacam_pipeline.models.mirror import DAC_STEP_V

WIDTH, HEIGHT = 1440, 1080
CENTRE_PX = np.array([719.5, 539.5])
MAX_V = 170.0
POSE_S = 0.55
EYES = (Role.LEFT, Role.RIGHT)
CELLS = [(x, y) for x in (-0.01, 0.0, 0.01, 0.02) for y in (-0.02, 0.0, 0.01)]
PLACES_M = np.array([(-0.03, -0.03), (0.03, -0.03), (0.03, 0.03), (-0.03, 0.03), *CELLS])
PAN_M, TILT_M = np.array([0.002, 0.055, -0.033]), np.array([0.001, 0.052, -0.036])
"""Points of the pan and of the tilt axis of the base, rig frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Standard deviations of the corners found, px."""

    wide_px: float = 0.05
    fovea_px: float = 0.1


Turns: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Of the left and of the right mount about the rig's x, y and z, rad."""
UPRIGHT: Turns = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class SweptRig:
    """The truth of one seed's rig: what each camera would show of points in the rig frame."""

    def __init__(
        self,
        seed: int,
        *,
        drift_deg: float = 0.0,
        knocked_rad: Turns = UPRIGHT,
        scatter_rms_deg: float = 0.0,
    ) -> None:
        self.seed = seed
        self._scatter_rad = np.deg2rad(scatter_rms_deg) / LIGHT_PER_TILT
        self._moves = np.random.default_rng([seed, 0xD15C])
        self._knocked = dict(zip(EYES, knocked_rad, strict=True))
        self._eyes = {role: FoldedEye(built_assembly(role, seed=seed)) for role in EYES}
        self._laws = {role: built_law(role, seed=seed) for role in EYES}
        self._lens = WideLens()
        self._drift = ThermalMountDrift(seed=seed, amplitude_rad=float(np.deg2rad(drift_deg)))

    def static_projection(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        """Return an eye's projection at rest after another move, with the drift of a moment."""
        tilt = self._laws[role].tilt_rad(np.array([[volts.x_v, volts.y_v]]))[0]
        tilt = tilt + self._scatter_rad * self._moves.standard_normal(2)
        turn = self._mount_turn_rad(role, t_ns or 0)
        return self._eyes[role].view(float(tilt[0]), float(tilt[1]), mount_turn_rad=turn)

    def _mount_turn_rad(self, role: Role, t_ns: int) -> NDArray[np.float64]:
        return np.append(self._drift.turn_rad(role, 1e-9 * t_ns), 0.0) + self._knocked[role]

    def pivot_m(self, role: Role) -> NDArray[np.float64]:
        """Return the centre of a mirror."""
        return self._eyes[role].pivot_m

    def wide_pixels(self, points_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return raw wide pixels (n, 2) of points (n, 3)."""
        ideal = points_rig_m[:, :2] / points_rig_m[:, 2:] * self._lens.focal_px
        centre = np.array([self._lens.centre_x_px, self._lens.centre_y_px])
        return np.asarray(self._lens.distorted_px(ideal + centre), dtype=np.float64)

    def wide_rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rays (n, 3) of raw wide pixels."""
        rays = np.column_stack([self._lens.undistorted_px(pixels), np.ones(len(pixels))])
        rays = rays @ np.linalg.inv(self._lens.matrix()).T
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))

    def steered(
        self,
        role: Role,
        point_rig_m: NDArray[np.float64],
        target_px: NDArray[np.float64],
        start_v: NDArray[np.float64],
        *,
        t_ns: int = 0,
    ) -> NDArray[np.float64]:
        """Return the volts, within the limits and in steps of the DAC, that bring a point onto a pixel."""
        volts, turn = start_v.copy(), self._mount_turn_rad(role, t_ns)

        def misses(at_v: NDArray[np.float64]) -> list[NDArray[np.float64]]:
            tilts = self._laws[role].tilt_rad(at_v).tolist()
            views = [self._eyes[role].view(x_rad, y_rad, mount_turn_rad=turn) for x_rad, y_rad in tilts]
            return [np.asarray(view.pixels(point_rig_m[None])[0] - target_px) for view in views]

        for _ in range(8):
            before = volts
            now, right, down = misses(volts + np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
            slope = np.column_stack([right - now, down - now])
            volts = np.clip(volts - np.linalg.solve(slope, now), -MAX_V, MAX_V)
            if np.abs(volts - before).max() < 1e-3 * DAC_STEP_V:  # the next step is its square
                break
        return np.asarray(np.round(volts / DAC_STEP_V) * DAC_STEP_V)


def wide_lens(rig: SweptRig, *, noise_px: float = 0.05, views: int = 40) -> Intrinsics:
    """Return the wide camera as a chequerboard of 9 x 6 corners held at many attitudes calibrates it."""
    rng = np.random.default_rng([rig.seed, 7])
    columns, rows = np.meshgrid(np.arange(9), np.arange(6))
    board = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(columns.size)]) * 0.05
    board -= board.mean(axis=0)
    objects: list[NDArray[np.float32]] = []
    images: list[NDArray[np.float32]] = []
    while len(objects) < views:
        turn = rotation(rng.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))
        depth_m = rng.uniform(0.9, 2.0)
        place = np.array([*(rng.uniform([-0.16, -0.12], [0.16, 0.12]) * depth_m), depth_m])
        pixels = rig.wide_pixels(board @ turn.T + place)
        pixels += noise_px * rng.standard_normal(pixels.shape)
        seen = ((pixels > 0.0) & (pixels < np.array([WIDTH - 1, HEIGHT - 1]))).all(axis=1)
        if seen.sum() >= 27:
            objects.append(board[seen].astype(np.float32))
            images.append(pixels[seen].astype(np.float32))
    guess = np.array([[3000.0, 0.0, 719.5], [0.0, 3000.0, 539.5], [0.0, 0.0, 1.0]])
    _, matrix, bend, _, _ = cv2.calibrateCamera(
        objects, images, (WIDTH, HEIGHT), guess, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS
    )
    fx, fy, cx, cy = (float(matrix[i]) for i in ((0, 0), (1, 1), (0, 2), (1, 2)))
    return Intrinsics(
        width=WIDTH,
        height=HEIGHT,
        fx_px=fx,
        fy_px=fy,
        cx_px=cx,
        cy_px=cy,
        distortion=tuple(float(c) for c in np.ravel(bend)[:5]),
    )


def markers_in_rig(
    pan_tilt: PanTiltPose, *, distance_m: float, turn: NDArray[np.float64]
) -> dict[Role, NDArray[np.float64]]:
    """Return the corners (k, 3) of each camera's marker, rig frame, when the base points at `pan_tilt`."""
    pan = rotation(np.array([0.0, -pan_tilt.pan_rad, 0.0]))
    tilt = rotation(np.array([pan_tilt.tilt_rad, 0.0, 0.0]))
    corners = {}
    for role in (Role.WIDE, *EYES):
        flat = np.column_stack([PLACES_M + MarkerLayout().middle_m(role), np.zeros(len(PLACES_M))])
        world = flat @ turn.T + np.array([0.0, 0.0, distance_m])
        corners[role] = ((world - PAN_M) @ pan.T + PAN_M - TILT_M) @ tilt.T + TILT_M
    return corners


@cache
def swept(
    seed: int,
    distance_m: float,
    *,
    wide_noise_px: float = 0.05,
    fovea_noise_px: float = 0.1,
    side: int = 9,
    field_deg: float | None = None,
    drift_deg: float = 0.0,
    begin_s: float = 10.0,
    knocked_rad: Turns = UPRIGHT,
    scatter_rms_deg: float = 0.0,
) -> Sweep:
    """Return the sweep of a seed's rig over the target at a distance, over the field or to `field_deg`."""
    noise = Noise(wide_px=wide_noise_px, fovea_px=fovea_noise_px)
    rig = SweptRig(seed, drift_deg=drift_deg, knocked_rad=knocked_rad, scatter_rms_deg=scatter_rms_deg)
    room = _Room(rig, distance_m, noise, key=0)
    plan = SweepPlan(columns=side, rows=side)
    if field_deg is not None:
        half_rad = math.radians(field_deg)
        plan = replace(plan, half_width_rad=half_rad, half_height_rad=half_rad)
    poses = [
        room.pose(index, node, t_s=begin_s + POSE_S * index)
        for index, node in enumerate(plan.nodes_rad().tolist())
    ]
    return Sweep(header=header(seed, distance_m, plan), poses=tuple(poses))


def visited(
    sweep: Sweep,
    visits: dict[float, int],
    *,
    drift_deg: float,
    run: str = "",
    noise: Noise | None = None,
    knocked_rad: Turns = UPRIGHT,
) -> Sweep:
    """Return a sweep with visits that repeat nodes: the node by the time, s; all of it in one `run`."""
    seed, distance_m = int(sweep.header.rig_id.removeprefix("sim-")), sweep.header.station.distance_m
    assert distance_m is not None
    rig = SweptRig(seed, drift_deg=drift_deg, knocked_rad=knocked_rad)
    room = _Room(rig, distance_m, noise or Noise(), key=len(sweep.repeats) + 1)
    named = replace(sweep, poses=tuple(replace(pose, run=pose.run or run) for pose in sweep.poses))
    nodes = sweep.header.plan.nodes_rad().tolist()
    for t_s, index in sorted(visits.items()):
        pose = room.pose(index, nodes[index], t_s=t_s)
        again = replace(pose, run=run, repeat=named.next_repeat(index))
        named = replace(named, repeats=(*named.repeats, again))
    return named


class _Room:
    """The target before the rig: what would be measured of it at a moment."""

    def __init__(self, rig: SweptRig, distance_m: float, noise: Noise, *, key: int) -> None:
        self._rig = rig
        self._distance_m = distance_m
        self._noise = noise
        seeds = [rig.seed, round(1e3 * distance_m), *([key] if key else [])]
        self._rng = np.random.default_rng(seeds)
        self._volts = {role: np.zeros(2) for role in EYES}

    def pose(self, index: int, node: list[float], *, t_s: float) -> SweepPose:
        """Return the pose at a node."""
        rig, rng, t_ns = self._rig, self._rng, round(1e9 * t_s)
        bearing = PanTiltPose(pan_rad=-node[0] + 1e-3 * rng.standard_normal(), tilt_rad=-node[1])
        corners = markers_in_rig(bearing, distance_m=self._distance_m, turn=target_turn())
        ids = {role: MarkerLayout().id_of(role) for role in corners}
        wide = {
            ids[role]: _view(ids[role], rig.wide_pixels(points), self._noise.wide_px, rng)
            for role, points in corners.items()
        }
        eyes: dict[Role, EyePose | None] = {}
        for role in EYES:
            target = CENTRE_PX + rng.uniform(-3.0, 3.0, 2)
            middle = corners[role][:4].mean(axis=0)
            self._volts[role] = rig.steered(role, middle, target, self._volts[role], t_ns=t_ns)
            drive = MirrorVolts(x_v=float(self._volts[role][0]), y_v=float(self._volts[role][1]))
            pixels = rig.static_projection(role, drive, t_ns=t_ns).pixels(corners[role])
            eyes[role] = _eye_pose(ids[role], drive, pixels, self._noise.fovea_px, rng)
        return SweepPose(
            index=index,
            node_rad=(node[0], node[1]),
            pan_tilt=bearing,
            t_ns=t_ns,
            wide=wide,
            left=eyes[Role.LEFT],
            right=eyes[Role.RIGHT],
            left_refusal=None if eyes[Role.LEFT] else "the marker was cut by the edge",
            right_refusal=None if eyes[Role.RIGHT] else "the marker was cut by the edge",
        )


def target_turn() -> NDArray[np.float64]:
    """Return how the target hangs: not quite square to the line of sight."""
    return rotation(np.array([0.01, 0.02, 0.005]))


def header(seed: int, distance_m: float, plan: SweepPlan) -> SweepHeader:
    """Return what a sweep says of itself."""
    return SweepHeader(
        rig_id=f"sim-{seed}",
        created_utc="2026-01-31T12:00:00+00:00",
        station=Station(
            name=f"markers at {distance_m:g} m",
            target=StationTarget.MARKERS,
            pose=PanTiltPose(pan_rad=0.0, tilt_rad=0.0),
            distance_m=distance_m,
        ),
        layout=MarkerLayout(),
        plan=plan,
        wide_size=(WIDTH, HEIGHT),
        fovea_size=(WIDTH, HEIGHT),
        max_v=MAX_V,
    )


def _view(marker: int, pixels: NDArray[np.float64], noise_px: float, rng: np.random.Generator) -> MarkerView:
    noisy = pixels + noise_px * rng.standard_normal(pixels.shape)
    return MarkerView(
        id=marker, corners_px=noisy, places_m=PLACES_M, sharpness=0.7, complete=True, sigma_px=noise_px
    )


def _eye_pose(
    marker: int,
    drive: MirrorVolts,
    pixels: NDArray[np.float64],
    noise_px: float,
    rng: np.random.Generator,
) -> EyePose | None:
    if not ((pixels > 0.0) & (pixels < np.array([WIDTH - 1, HEIGHT - 1]))).all():
        return None
    off_px = float(np.abs(pixels[:4].mean(axis=0) - CENTRE_PX).max())
    return EyePose(
        volts_v=(drive.x_v, drive.y_v),
        corners=_view(marker, pixels, noise_px, rng),
        centred=off_px < 6.0,
        rim=off_px >= 6.0,
        looks=3,
    )
