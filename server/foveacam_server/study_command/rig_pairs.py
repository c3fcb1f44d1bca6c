"""The simulated rig's own wide and fovea pictures of one world, for the trade-off under equal bandwidth.

The toy scene: nothing moves between the pictures, nothing is nearer than the matcher's 256 disparities reach.
"""

from collections.abc import Sequence

import numpy as np

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.capture.progress_steps import ProgressSteps, ProgressWatcher
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.study.tradeoff.rig_pairs import RigPairScene
from foveacam_pipeline.study.visibility.observed import REST_NS
from foveacam_pipeline.study.visibility.toy_scene import SCENE, AgentPose
from foveacam_pipeline.verge.loop import fixate
from foveacam_pipeline.verge.values import DirectionTarget, Fixation
from foveacam_server.bench.tradeoff_truth import wide_pair
from foveacam_server.study_command.placed_rig import stands_on
from foveacam_server.study_command.recipes import CERTIFICATE

COLUMNS_DEG, ROWS_DEG = (-7.0, -3.5, 0.0, 3.5, 7.0), (-5.0, 0.0, 5.0)
QUICK_COLUMNS_DEG, QUICK_ROWS_DEG = (-5.0, 0.0, 5.0), (-3.0, 3.0)
FOVEAE = 4
"""The farthest of the points that were verged on become patches: a robot knows their distance by then."""


def rig_pair(*, quick: bool, watch: ProgressWatcher) -> RigPairScene:
    """Return the rig's view of the toy scene, with foveae on the farthest of a grid of directions.

    Raise Cancelled when the watcher asks, DeviceFault where nothing was verged on.
    """
    columns, rows = (QUICK_COLUMNS_DEG, QUICK_ROWS_DEG) if quick else (COLUMNS_DEG, ROWS_DEG)
    directions = [(x_deg, y_deg) for y_deg in rows for x_deg in columns]
    steps = ProgressSteps(watch, len(directions) + 1, ended="the rig was not done looking; run it again")
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(SCENE, inline=True) as rig:
        if rig.truth is None:
            raise DeviceFault("the simulated rig came without its world; open it with open_simulated")
        stand = stands_on(rig.truth.world.stage)

        def aside(x_m: float) -> None:
            stand(AgentPose(x_m=x_m, y_m=0.0))
            rig.clock.sleep_until_ns(rig.clock.now_ns() + REST_NS)

        wide = wide_pair(rig, calibration, aside, name=f"simulated rig, scene {SCENE}")
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
