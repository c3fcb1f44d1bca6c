"""Materials: edges of cells, band limit of noise at every scale, colours, pictures, light."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import (
    BitmapSurface,
    Box,
    CellSurface,
    Lighting,
    Material,
    NoiseSurface,
    PlainSurface,
    Projection,
    Quad,
    Renderer,
    Scene,
    Shape,
    place,
    sphere,
)

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
LIT = Lighting(ambient=1.0)
SIZE = 128


def view(f_px: float = 150.0, *, size: int = SIZE, dx_px: float = 0.0, dy_px: float = 0.0) -> Projection:
    centre = (size - 1) / 2
    M = np.array([[f_px, 0.0, centre + dx_px], [0.0, f_px, centre + dy_px], [0.0, 0.0, 1.0]])
    return Projection(M=M, C=np.zeros(3), width=size, height=size)


def picture(
    material: Material, pose: F64, projection: Projection, *, channels: int = 1, shape: Shape | None = None
) -> F32:
    scene = Scene(LIT)
    scene.add(shape or Quad(width_m=200.0, height_m=200.0), material, pose, "surface")
    with Renderer(scene, threads=1) as renderer:
        return renderer.radiance(projection, channels=channels).radiance


def finer(projection: Projection, times: int) -> Projection:
    """The same view with every pixel cut into times x times."""
    shift = (times - 1) / 2
    scale = np.array([[times, 0.0, shift], [0.0, times, shift], [0.0, 0.0, 1.0]])
    size = projection.width * times
    return Projection(M=scale @ projection.M, C=projection.C, width=size, height=size)


def binned(image: F32, times: int) -> F64:
    h, w = image.shape[0] // times, image.shape[1] // times
    mean: F64 = image.reshape(h, times, w, times).mean(axis=(1, 3), dtype=np.float64)
    return mean


CHECKER = np.indices((8, 8)).sum(axis=0) % 2 == 0


@pytest.mark.parametrize(
    ("cell_m", "roll_rad", "yaw_rad", "rms", "greatest"),
    [
        (0.2, 0.0, 0.0, 1e-3, 5e-3),  # cells of 15 px, upright: the box filter is exact
        (0.2, 0.4, 0.0, 4e-3, 0.05),
        (0.2, 0.3, 0.9, 5e-3, 0.07),
        (0.03, 0.3, 0.6, 8e-3, 0.06),  # cells of 2 px
    ],
)
def test_edges_of_cells_are_those_of_a_supersampled_picture(
    cell_m: float, roll_rad: float, yaw_rad: float, rms: float, greatest: float
) -> None:
    board = CellSurface(cells=CHECKER, cell_m=cell_m, color_0=(0.0, 0.0, 0.0), color_1=(1.0, 1.0, 1.0))
    pose = place((0.011, -0.007, 2.0), roll_rad=roll_rad, yaw_rad=yaw_rad)

    image = picture(board, pose, view())
    truth = binned(picture(board, pose, finer(view(), 16)), 16)

    assert np.sqrt(((image - truth) ** 2).mean()) < rms
    assert np.abs(image - truth).max() < greatest
    assert image.std() > 0.05


def test_cells_far_away_melt_into_their_mean() -> None:
    board = CellSurface(
        cells=np.indices((400, 400)).sum(axis=0) % 2 == 0,
        cell_m=0.01,
        color_0=(0.0, 0.0, 0.0),
        color_1=(1.0, 1.0, 1.0),
    )

    image = picture(
        board, place((0.0, 0.0, 40.0), roll_rad=0.3), view(), shape=Quad(width_m=3.9, height_m=3.9)
    )

    middle = image[60:68, 60:68]
    assert np.allclose(middle, 0.5, atol=0.02)


def test_cells_are_not_mirrored_and_surrounded_by_the_colour_asked_for() -> None:
    corner = np.zeros((2, 2), bool)
    corner[0, 1] = True
    board = CellSurface(cells=corner, cell_m=0.5, color_0=(0.2, 0.2, 0.2), color_1=(0.9, 0.9, 0.9), outside=0)

    image = picture(board, place((0.0, 0.0, 2.0)), view())

    assert image[50, 78] == pytest.approx(0.9)  # above, right
    assert image[50, 50] == pytest.approx(0.2)
    assert image[78, 78] == pytest.approx(0.2)
    assert image[5, 100] == pytest.approx(0.2)


def spread_while_panning(material: Material, pose: F64, f_px: float) -> float:
    """Residual of sub-pixel pans that are shifted back, as a part of the texture's standard deviation."""
    from scipy import ndimage  # slow to import

    stack = []
    for k in range(6):
        dx, dy = k / 6, (2 * k % 6) / 6
        image = picture(material, pose, view(f_px, dx_px=dx, dy_px=dy)).astype(np.float64)
        stack.append(ndimage.shift(image, (-dy, -dx), order=5)[16:-16, 16:-16])
    back = np.stack(stack)
    return float(np.sqrt(back.var(axis=0).mean()) / back.mean(axis=0).std())


