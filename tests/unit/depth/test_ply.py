"""PLY files: what is written can be read by anybody who knows the format."""

import numpy as np

from foveacam_pipeline.stereo.ply import ply_bytes
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
