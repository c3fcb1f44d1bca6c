"""Measurements against the simulation's truth for the studies of Sec. 4.1 and 4.2, on the simulated rig.

The error of matching two verged foveae, and a wide stereo pair with its true depth. The studies themselves
are in foveacam_pipeline.study; `foveacam study` passes these results to them.
"""

from collections.abc import Callable, Sequence
from statistics import median

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.rectify import rectify, to_uint8
from foveacam_pipeline.study.tradeoff.depth_error import MatchingError, measured_error
from foveacam_pipeline.study.tradeoff.rig_pairs import RigPairScene
from foveacam_pipeline.study.tradeoff.streets import StereoScene
from foveacam_pipeline.study.visibility.observed import REST_NS
from foveacam_pipeline.study.visibility.toy_scene import SCENE, AgentPose
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget, Fixation
from foveacam_pipeline.workers.progress import ProgressSteps, ProgressWatcher
from foveacam_server.resources.studying.studies.click_truth import ClickKind, truth_of
from foveacam_server.resources.studying.studies.judged_clicks import judged_clicks
from foveacam_server.resources.studying.studies.matching_errors import VERGE, VERGED
from foveacam_server.resources.studying.studies.recipes import CERTIFICATE
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras, pose_setter

CLICK_SCENE = "bench"
"""The simulated scene of the clicks of `verge_error`."""


def verge_error(clicks: int, *, watch: ProgressWatcher) -> MatchingError:
    """Return the median true left-right residual of verged foveae, fovea px, over clicks on texture.

    Raise Cancelled when the watcher asks, InvalidInput where no click verged.
    """
    steps = ProgressSteps(watch, clicks, ended="the clicks were not all made; run it again")
    found: list[float] = []
    calibration, quota = load_calibration(CERTIFICATE), {ClickKind.TEXTURED: clicks}
    with open_simulated(CLICK_SCENE, inline=True) as rig:
        bin_cameras(rig, 1)
        for result in judged_clicks(rig, calibration, scene=CLICK_SCENE, quota=quota):
            steps.step("the rig verges on what it sees")
            if result.verged:
                found.append(result.residual_px)
    if not found:
        raise InvalidInput(
            f"none of {clicks} clicks verged, so that no matching error is known; allow more clicks"
        )
    source = f"measured for this study: median true residual of {len(found)} clicks, simulated rig"
    return measured_error(VERGE, median(found), whose=VERGED, source=source)


COLUMNS_DEG, ROWS_DEG = (-7.0, -3.5, 0.0, 3.5, 7.0), (-5.0, 0.0, 5.0)
QUICK_COLUMNS_DEG, QUICK_ROWS_DEG = (-5.0, 0.0, 5.0), (-3.0, 3.0)
FOVEAE = 4
"""Number of patches, taken from the farthest of the verged points."""


def rig_pair(*, quick: bool, watch: ProgressWatcher) -> RigPairScene:
    """Return the rig's view of the toy scene, with foveae on the farthest of a grid of directions.

    Raise Cancelled when the watcher asks.
    """
    columns, rows = (QUICK_COLUMNS_DEG, QUICK_ROWS_DEG) if quick else (COLUMNS_DEG, ROWS_DEG)
    directions = [(x_deg, y_deg) for y_deg in rows for x_deg in columns]
    steps = ProgressSteps(watch, len(directions) + 1, ended="the rig was not done looking; run it again")
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(SCENE, inline=True) as rig:
        set_pose = pose_setter(truth_of(rig).world.animated_scene)

        def shift(x_m: float) -> None:
            set_pose(AgentPose(x_m=x_m, y_m=0.0))
            rig.clock.sleep_until_ns(rig.clock.now_ns() + REST_NS)

        wide = wide_pair(rig, calibration, shift, name=f"simulated rig, scene {SCENE}")
        steps.step("the wide pair")
        looks = []
        for x_deg, y_deg in directions:
            target = DirectionTarget(ax_rad=float(np.deg2rad(x_deg)), ay_rad=float(np.deg2rad(y_deg)))
            looks.append(fixate(rig.head, calibration, target, clock=rig.clock))
            steps.step("the foveae look")
    centre_px = (calibration.wide.cx_px, calibration.wide.cy_px)
    foveae = tuple(
        rectify(look.sighting, calibration, scale=1.0)
        for look in _farthest(looks)
        if look.sighting is not None
    )
    return RigPairScene(wide=wide, centre_px=centre_px, foveae=foveae)


