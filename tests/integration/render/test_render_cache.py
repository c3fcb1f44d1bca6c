"""What is kept between frames never shows: the same bits for any threads, region and history."""

import threading

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import (
    BitmapSurface,
    Box,
    CellSurface,
    NoiseSurface,
    PlainSurface,
    Projection,
    Quad,
    Radiance,
    RayTable,
    Renderer,
    Scene,
    flat,
    ground,
    place,
    sphere,
    statue,
)

WIDTH, HEIGHT = 300, 170  # neither a multiple of the tiles'
HOME, AWAY = place((-0.5, 0.2, 4.0), yaw_rad=0.4), place((0.5, -0.2, 3.0), yaw_rad=1.0, roll_rad=0.3)
BOX = 1


def scene(pose: np.typing.NDArray[np.float64] = HOME) -> Scene:
    made = Scene()
    made.add(ground(width_m=20.0, length_m=20.0), NoiseSurface(seed=1), flat((0.0, 1.0, 8.0)), "floor")
    made.add(Box(width_m=0.8, height_m=0.8, depth_m=0.8), NoiseSurface(seed=2), pose, "box")
    made.add(statue(height_m=1.5, detail=40), NoiseSurface(seed=3), place((0.7, 0.2, 5.0)), "statue")
    board = CellSurface(cells=np.indices((5, 7)).sum(axis=0) % 2 == 0, cell_m=0.06)
    made.add(Quad(width_m=0.6, height_m=0.5), board, place((0.0, -0.3, 3.5), roll_rad=0.2), "board")
    rgb = np.random.default_rng(1).integers(0, 255, (40, 60, 3), np.uint8)
    made.add(
        Quad(width_m=0.9, height_m=0.6), BitmapSurface(rgb=rgb, width_m=0.9), place((0.1, 0.4, 3.0)), "poster"
    )
    made.add(sphere(radius_m=0.2), PlainSurface(), place((-0.1, -0.6, 4.5)), "ball")
    return made


def view(*, dx_px: float = 0.0, bent: bool = False) -> Projection:
    M = np.array([[260.0, 0.0, WIDTH / 2 + dx_px], [0.0, 260.0, HEIGHT / 2], [0.0, 0.0, 1.0]])
    rays = None
    if bent:
        y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
        r2 = ((x - WIDTH / 2) ** 2 + (y - HEIGHT / 2) ** 2) / 260.0**2
        rays = RayTable(np.stack([x + 0.2 * r2 * (x - WIDTH / 2), y + 0.2 * r2 * (y - HEIGHT / 2)], axis=-1))
    return Projection(M=M, C=np.zeros(3), width=WIDTH, height=HEIGHT, rays=rays)


def bits(frame: Radiance) -> tuple[bytes, bytes, bytes]:
    return frame.radiance.tobytes(), frame.depth_m.tobytes(), frame.ids.tobytes()


def fresh(made: Scene, projection: Projection, *, channels: int = 1) -> tuple[bytes, bytes, bytes]:
    with Renderer(made, threads=1) as renderer:
        return bits(renderer.radiance(projection, channels=channels))


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("bent", [False, True])
def test_threads_do_not_show(channels: int, bent: bool) -> None:
    made, projection = scene(), view(bent=bent)

    with Renderer(made, threads=3) as renderer:
        assert bits(renderer.radiance(projection, channels=channels)) == fresh(
            made, projection, channels=channels
        )


@pytest.mark.parametrize("roi", [(0, 0, 300, 170), (1, 2, 3, 4), (63, 31, 66, 35), (250, 130, 50, 40)])
def test_a_region_is_cut_from_the_whole_picture(roi: tuple[int, int, int, int]) -> None:
    made, (x, y, w, h) = scene(), roi
    with Renderer(made, threads=1) as renderer:
        whole = renderer.radiance(view())
    with Renderer(made, threads=1) as renderer:
        part = renderer.radiance(view(), roi=roi)

    assert (part.radiance == whole.radiance[y : y + h, x : x + w]).all()
    assert (part.depth_m == whole.depth_m[y : y + h, x : x + w]).all()
    assert (part.ids == whole.ids[y : y + h, x : x + w]).all()


@pytest.mark.parametrize("roi", [(-1, 0, 5, 5), (0, 0, 0, 5), (290, 0, 11, 5), (0, 160, 5, 11)])
def test_a_region_outside_the_picture_is_refused(roi: tuple[int, int, int, int]) -> None:
    with Renderer(scene(), threads=1) as renderer, pytest.raises(InvalidInput, match="roi"):
        renderer.radiance(view(), roi=roi)


@pytest.mark.parametrize("bent", [False, True])
def test_a_moved_object_leaves_no_trace(bent: bool) -> None:
    made, projection = scene(), view(bent=bent)
    with Renderer(made, threads=2) as renderer:
        at_home = bits(renderer.radiance(projection))
        made.set_pose(BOX, AWAY)
        away = bits(renderer.radiance(projection))
        made.set_pose(BOX, HOME)
        back = bits(renderer.radiance(projection))

    assert away == fresh(scene(AWAY), projection)
    assert back == at_home != away


