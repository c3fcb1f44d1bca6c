"""The coarse surface of the wide view in the 3D scene: one at a time, seen whole."""

import numpy as np
import pytest
from tests.support.servers.viewer import viewer_of

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.scene import ViewerScene
from foveacam_web.scene_surroundings import outlook


def _mesh(z_m: float) -> DepthMesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 4]], dtype=np.float32)
    return DepthMesh(
        vertices_rig_m=corners + np.array([0.5, 0.0, z_m], dtype=np.float32),
        faces=np.array([[0, 2, 1], [1, 2, 3]], dtype=np.uint32),
        uv=np.array([[0, 0], [1, 0], [0, 1], [1, 1]], dtype=np.float32),
        texture=np.full((8, 8, 3), 90, dtype=np.uint8),
    )


def test_viewers_stand_before_the_nearest_thing_and_look_at_the_middle() -> None:
    stand, middle = outlook(_mesh(3.0))
    assert 0.0 < stand[2] < 3.0
    assert stand[1] < 0.0  # above the rig: +y is down
    assert middle == pytest.approx((0.5, 0.0, 3.0))


def test_surfaces_follow_each_other_and_go() -> None:
    with ViewerScene() as scene:
        nodes = viewer_of(scene).scene._handle_from_node_name
        scene.remove_surroundings()
        scene.show_surroundings(_mesh(3.0))
        first = nodes["/surroundings"]
        scene.show_surroundings(_mesh(4.0), bring=True)
        assert nodes["/surroundings"] is not first
        scene.remove_surroundings()
        assert "/surroundings" not in nodes
        scene.remove_surroundings()
    scene.show_surroundings(_mesh(3.0))  # closed: harmless


def test_whoever_comes_later_begins_where_the_surroundings_are_seen() -> None:
    with ViewerScene() as scene:
        scene.show_surroundings(_mesh(3.0))
        assert tuple(viewer_of(scene).initial_camera.position) == pytest.approx(outlook(_mesh(3.0))[0])