def _farthest(looks: Sequence[Fixation]) -> list[Fixation]:
    verged = [look for look in looks if look.distance_m is not None]
    return sorted(verged, key=lambda look: look.distance_m or 0.0, reverse=True)[:FOVEAE]


NEAR_M = 2.5
"""Nearest depth that is searched: a disparity of 250 px."""
FAR_M = 60.0
"""Pixels of the background and of surfaces farther away are not counted."""
SAME_SHARE = 0.01
"""Relative difference of depth below which left and right see the same point."""


def wide_pair(
    rig: Rig, calibration: Calibration, shift: Callable[[float], None], *, name: str
) -> StereoScene:
    """Return a stereo pair of the wide camera with its true depth, taken half a baseline left and right.

    `shift` moves the rig by metres to its right; it is called with 0 at the end.
    """
    half_m = calibration.baseline_m / 2.0
    pictures, depths_m = [], []
    for x_m in (-half_m, half_m):
        shift(x_m)
        pictures.append(_undistort(to_uint8(rig.head.wide(max_age_ms=0.0)), calibration.wide))
        depths_m.append(_depth_m(rig, calibration.wide))
    shift(0.0)
    f_px = calibration.wide.fx_px
    left_m, right_m = depths_m
    return StereoScene(
        name=name,
        left=pictures[0],
        right=pictures[1],
        f_px=f_px,
        baseline_m=calibration.baseline_m,
        truth_z_m=np.where(left_m < FAR_M, left_m, np.nan).astype(np.float32),
        seen=_common_view(left_m, right_m, f_b=f_px * calibration.baseline_m),
        near_m=NEAR_M,
    )


def _pinhole(wide: Intrinsics) -> NDArray[np.float64]:
    """Return the (3, 3) camera matrix of the wide camera, with square pixels."""
    return np.array([[wide.fx_px, 0.0, wide.cx_px], [0.0, wide.fx_px, wide.cy_px], [0.0, 0.0, 1.0]])


def _undistort(image: NDArray[np.uint8], wide: Intrinsics) -> NDArray[np.uint8]:
    maps = cv2.initUndistortRectifyMap(
        wide.matrix,
        np.array(wide.distortion),
        np.eye(3),
        _pinhole(wide),
        (wide.width, wide.height),
        cv2.CV_32FC1,
    )
    return np.asarray(cv2.remap(image, *maps, cv2.INTER_CUBIC), dtype=np.uint8)


def _depth_m(rig: Rig, wide: Intrinsics) -> NDArray[np.float32]:
    """Return (h, w) float32 depth along the rig's z at this moment; infinite for the background."""
    world = truth_of(rig).world
    pinhole = Projection(M=_pinhole(wide), C=np.zeros(3), width=wide.width, height=wide.height)
    return world.animated_scene.probe(pinhole, world.scene_s(rig.clock.now_ns())).depth_m.copy()


def _common_view(
    left_m: NDArray[np.float32], right_m: NDArray[np.float32], *, f_b: float
) -> NDArray[np.bool_]:
    """Return (h, w) bool: whether the right camera sees the point that the left one sees."""
    height, width = left_m.shape
    y, x = np.mgrid[:height, :width].astype(np.float32)
    right_at_left_m = cv2.remap(
        right_m, x - np.float32(f_b) / left_m, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT
    )
    known = np.isfinite(left_m) & np.isfinite(right_at_left_m)
    difference_m = np.where(known, right_at_left_m, 0.0) - np.where(known, left_m, 0.0)
    return np.asarray(known & (np.abs(difference_m) < SAME_SHARE * left_m))