@pytest.mark.parametrize(
    ("pose", "f_px"),
    [
        (place((0.0, 0.0, 3.0)), 3000.0),
        (place((0.0, 0.0, 7.3)), 3000.0),
        (place((0.0, 0.0, 30.0), yaw_rad=0.2), 28_000.0),
        (place((0.0, 0.0, 5.0), yaw_rad=1.1), 3000.0),
    ],
)
def test_noise_does_not_shimmer_when_the_camera_pans_by_parts_of_a_pixel(pose: F64, f_px: float) -> None:
    assert spread_while_panning(NoiseSurface(seed=5), pose, f_px) < 0.06


def test_a_texture_without_band_limit_would_shimmer() -> None:
    speckle = np.random.default_rng(0).integers(0, 255, (256, 256, 1), np.uint8).repeat(3, axis=2)
    sharp = CellSurface(cells=speckle[..., 0] > 127, cell_m=0.002)

    assert spread_while_panning(sharp, place((0.0, 0.0, 3.0)), 3000.0) > 0.06


def blurred(image: F64, sigma_px: float) -> F64:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), dtype=np.float64)


@pytest.mark.parametrize("distance_m", [0.7, 1.5, 5.0, 12.0, 30.0])
def test_noise_has_detail_at_a_few_pixels_at_any_distance(distance_m: float) -> None:
    image = picture(NoiseSurface(seed=3, scale_m=2.0), place((0.0, 0.0, distance_m)), view(28_760.0)).astype(
        np.float64
    )

    band = blurred(image, 1.5) - blurred(image, 6.0)

    assert 0.01 < band[20:-20, 20:-20].std() < 0.08


def test_noise_is_the_same_surface_seen_from_near_and_far() -> None:
    near = picture(NoiseSurface(seed=3), place((0.0, 0.0, 2.0)), view(4000.0, size=512)).astype(np.float64)
    far = picture(NoiseSurface(seed=3), place((0.0, 0.0, 8.0)), view(4000.0, size=128)).astype(np.float64)

    small = blurred(near, 4.0)[1::4, 1::4][8:-8, 8:-8]
    wide = blurred(far, 1.0)[8:-8, 8:-8]

    assert np.corrcoef(small.ravel(), wide.ravel())[0, 1] > 0.98


def test_noise_differs_between_seeds_and_between_the_faces_of_a_box() -> None:
    def crop(seed: int, yaw_rad: float) -> F64:
        box = Box(width_m=2.0, height_m=2.0, depth_m=2.0)
        flat = picture(
            NoiseSurface(seed=seed), place((0.0, 0.0, 4.0), yaw_rad=yaw_rad), view(1000.0), shape=box
        )
        return flat.ravel().astype(np.float64)

    front = crop(1, 0.0)

    assert abs(np.corrcoef(front, crop(2, 0.0))[0, 1]) < 0.6
    assert abs(np.corrcoef(front, crop(1, np.pi))[0, 1]) < 0.6
    assert abs(np.corrcoef(front, crop(1, np.pi / 2))[0, 1]) < 0.6


def test_colours_of_noise_lie_between_its_two() -> None:
    a, b = np.array([0.1, 0.5, 0.3]), np.array([0.9, 0.2, 0.4])
    material = NoiseSurface(color_a=(0.1, 0.5, 0.3), color_b=(0.9, 0.2, 0.4), contrast=3.0)

    image = picture(material, place((0.0, 0.0, 2.0)), view(), channels=3)

    along = (image - a) @ (b - a) / ((b - a) @ (b - a))
    assert along.min() >= 0 and along.max() <= 1
    assert np.ptp(along) > 0.3
    assert np.allclose(a + along[..., None] * (b - a), image, atol=1e-6)


def test_stretch_draws_the_pattern_out() -> None:
    image = picture(NoiseSurface(seed=2, stretch=8.0), place((0.0, 0.0, 2.0)), view(2000.0)).astype(
        np.float64
    )

    assert np.diff(image, axis=0).std() > 2 * np.diff(image, axis=1).std()


