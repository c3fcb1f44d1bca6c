"""Exports, read back as other programs read them: a known point lies where its pixels say."""

import itertools
import json
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.dataset_scenes import (
    CALIBRATION,
    centroid,
    noise_frame,
    noise_texture,
    painted,
    plane_point,
    raw_px,
    written,
)

from foveacam_hardware.contract import Frame, InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, PlanPosition, Shot, check_dataset
from foveacam_pipeline.capture.dataset.export import FORMATS, ExportChoice, export_dataset, largest_bytes
from foveacam_pipeline.capture.dataset.export.hugging_face import card, features, rows_of
from foveacam_pipeline.capture.dataset.export.views import eye_pinhole
from foveacam_pipeline.capture.dataset.images import decode
from foveacam_pipeline.geometry import homography_apply
from foveacam_pipeline.stereo.rectify import plane_from_raw

RAIL_M = 0.1
Z_M = 5.0
CLOSE_PX = 0.1
"""A dot's centroid after one bilinear warp, against the pose."""
BARE = ExportChoice(seeds_per_pair=0)
SEEDED = ExportChoice(scale=0.5, seeds_per_pair=20)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> tuple[Dataset, NDArray[np.float64]]:
    """Two points towards corners of the field, and the dots that they see, rig frame."""
    first, dot_a = plane_point(0, aim_deg=(6.0, -5.0), z_m=Z_M)
    second, dot_b = plane_point(1, aim_deg=(-5.0, 4.0), z_m=Z_M, rail_m=RAIL_M)
    return painted(tmp_path_factory.mktemp("scene") / "raster", [first, second]), np.array([dot_a, dot_b])