def test_a_history_of_regions_and_moves_does_not_show() -> None:
    made, rng = scene(), np.random.default_rng(4)
    with Renderer(made, threads=2, cached_frames=2) as renderer:
        for _ in range(12):
            x, y = (int(v) for v in rng.integers(0, 100, 2))
            made.set_pose(
                BOX, place((*rng.uniform(-0.8, 0.8, 2), rng.uniform(2, 6)), yaw_rad=rng.uniform(0, 3))
            )
            renderer.radiance(view(dx_px=float(rng.integers(0, 3))), roi=(x, y, 150, 60))
        made.set_pose(BOX, AWAY)
        assert bits(renderer.radiance(view())) == fresh(scene(AWAY), view())


def test_an_object_added_later_appears() -> None:
    made = scene()
    with Renderer(made, threads=1) as renderer:
        renderer.radiance(view())
        number = made.add(sphere(radius_m=0.3), NoiseSurface(seed=9), place((0.3, 0.0, 2.5)), "late")
        frame = renderer.radiance(view())

    assert (frame.ids == number).any()
    assert bits(frame) == fresh(made, view())


def test_a_frame_handed_out_never_changes() -> None:
    made = scene()
    with Renderer(made, threads=1) as renderer:
        frame = renderer.radiance(view())
        before = bits(frame)
        made.set_pose(BOX, AWAY)
        renderer.radiance(view())

    assert bits(frame) == before
    with pytest.raises(ValueError, match="read-only"):
        frame.radiance[0, 0] = 1.0


def test_nothing_is_rendered_again_while_nothing_moves() -> None:
    made = scene()
    with Renderer(made, threads=1) as renderer:
        first = renderer.radiance(view())
        made.set_pose(BOX, HOME)
        second = renderer.radiance(view())

    assert np.shares_memory(first.radiance, second.radiance)


def test_a_move_outside_the_view_renders_nothing_again() -> None:
    made = scene()
    far = made.add(sphere(radius_m=0.3), NoiseSurface(), place((50.0, 0.0, 5.0)), "aside")
    with Renderer(made, threads=1) as renderer:
        first = renderer.radiance(view())
        made.set_pose(far, place((50.0, 3.0, 5.0)))
        second = renderer.radiance(view())

    assert np.shares_memory(first.radiance, second.radiance)


def test_the_least_recently_used_frame_is_dropped() -> None:
    with Renderer(scene(), threads=1, cached_frames=6) as renderer:
        frames = [renderer.radiance(view(dx_px=float(k))) for k in range(6)]
        assert np.shares_memory(frames[0].radiance, renderer.radiance(view()).radiance)
        renderer.radiance(view(dx_px=9.0))
        assert np.shares_memory(frames[0].radiance, renderer.radiance(view()).radiance)
        assert not np.shares_memory(frames[1].radiance, renderer.radiance(view(dx_px=1.0)).radiance)


def test_the_frame_of_another_lens_outlives_many_projections_of_a_moving_one() -> None:
    with Renderer(scene(), threads=1, cached_frames=3) as renderer:
        wide = renderer.radiance(view(bent=True))
        frames = [renderer.radiance(view(dx_px=float(k))) for k in range(5)]
        assert np.shares_memory(wide.radiance, renderer.radiance(view(bent=True)).radiance)
        assert np.shares_memory(frames[4].radiance, renderer.radiance(view(dx_px=4.0)).radiance)
        assert not np.shares_memory(frames[0].radiance, renderer.radiance(view()).radiance)


def test_several_threads_may_ask_at_once() -> None:
    made, found = scene(), {}
    with Renderer(made, threads=2, cached_frames=2) as renderer:

        def ask(k: int) -> None:
            found[k] = bits(renderer.radiance(view(dx_px=float(k % 3))))

        askers = [threading.Thread(target=ask, args=(k,)) for k in range(6)]
        for asker in askers:
            asker.start()
        for asker in askers:
            asker.join()

    assert all(found[k] == fresh(made, view(dx_px=float(k % 3))) for k in range(6))


def test_closing_ends_the_threads_and_may_be_done_twice() -> None:
    renderer = Renderer(scene(), threads=2)
    renderer.radiance(view())
    assert any(thread.name.startswith("render") for thread in threading.enumerate())

    renderer.close()
    renderer.close()

    assert not any(thread.name.startswith("render") for thread in threading.enumerate())
    assert bits(renderer.radiance(view())) == fresh(scene(), view())


@pytest.mark.parametrize("arguments", [{"threads": 0}, {"threads": 1, "cached_frames": 0}])
def test_a_renderer_without_threads_or_frames_is_refused(arguments: dict[str, int]) -> None:
    with pytest.raises(InvalidInput, match="at least 1"):
        Renderer(Scene(), **arguments)


def test_only_one_or_three_channels_are_rendered() -> None:
    with Renderer(Scene(), threads=1) as renderer, pytest.raises(InvalidInput, match="channels = 2"):
        renderer.radiance(view(), channels=2)