def test_a_mono_camera_weighs_the_colours() -> None:
    rgb = np.zeros((4, 4, 3), np.uint8)
    rgb[:] = (200, 100, 50)
    for material in (
        PlainSurface(color=(200 / 255, 100 / 255, 50 / 255)),
        BitmapSurface(rgb=rgb, width_m=1.0),
    ):
        image = picture(material, place((0.0, 0.0, 2.0)), view())
        assert np.allclose(image, (0.299 * 200 + 0.587 * 100 + 0.114 * 50) / 255, atol=1e-6)


def test_plain_paint_has_no_texture() -> None:
    assert picture(PlainSurface(), place((0.0, 0.0, 3.0), yaw_rad=0.5), view()).std() < 1e-6


def test_a_bitmap_lies_upright_and_unmirrored_and_melts_into_its_mean() -> None:
    rgb = np.zeros((64, 64, 3), np.uint8)
    rgb[:32, 32:] = 255  # above, right
    poster = BitmapSurface(rgb=rgb, width_m=1.0)

    near = picture(poster, place((0.0, 0.0, 2.0)), view(), shape=Quad(width_m=1.0, height_m=1.0))
    far = picture(poster, place((0.0, 0.0, 400.0)), view(), channels=3)

    assert near[50, 78] == pytest.approx(1.0)
    assert near[50, 50] == near[78, 78] == near[78, 50] == 0.0
    assert far[63:65, 63:65].mean() == pytest.approx(0.25, abs=0.05)


def test_light_falls_from_the_lamp() -> None:
    scene = Scene(Lighting(lamp=(0.0, 0.0, -1.0), ambient=0.3))
    scene.add(sphere(radius_m=1.0), PlainSurface(color=(1.0, 1.0, 1.0)), place((0.0, 0.0, 4.0)), "ball")
    with Renderer(scene, threads=1) as renderer:
        frame = renderer.radiance(view(200.0))

    middle, row = frame.radiance[64, 64], frame.radiance[64]
    assert middle == pytest.approx(1.0, abs=2e-3)
    x = (np.arange(SIZE) - 63.5) / 200.0
    inside = np.abs(x) < 0.2
    # The ray (x, 0, 1) meets the sphere where its normal is (p − c); lamp and camera lie the same way.
    along = (4.0 - np.sqrt(16.0 - 15.0 * (1 + x[inside] ** 2))) / (1 + x[inside] ** 2)
    assert np.allclose(row[inside], 0.3 + 0.7 * (4.0 - along), atol=6e-3)


def test_the_sky_shades_from_horizon_to_zenith() -> None:
    lighting = Lighting(horizon=(0.8, 0.8, 0.8), zenith=(0.2, 0.3, 0.9))
    with Renderer(Scene(lighting), threads=1) as renderer:
        image = renderer.radiance(view(40.0), channels=3).radiance

    assert np.allclose(image[70:], 0.8)
    assert np.allclose(image[0, 64], (0.2, 0.3, 0.9), atol=0.05)


def bad_materials() -> list[tuple[type, dict[str, object], str]]:
    cells = np.ones((2, 2), bool)
    return [
        (NoiseSurface, {"contrast": 0.0}, "contrast"),
        (NoiseSurface, {"scale_m": float("nan")}, "scale_m"),
        (NoiseSurface, {"grain_m": 2.0}, "grain_m"),
        (NoiseSurface, {"color_a": (0.1, 0.2, 1.3)}, "color_a"),
        (PlainSurface, {"color": (-0.1, 0.0, 0.0)}, "color"),
        (CellSurface, {"cells": np.ones(3), "cell_m": 0.1}, "rows, columns"),
        (CellSurface, {"cells": cells, "cell_m": 0.0}, "cell_m"),
        (CellSurface, {"cells": cells, "cell_m": 0.1, "outside": 2}, "outside"),
        (BitmapSurface, {"rgb": np.zeros((4, 4), np.uint8), "width_m": 1.0}, "uint8"),
        (BitmapSurface, {"rgb": np.zeros((4, 4, 3), np.uint8), "width_m": -1.0}, "width_m"),
        (Lighting, {"lamp": (0.0, 0.0, 0.0)}, "lamp"),
        (Lighting, {"ambient": 1.5}, "ambient"),
    ]


@pytest.mark.parametrize(("kind", "arguments", "message"), bad_materials())
def test_a_material_that_cannot_be_used_is_refused_by_name(
    kind: type, arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        kind(**arguments)
