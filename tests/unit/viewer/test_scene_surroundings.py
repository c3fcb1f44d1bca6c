"""The coarse surface of the wide view in the 3D scene: one at a time, seen whole."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.servers.viewer import viewer_of

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.scene import START_LOOK_AT_M, START_POSITION_M, ViewerScene
from foveacam_web.scene_surroundings import outlook
from foveacam_web.scene_values import FixationDrawing
from foveacam_web.scene_viewpoints import Pose, pose_before


def _mesh(z_m: float) -> DepthMesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 4]], dtype=np.float32)
    return DepthMesh(
        vertices_rig_m=corners + np.array([0.5, 0.0, z_m], dtype=np.float32),
        faces=np.array([[0, 2, 1], [1, 2, 3]], dtype=np.uint32),
        uv=np.array([[0, 0], [1, 0], [0, 1], [1, 1]], dtype=np.float32),
        texture=np.full((8, 8, 3), 90, dtype=np.uint8),
    )


def test_viewers_see_the_whole_surface_from_near_the_rig() -> None:
    mesh = _mesh(3.0)
    pose = outlook(mesh)
    assert np.linalg.norm(pose.position_m) < 0.15 * pose.look_at_m[2]
    assert pose.position_m[1] < 0.0  # above the rig: +y is down
    assert pose.look_at_m[2] == pytest.approx(3.0)
    ahead = (pose.look_at_m - pose.position_m) / np.linalg.norm(pose.look_at_m - pose.position_m)
    seen = mesh.vertices_rig_m - pose.position_m
    down = np.cross(ahead, np.array([1.0, 0.0, 0.0]))
    up_rad = np.arctan(np.abs(seen @ down) / (seen @ ahead))
    assert 0.6 * pose.fov_rad / 2.0 < up_rad.max() < pose.fov_rad / 2.0


def test_surfaces_follow_each_other_and_go() -> None:
    with ViewerScene() as scene:
        nodes = viewer_of(scene).scene._handle_from_node_name
        scene.remove_surroundings()
        scene.show_surroundings(_mesh(3.0), _mesh(9.0))
        first = nodes["/surroundings"]
        scene.show_surroundings(_mesh(4.0), _mesh(9.0), bring=True)
        assert nodes["/surroundings"] is not first
        assert "/backdrop" in nodes
        scene.show_surroundings(replace(_mesh(4.0), faces=np.zeros((0, 3), dtype=np.uint32)), _mesh(9.0))
        assert "/surroundings" not in nodes and "/backdrop" in nodes  # single cells, which make no surface
        scene.remove_surroundings()
        assert "/backdrop" not in nodes
        scene.remove_surroundings()
    scene.show_surroundings(_mesh(3.0), _mesh(9.0))  # closed: harmless


def _begins_at(scene: ViewerScene, pose: Pose) -> bool:
    camera = viewer_of(scene).initial_camera
    return np.allclose(camera.position, pose.position_m) and np.allclose(camera.look_at, pose.look_at_m)


def test_whoever_comes_later_begins_before_what_was_found_last() -> None:
    behind_the_rig = Pose(position_m=np.array(START_POSITION_M), look_at_m=np.array(START_LOOK_AT_M))
    point, whole = (0.2, 0.1, 1.8), outlook(_mesh(3.0))
    seen = FixationDrawing(
        label="Ball", point_rig_m=point, distance_m=1.8, distance_sigma_m=0.01, mesh=_mesh(1.8)
    )
    before = pose_before(point, _mesh(1.8).vertices_rig_m)
    with ViewerScene() as scene:
        assert _begins_at(scene, behind_the_rig)
        scene.show_surroundings(_mesh(3.0), _mesh(9.0))
        assert _begins_at(scene, whole)
        scene.show_fixation("fix-1", replace(seen, mesh=None))  # nothing to see but a marker
        assert _begins_at(scene, whole)
        scene.show_fixation("fix-2", seen)
        scene.show_surroundings(_mesh(3.0), _mesh(9.0))  # they grow by each look, which no person asked for
        assert _begins_at(scene, before)
        scene.show_surroundings(_mesh(3.0), _mesh(9.0), bring=True)
        assert _begins_at(scene, whole)
        scene.show_fixation("fix-3", seen)
        assert _begins_at(scene, before)
        scene.remove_surroundings()
        for name in ("fix-3", "fix-2"):
            assert _begins_at(scene, before)
            scene.remove_fixation(name)
        assert _begins_at(scene, behind_the_rig)
