"""PLY files: what is written can be read by anybody who knows the format."""

from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.ply import ply_bytes, write_ply
from foveacam_pipeline.stereo.values import Cloud

KINDS = {"float": "<f4", "uchar": "u1"}


def some_cloud(points: int = 257) -> Cloud:
    rng = np.random.default_rng(8)
    return Cloud(
        points_rig_m=rng.normal(0.0, 5.0, (points, 3)).astype(np.float32),
        colors=rng.integers(0, 256, (points, 3)).astype(np.uint8),
        sigma_m=rng.uniform(0.001, 0.1, points).astype(np.float32),
    )


def read(data: bytes) -> tuple[list[str], np.ndarray]:
    """Read a PLY of one element by its header alone."""
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode("ascii").splitlines()
    properties = [line.split()[1:] for line in lines if line.startswith("property")]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    rows = np.frombuffer(body, dtype=[(name, KINDS[kind]) for kind, name in properties])
    assert len(rows) == count
    return lines, rows


def test_every_value_comes_back() -> None:
    cloud = some_cloud()
    _, rows = read(ply_bytes(cloud))
    np.testing.assert_array_equal(np.column_stack([rows[axis] for axis in "xyz"]), cloud.points_rig_m)
    np.testing.assert_array_equal(np.column_stack([rows[c] for c in ("red", "green", "blue")]), cloud.colors)
    np.testing.assert_array_equal(rows["sigma"], cloud.sigma_m)


def test_the_header_names_format_frame_and_units() -> None:
    lines, _ = read(ply_bytes(some_cloud()))
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    comments = " ".join(line for line in lines if line.startswith("comment"))
    assert "frame: rig" in comments and "units: metres" in comments and "z forward" in comments


def test_an_empty_cloud_is_a_valid_file() -> None:
    _, rows = read(ply_bytes(some_cloud(0)))
    assert len(rows) == 0


def test_a_file_is_written_whole_over_an_older_one(tmp_path: Path) -> None:
    path = tmp_path / "cloud.ply"
    path.write_text("older")
    write_ply(some_cloud(), path)
    assert path.read_bytes() == ply_bytes(some_cloud())
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.ply"]


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"no-such/cloud\.ply: No such file"):
        write_ply(some_cloud(), tmp_path / "no-such" / "cloud.ply")