def world(dots_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.add(dots_m, [[0.0, 0.0, 0.0], [RAIL_M, 0.0, 0.0]])


def grey(path: Path) -> NDArray[np.uint8]:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def colmap_images(folder: Path) -> dict[str, tuple[NDArray[np.float64], int, list[str]]]:
    """Return name -> (4, 4) camera_from_world, camera, words of its 2D points; as COLMAP reads them."""
    lines = (folder / "sparse/0/images.txt").read_text().splitlines()[1:]
    found = {}
    for head, tail in zip(lines[0::2], lines[1::2], strict=True):
        _, *numbers, camera, name = head.split()
        w, x, y, z, *translation = (float(number) for number in numbers)
        pose = np.eye(4)
        pose[:3, :3] = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        pose[:3, 3] = translation
        found[name] = pose, int(camera), tail.split()
    return found


def test_colmap_cameras_see_a_known_point_where_it_is(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    dataset, dots_m = scene
    folder = export_dataset(dataset, tmp_path / "colmap", to="colmap", choice=BARE)
    lines = (folder / "sparse/0/cameras.txt").read_text().splitlines()[1:]
    cameras = {int(line.split()[0]): [float(word) for word in line.split()[2:]] for line in lines}
    images = colmap_images(folder)
    assert len(images) == 5  # two foveae a point, and one wide view
    for name, (pose, camera, _) in images.items():
        width, height, fx, fy, cx, cy = cameras[camera]
        point = pose @ np.append(world(dots_m)[int(name.split("/")[1][:5])], 1.0)
        pixel = np.array([fx * point[0] / point[2] + cx, fy * point[1] / point[2] + cy])
        seen = grey(folder / "images" / name)
        assert seen.shape == (height, width)
        assert np.abs(pixel - (centroid(seen) + 0.5)).max() < CLOSE_PX, name


@pytest.mark.parametrize("depth_m", [1.5, 5.0, 40.0])
@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
def test_an_exported_pose_holds_at_any_depth_wherever_the_eyes_meet(role: Role, depth_m: float) -> None:
    volts = CALIBRATION.steer(np.deg2rad(6.0), np.deg2rad(-5.0), distance_m=4.0)
    raw_px = np.array([[0.0, 0.0], [1439.0, 100.0], [700.0, 500.0], [20.0, 1070.0]])
    on_plane_px = homography_apply(plane_from_raw(CALIBRATION, role, volts, depth_m=depth_m), raw_px)
    rays = np.column_stack([on_plane_px / CALIBRATION.fovea_f_px, np.ones(len(raw_px))])
    places_m = CALIBRATION.reference_rig_m(role) + depth_m * rays

    pinhole = eye_pinhole(CALIBRATION, role, volts)

    pose = pinhole.rig_from_camera
    seen = (places_m - pose[:3, 3]) @ pose[:3, :3]
    wanted = homography_apply(pinhole.camera_from_raw, raw_px)
    assert CALIBRATION.fovea_f_px * np.abs(seen[:, :2] / seen[:, 2:] - wanted).max() < 1e-6


def test_colmap_itself_reads_cameras_and_poses_and_sees_a_known_point_where_it_is(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="COLMAP is not installed")
    dataset, dots_m = scene
    folder = export_dataset(dataset, tmp_path / "colmap", to="colmap", choice=BARE)
    model = pycolmap.Reconstruction(folder / "sparse/0")
    assert len(model.images) == 5
    for image in model.images.values():
        seen = grey(folder / "images" / image.name)
        assert (image.camera.height, image.camera.width) == seen.shape
        pixel = image.project_point(world(dots_m)[int(image.name.split("/")[1][:5])])
        assert np.abs(pixel - (centroid(seen) + 0.5)).max() < CLOSE_PX, image.name


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """One point that looks at a textured plane."""
    point, _ = plane_point(0, aim_deg=(4.0, 3.0), z_m=Z_M, texture=noise_texture())
    return painted(tmp_path_factory.mktemp("plane") / "raster", [point])


def test_colmap_seeds_lie_on_the_plane_and_name_the_pixels_that_see_them(
    plane: Dataset, tmp_path: Path
) -> None:
    folder = export_dataset(plane, tmp_path / "colmap", to="colmap", choice=SEEDED)
    lines = (folder / "sparse/0/points3D.txt").read_text().splitlines()[1:]
    images = colmap_images(folder)
    assert 5 < len(lines) <= 20
    for line in lines:
        number, _, _, z_m = line.split()[:4]
        assert float(z_m) == pytest.approx(Z_M, rel=0.005)
        assert line.split()[8:] == ["1", str(int(number) - 1), "2", str(int(number) - 1)]
        left, right = (images[f"{side}/00000-b0.png"][2] for side in ("left", "right"))
        assert left[3 * int(number) - 1] == right[3 * int(number) - 1] == number


def test_nerfstudio_transforms_see_a_known_point_where_it_is(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    dataset, dots_m = scene
    choice = ExportChoice(scale=0.5, seeds_per_pair=0)
    folder = export_dataset(dataset, tmp_path / "nerf", to="nerfstudio", choice=choice)
    document = json.loads((folder / "transforms.json").read_text())
    applied = np.array(document["applied_transform"])
    assert len(document["frames"]) == 4
    for frame in document["frames"]:
        dot = world(dots_m)[int(Path(frame["file_path"]).name[:5])]
        x, y, z = (np.linalg.inv(frame["transform_matrix"]) @ np.append(applied @ np.append(dot, 1.0), 1.0))[
            :3
        ]
        assert z < 0.0  # OpenGL looks along -z
        pixel = np.array(
            [document["cx"] + document["fl_x"] * x / -z, document["cy"] - document["fl_y"] * y / -z]
        )
        seen = grey(folder / frame["file_path"])
        assert seen.shape == (document["h"], document["w"])
        assert np.abs(pixel - (centroid(seen) + 0.5)).max() < CLOSE_PX
    assert (folder / document["ply_file_path"]).read_bytes().startswith(b"ply\n")


def test_nerfstudio_seeds_stand_in_the_world_of_the_poses_and_project_into_their_images(
    plane: Dataset, tmp_path: Path
) -> None:
    folder = export_dataset(plane, tmp_path / "nerf", to="nerfstudio", choice=SEEDED)
    document = json.loads((folder / "transforms.json").read_text())
    content = (folder / document["ply_file_path"]).read_bytes().partition(b"end_header\n")[2]
    kind = [(name, "<f4") for name in "xyz"] + [(name, "u1") for name in ("red", "green", "blue")]
    vertices = np.frombuffer(content, dtype=kind)
    places = np.column_stack([*(vertices[name] for name in "xyz"), np.ones(len(vertices))])
    assert 5 < len(places) <= 20
    assert places[:, 1] == pytest.approx(np.full(len(places), Z_M), rel=0.005)  # z up: forward is y
    for frame in document["frames"]:
        seen = places @ np.linalg.inv(frame["transform_matrix"]).T
        across = document["cx"] + document["fl_x"] * seen[:, 0] / -seen[:, 2]
        down = document["cy"] - document["fl_y"] * seen[:, 1] / -seen[:, 2]
        assert np.all((across > 0) & (across < document["w"]) & (down > 0) & (down < document["h"]))


def test_the_authors_folders_reproject_a_known_point_by_their_q(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    dataset, dots_m = scene
    folder = export_dataset(dataset, tmp_path / "authors", to="authors")
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    numbered = [f"{name}/{n}.{kind}" for n in ("00", "01") for name, kind in (
        ("center", "png"), ("diff", "png"), ("fovea", "json"), ("left", "json"), ("left", "png"),
        ("right", "json"), ("right", "png"))]  # fmt: skip
    assert names == sorted([*numbered, "wide.json", "wide.png"])
    assert dataset.calibration is not None
    eye_m = dataset.calibration.reference_rig_m(Role.LEFT)
    for number, dot_m in enumerate(dots_m):
        facts = json.loads((folder / f"fovea/{number:02d}.json").read_text())
        left, right = (
            np.asarray(
                cv2.imread(str(folder / f"{side}/{number:02d}.png"), cv2.IMREAD_UNCHANGED), dtype=np.uint16
            )
            for side in ("left", "right")
        )
        (x, y), (x_right, y_right) = centroid(left), centroid(right)
        place = np.array(facts["Q"]) @ [x, y, x - x_right, 1.0]
        assert abs(y - y_right) < CLOSE_PX
        found_m = place[:3] / place[3] / 1e3 + eye_m
        sigma_m = Z_M**2 / (facts["baseline"] / 1e3 * dataset.calibration.fovea_f_px) * CLOSE_PX
        assert np.abs(found_m - dot_m).max() < 2 * sigma_m
        angles = json.loads((folder / f"left/{number:02d}.json").read_text())["angle"]
        assert (angles["x"], angles["y"]) == dataset[number].pose.left_rad


def test_rows_for_hugging_face_hold_the_images_and_where_they_look(
    scene: tuple[Dataset, NDArray[np.float64]],
) -> None:
    dataset, dots_m = scene
    row = next(rows_of(dataset[1]))
    assert set(row) == set(features())
    assert (row["point"], row["rail_m"]) == (1, RAIL_M)
    assert_row(row, dataset, dots_m)
    assert card(dataset).startswith("---\nlicense: other\n")


def assert_row(row: dict[str, object], dataset: Dataset, dots_m: NDArray[np.float64]) -> None:
    """The dot of a row's picture is where the row's pose and the dataset's calibration see it."""
    volts = dataset[1].pose.volts
    assert volts is not None
    assert (row["left_x_v"], row["right_y_v"]) == (volts.left.x_v, volts.right.y_v)
    for role in (Role.LEFT, Role.RIGHT):
        picture = row[role.value]
        assert isinstance(picture, dict)
        seen = centroid(decode(picture["bytes"], what="a row"))
        assert np.abs(seen - raw_px(role, volts, dots_m[1])).max() < CLOSE_PX


def test_parquet_for_hugging_face_comes_back(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `export` is not installed")
    dataset, dots_m = scene
    folder = export_dataset(dataset, tmp_path / "hf", to="hugging-face")
    table = parquet.read_table(folder / "data" / "train-00000-of-00001.parquet")
    described = json.loads(table.schema.metadata[b"huggingface"])
    assert described["info"]["features"]["left"] == {"_type": "Image"}
    assert_row(table.to_pylist()[1], dataset, dots_m)


def test_without_pyarrow_a_sentence_says_what_to_install_and_nothing_is_left(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(InvalidInput, match=r"needs pyarrow.*foveacam-duo\[export\]"):
        export_dataset(scene[0], tmp_path / "hf", to="hugging-face")
    assert list(tmp_path.iterdir()) == []


def zarr_array(folder: Path) -> NDArray[np.generic]:
    """Return an array of Zarr 2 as its specification says how to read it."""
    about = json.loads((folder / ".zarray").read_text())
    assert (about["zarr_format"], about["order"], about["filters"]) == (2, "C", None)
    assert (about["compressor"]["id"], about["dimension_separator"]) == ("zlib", "/")
    found = np.full(about["shape"], about["fill_value"], dtype=about["dtype"])
    steps = [range(0, size, chunk) for size, chunk in zip(about["shape"], about["chunks"], strict=True)]
    for corner in itertools.product(*steps):
        place = [start // chunk for start, chunk in zip(corner, about["chunks"], strict=True)]
        content = zlib.decompress(folder.joinpath(*map(str, place)).read_bytes())
        area = tuple(slice(start, start + size) for start, size in zip(corner, about["chunks"], strict=True))
        found[area] = np.frombuffer(content, dtype=about["dtype"]).reshape(about["chunks"])
    return found


def test_ome_zarr_holds_all_pictures_their_levels_and_where_they_look(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    dataset, _ = scene
    folder = export_dataset(dataset, tmp_path / "zarr", to="ome-zarr")
    about = json.loads((folder / "left.ome.zarr/.zattrs").read_text())
    (described,) = about["multiscales"]
    assert [axis["name"] for axis in described["axes"]] == ["t", "c", "y", "x"]
    assert [level["path"] for level in described["datasets"]] == ["0", "1", "2", "3"]
    whole = zarr_array(folder / "left.ome.zarr/0")
    assert whole.shape == (2, 1, 1080, 1440)
    for number, point in enumerate(dataset):
        assert np.array_equal(whole[number, 0], point.left)
        exposure = about["foveacam"]["exposures"][number]
        assert (exposure["left_ax_rad"], exposure["left_ay_rad"]) == point.pose.left_rad
    assert zarr_array(folder / "wide.ome.zarr/0").shape[0] == sum(
        frame.role is Role.WIDE for point in dataset for frame in point.frames
    )


def test_all_levels_of_ome_zarr_see_a_dot_at_the_same_place(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    folder = export_dataset(scene[0], tmp_path / "zarr", to="ome-zarr") / "left.ome.zarr"
    levels = json.loads((folder / ".zattrs").read_text())["multiscales"][0]["datasets"]
    places = []
    for level in levels:
        scale, shift = level["coordinateTransformations"]
        y_x = centroid(np.asarray(zarr_array(folder / level["path"])[0, 0], dtype=np.uint8))[::-1]
        places.append(np.array(scale["scale"][2:]) * y_x + shift["translation"][2:])
    assert (
        np.abs(np.array(places) - places[0]).max() < 0.5
    )  # rounding of grey levels at an eighth of the size


def test_ome_zarr_keeps_all_bits_and_colours_and_refuses_pictures_that_differ(tmp_path: Path) -> None:
    deep = [noise_frame(Role.LEFT, index, bits=10, color=True) for index in range(2)]
    dataset = dataset_of(tmp_path / "deep", deep)
    folder = export_dataset(dataset, tmp_path / "zarr", to="ome-zarr")
    found = zarr_array(folder / "left.ome.zarr/0")
    assert found.dtype == np.uint16
    assert np.array_equal(found[1].transpose(1, 2, 0), deep[1].image)
    assert not (folder / "wide.ome.zarr").exists()
    mixed = dataset_of(tmp_path / "mixed", [deep[0], noise_frame(Role.LEFT, 1)])
    with pytest.raises(InvalidInput, match="differ in size, bits or binning"):
        export_dataset(mixed, tmp_path / "out", to="ome-zarr")
    assert not (tmp_path / "out").exists()


def dataset_of(folder: Path, frames: list[Frame]) -> Dataset:
    """Return a dataset of one frame a point."""
    points = [
        CapturedPoint(place=PlanPosition(index=index), shots=(Shot(frame=frame),))
        for index, frame in enumerate(frames)
    ]
    return painted(folder, points)


@pytest.mark.parametrize("to", FORMATS)
def test_no_export_is_larger_than_told_before(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path, to: str
) -> None:
    folder = export_dataset(scene[0], tmp_path / "out", to=to)
    size_bytes = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    assert size_bytes <= largest_bytes(scene[0], to)


def test_an_export_overwrites_nothing_and_leaves_the_dataset_as_it_was(
    scene: tuple[Dataset, NDArray[np.float64]], tmp_path: Path
) -> None:
    (tmp_path / "mine").mkdir()
    with pytest.raises(InvalidInput, match="exists already"):
        export_dataset(scene[0], tmp_path / "mine", to="colmap")
    with pytest.raises(InvalidInput, match="hugging-face, colmap, nerfstudio, ome-zarr, authors"):
        export_dataset(scene[0], tmp_path / "new", to="zip")
    assert check_dataset(scene[0].folder) == []


@pytest.mark.parametrize("to", [name for name in FORMATS if name not in ("hugging-face", "ome-zarr")])
def test_poses_without_a_calibration_are_refused(tmp_path: Path, to: str) -> None:
    with pytest.raises(NotCalibrated, match="has no calibration"):
        export_dataset(written(tmp_path / "raster", 1), tmp_path / "out", to=to)
    assert not (tmp_path / "out").exists()
