"""The simulated rig at any position of a scene, in virtual time and with the shipped calibration."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.study.visibility.observed import Observer
from foveacam_pipeline.study.visibility.toy_scene import SCENE, AgentPose
from foveacam_server.resources.studies.recipes import CERTIFICATE


@contextmanager
def placed_rig(scene: str = SCENE) -> Iterator[Observer]:
    """Open the rig in a scene and yield it with a function that moves it; the truth is moved, not read."""
    with open_simulated(scene, inline=True) as rig:
        if rig.truth is None:
            raise DeviceFault("the simulated rig came without its world; open it with open_simulated")
        set_pose = pose_setter(rig.truth.world.animated_scene)
        calibration = load_calibration(CERTIFICATE)
        yield Observer(head=rig.head, calibration=calibration, clock=rig.clock, set_pose=set_pose)


def pose_setter(stage: AnimatedScene) -> Callable[[AgentPose], None]:
    """Return a function that moves the rig to a pose on the stage, from the next frame on."""

    def set_pose(pose: AgentPose) -> None:
        rig_from_world = rig_from_scene(pose)
        stage.rig_pose = lambda _t_s: rig_from_world

    return set_pose


def rig_from_scene(pose: AgentPose) -> NDArray[np.float64]:
    """Return (4, 4) float64, scene to rig, metres, for a pose on the plan; the eyes are at y = 0."""
    c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    rig_from_world = np.eye(4)
    rig_from_world[:3, :3] = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]
    rig_from_world[:3, 3] = -rig_from_world[:3, :3] @ [pose.x_m, 0.0, pose.y_m]
    return rig_from_world
