"""Simulated rigs of the studies, in virtual time, with the shipped calibration.

One can be moved in a scene, one stands in front of the rail and moves its figurine. They change the truth but
do not read it.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, DeviceFault
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.study.localisation.experiment import RailRig
from foveacam_pipeline.study.localisation.rail import SCENE as RAIL_SCENE
from foveacam_pipeline.study.localisation.rail import RailPosition
from foveacam_pipeline.study.visibility.observed import Observer
from foveacam_pipeline.study.visibility.toy_scene import SCENE, AgentPose
from foveacam_server.resources.studying.studies.recipes import CERTIFICATE

FIGURINE, SUPPORTS = "figurine", ("rail", "stand")
"""Names of scene objects: the figurine on the rail, and those that carry it."""


def bin_cameras(rig: Rig, binning: Binning) -> None:
    """Switch all cameras of a rig to a binning."""
    for camera in (rig.wide, rig.left, rig.right):
        camera.configure(replace(camera.settings, binning=binning))


@contextmanager
def placed_rig(scene: str = SCENE) -> Iterator[Observer]:
    """Open the rig in a scene and yield it with a function that moves it."""
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


@contextmanager
def rail_rig() -> Iterator[RailRig]:
    """Open the rig in the scene and yield it with functions that move the scene's objects."""
    with open_simulated(RAIL_SCENE, inline=True) as rig:
        if rig.truth is None or rig.rail is None:
            raise DeviceFault("the simulated rig came without world or rail; open it with open_simulated")
        stage = FigurineStage(rig.truth.world.animated_scene)
        yield RailRig(
            head=rig.head,
            stage=rig.rail,
            calibration=load_calibration(CERTIFICATE),
            clock=rig.clock,
            set_standoff=stage.set_standoff,
            place=stage.place,
        )


class FigurineStage:
    """Moves the figurine and its rail in the scene, from the next frame on; it reads no truth."""

    def __init__(self, animated: AnimatedScene) -> None:
        self._scene = animated.scene
        self._standoff_m = 0.0

    def set_standoff(self, standoff_m: float) -> None:
        """Put rail and stand at a standoff; the figurine follows with the next `place`."""
        self._standoff_m = standoff_m
        for name in SUPPORTS:
            number = self._scene.names.index(name)
            x_m, y_m, _ = self._scene.snapshot().poses[number][:3, 3].tolist()
            self._move(number, (x_m, y_m, standoff_m))

    def place(self, position: RailPosition) -> None:
        """Put the figurine on the rail."""
        self._move(self._scene.names.index(FIGURINE), position.foot_m(self._standoff_m))

    def _move(self, number: int, to_m: tuple[float, float, float]) -> None:
        scene_from_object = np.eye(4)
        scene_from_object[:3, 3] = to_m
        self._scene.set_pose(number, scene_from_object)
