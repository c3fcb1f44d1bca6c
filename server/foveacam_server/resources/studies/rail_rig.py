"""The simulated rig before the figurine's rail, in virtual time and with the shipped calibration."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.study.localisation.experiment import RailRig
from foveacam_pipeline.study.localisation.rail import SCENE, RailPosition
from foveacam_server.resources.studies.recipes import CERTIFICATE

FIGURINE, SUPPORTS = "figurine", ("rail", "stand")
"""Objects of the scene: what stands on the rail, and what carries it."""


@contextmanager
def rail_rig() -> Iterator[RailRig]:
    """Open the rig in the scene and yield it with functions that move the scene's objects."""
    with open_simulated(SCENE, inline=True) as rig:
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
