"""Shapes, poses and snapshots of the scene; how kernels are compiled and warmed up."""

import errno
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware import jit
from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import (
    Box,
    Mesh,
    NoiseSurface,
    PlainSurface,
    Projection,
    Quad,
    Renderer,
    Scene,
    column,
    flat,
    place,
    sphere,
    statue,
    warm_up,
)
from foveacam_hardware.sim.render.compilation import kernel_steps
from foveacam_hardware.sim.render.tiles import render_tiles


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


def double(x: float) -> float:
    return 2.0 * x


def test_a_kernel_works_where_no_cache_can_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_function: object) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(jit, "_KernelCache", refuse)
    doubled = jit.kernel(double)

    assert doubled(1.5) == 3.0
    assert jit.cache_trouble(doubled) == "no folder for compiled kernels can be written"
    assert not jit.is_cached(doubled)


def test_a_kernel_works_on_a_full_disk_and_says_why_it_is_not_stored(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fill_disk(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    doubled = jit.kernel(double)
    monkeypatch.setattr(doubled._cache._cache_file, "save", fill_disk)

    assert doubled(1.5) == 3.0
    assert "No space left on device" in str(jit.cache_trouble(doubled))
    assert not jit.is_cached(doubled)


def test_a_stored_kernel_is_known_before_it_is_loaded(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    doubled, again = jit.kernel(double), jit.kernel(double)
    seen: list[str] = []

    with jit.compiling_watched(seen.append):
        assert doubled(1.5) == 3.0
        assert again(2.0) == 4.0  # loaded, not compiled

    assert seen == [f"{__name__}.double"]
    assert jit.is_cached(again) and jit.cache_trouble(again) is None


def test_the_parts_of_a_kernel_are_known_before_it_is_compiled() -> None:
    names = {name.rpartition(".")[2] for name in jit.kernels_within(render_tiles)}

    assert {"render_tiles", "shade_runs", "shade_noise", "fetch_long", "fill", "gather_marks"} <= names
    assert "set_up" not in names


def test_each_step_compiles_for_the_types_that_frames_have() -> None:
    warm_up()
    before = {step.name: len(step.kernel.signatures) for step in kernel_steps()}
    scene = Scene()
    for k in range(3):
        scene.add(Box(width_m=0.5, height_m=0.5, depth_m=0.5), NoiseSurface(), place((0.4 * k, 0, 3)), f"{k}")
    M = np.array([[200.0, 0.0, 99.5], [0.0, 200.0, 79.5], [0.0, 0.0, 1.0]])
    with Renderer(scene, threads=1) as renderer:
        for channels in (1, 3):
            renderer.radiance(Projection(M=M, C=np.zeros(3), width=200, height=160), channels=channels)

    assert {step.name: len(step.kernel.signatures) for step in kernel_steps()} == before
    assert all(before.values())


def test_cached_kernels_lapse_when_any_module_of_their_folder_changes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def version_with(digest: str) -> str:
        monkeypatch.setattr(jit, "_folder_digest", lambda _folder: digest)
        dispatcher = jit.kernel(volume_m3)
        return str(dispatcher._cache._cache_file._version)

    assert version_with("one") != version_with("two")
    assert version_with("one") == version_with("one")
