"""Shapes, poses and snapshots of the scene; how kernels are compiled and warmed up."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from foveacam_hardware import jit
from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import (
    Box,
    Mesh,
    NoiseSurface,
    PlainSurface,
    Quad,
    Scene,
    column,
    flat,
    place,
    sphere,
    statue,
    warm_up,
)


def volume_m3(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def edges_met(mesh: Mesh) -> set[int]:
    """How many faces meet at the edges between places (vertices at the same place are one)."""
    _, place_of = np.unique(mesh.vertices_m.round(9), axis=0, return_inverse=True)
    faces = place_of.ravel()[mesh.faces]
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return set(np.unique(pairs, axis=0, return_counts=True)[1].tolist())


def test_generated_shapes_are_closed_and_look_outwards() -> None:
    assert volume_m3(sphere(radius_m=0.5, rings=48)) == pytest.approx(4 / 3 * np.pi * 0.125, rel=5e-3)
    assert volume_m3(column(radius_m=0.2, height_m=2.0, sides=96)) == pytest.approx(
        np.pi * 0.04 * 2.0, rel=2e-3
    )
    assert volume_m3(statue(height_m=1.8)) > 0
    for mesh in (sphere(radius_m=0.5), column(radius_m=0.2, height_m=2.0), statue(height_m=1.8, detail=30)):
        assert edges_met(mesh) == {2}


def test_the_statue_has_20_000_triangles_and_the_height_asked_for() -> None:
    mesh = statue(height_m=1.8)

    assert 19_000 < len(mesh.faces) < 21_000
    assert np.ptp(mesh.vertices_m[:, 1]) == pytest.approx(1.8)
    assert (mesh.vertices_m == statue(height_m=1.8).vertices_m).all()
    assert not (mesh.vertices_m == statue(height_m=1.8, seed=1).vertices_m).all()


def test_flat_lays_a_quad_face_up_with_its_top_away_from_the_viewer() -> None:
    pose = flat((0.0, 1.0, 5.0))

    assert np.allclose(pose[:3, :3] @ [0, -1, 0], [0, 0, 1])
    assert np.allclose(pose[:3, :3] @ [0, 0, -1], [0, -1, 0])


def test_only_a_change_of_pose_raises_the_revision() -> None:
    scene = Scene()
    number = scene.add(Quad(width_m=1.0, height_m=1.0), PlainSurface(), np.eye(4), "sheet")
    added = scene.snapshot().revision

    scene.set_pose(number, np.eye(4))
    assert scene.snapshot().revision == added
    scene.set_pose(number, place((0.0, 0.0, 1.0)))
    assert scene.snapshot().revision > added
    assert (scene.pose(number) == place((0.0, 0.0, 1.0))).all()


def test_a_snapshot_is_not_reached_by_later_moves() -> None:
    scene = Scene()
    number = scene.add(Box(width_m=1.0, height_m=1.0, depth_m=1.0), NoiseSurface(), np.eye(4), "box")
    snapshot = scene.snapshot()

    scene.set_pose(number, place((3.0, 0.0, 0.0)))

    assert (snapshot.poses[0] == np.eye(4)).all()
    assert isinstance(scene.material(number), NoiseSurface)
    assert scene.names == ("box",)


@pytest.mark.parametrize(
    "pose",
    [np.eye(3), np.full((4, 4), np.nan), np.diag([2.0, 2.0, 2.0, 1.0]), np.diag([-1.0, 1.0, 1.0, 1.0])],
)
def test_a_pose_that_is_not_rigid_is_refused_with_the_name(pose: np.typing.NDArray[np.float64]) -> None:
    with pytest.raises(InvalidInput, match="pose of crate"):
        Scene().add(Box(width_m=1.0, height_m=1.0, depth_m=1.0), PlainSurface(), pose, "crate")


def test_moving_an_object_that_is_not_there_is_refused() -> None:
    with pytest.raises(InvalidInput, match="object 3"):
        Scene().set_pose(3, np.eye(4))


BAD_SHAPES: list[Callable[[], object]] = [
    lambda: Quad(width_m=0.0, height_m=1.0),
    lambda: Box(width_m=1.0, height_m=float("nan"), depth_m=1.0),
    lambda: sphere(radius_m=-1.0),
    lambda: column(radius_m=1.0, height_m=0.0),
    lambda: statue(height_m=0.0),
    lambda: Mesh(vertices_m=np.zeros((3, 2)), faces=np.zeros((1, 3), np.int32)),
    lambda: Mesh(vertices_m=np.zeros((3, 3)), faces=np.zeros((0, 3), np.int32)),
    lambda: Mesh(vertices_m=np.zeros((3, 3)), faces=np.array([[0, 1, 3]], np.int32)),
]


@pytest.mark.parametrize("make", BAD_SHAPES)
def test_a_shape_that_cannot_be_used_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(InvalidInput):
        make()


def test_warming_up_reports_every_step() -> None:
    steps: list[tuple[int, int, str]] = []

    warm_up(lambda done, total, name: steps.append((done, total, name)))

    assert [done for done, _, _ in steps] == list(range(len(steps)))
    assert steps[-1] == (len(steps) - 1, len(steps) - 1, "ready")


def test_a_kernel_works_where_no_cache_can_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []

    def njit(*, cache: bool = False, **_: object) -> Callable[[Any], Any]:  # as numba's, untyped
        asked.append(cache)
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(jit, "njit", njit)

    assert jit.kernel(lambda x: x + 1)(1) == 2
    assert asked == [True, False]


def test_cached_kernels_lapse_when_any_module_of_their_folder_changes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def version_with(digest: str) -> str:
        monkeypatch.setattr(jit, "_folder_digest", lambda _folder: digest)
        dispatcher = jit.kernel(volume_m3)
        return str(dispatcher._cache._cache_file._version)

    assert version_with("one") != version_with("two")
    assert version_with("one") == version_with("one")
