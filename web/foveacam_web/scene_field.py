"""The fused surface of a whole field of regard in the 3D scene: one at a time."""

from typing import TypeAlias

import viser

_HALF_TURN_ABOUT_X = (0.0, 1.0, 0.0, 0.0)
"""wxyz: a file that leaves the house stands +y up, the rig's frame +y down."""
_NAME = "/field"

Point: TypeAlias = tuple[float, float, float]


class FieldNode:
    """The handle of one field's surface; created drawn, gone after `remove`."""

    def __init__(self, scene: viser.SceneApi, content: bytes) -> None:
        self._surface = scene.add_glb(
            _NAME, content, wxyz=_HALF_TURN_ABOUT_X, cast_shadow=False, receive_shadow=False
        )

    def remove(self) -> None:
        """Take it away."""
        self._surface.remove()


def overlook(client: viser.ClientHandle, *, from_rig_m: Point, to_rig_m: Point) -> None:
    """Bring one viewer's camera where a field is seen well."""
    with client.atomic():
        client.camera.up_direction = (0.0, -1.0, 0.0)
        client.camera.position = from_rig_m
        client.camera.look_at = to_rig_m
