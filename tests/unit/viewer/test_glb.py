import json
import struct
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb

COMPONENT = {5126: np.dtype("<f4"), 5125: np.dtype("<u4")}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


class Glb:
    """A reader of its own, from the glTF 2.0 specification, sections 3.6 and 4.4."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        text_length, text_kind = struct.unpack_from("<I4s", data, 12)
        assert text_kind == b"JSON"
        assert text_length % 4 == 0
        self.document: dict[str, Any] = json.loads(data[20 : 20 + text_length])
        start = 20 + text_length
        binary_length, binary_kind = struct.unpack_from("<I4s", data, start)
        assert binary_kind == b"BIN\0"
        self.binary = data[start + 8 :]
        assert len(self.binary) == binary_length
        assert binary_length % 4 == 0
        assert self.document["buffers"] == [{"byteLength": binary_length}]

    def view(self, index: int) -> bytes:
        view = self.document["bufferViews"][index]
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(self.binary)
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def array(self, index: int) -> NDArray[Any]:
        accessor = self.document["accessors"][index]
        values = np.frombuffer(self.view(accessor["bufferView"]), COMPONENT[accessor["componentType"]])
        return values.reshape(accessor["count"], WIDTH[accessor["type"]])


def tile(*, seed: int = 0) -> DepthMesh:
    rng = np.random.default_rng(seed)
    texture = np.zeros((17, 23, 3), dtype=np.uint8)
    texture[..., 0] = 180
    return DepthMesh(
        vertices_rig_m=rng.normal((0.5, -0.25, 12.0), 0.1, (5, 3)).astype(np.float32),
        faces=np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]], dtype=np.uint32),
        uv=rng.random((5, 2), dtype=np.float32),
        texture=texture,
    )


def test_vertices_coordinates_and_faces_come_back() -> None:
    mesh = tile()
    glb = Glb(write_glb(mesh))
    primitive = glb.document["meshes"][0]["primitives"][0]
    np.testing.assert_array_equal(glb.array(primitive["attributes"]["POSITION"]), mesh.vertices_rig_m)
    np.testing.assert_array_equal(glb.array(primitive["attributes"]["TEXCOORD_0"]), mesh.uv)
    np.testing.assert_array_equal(glb.array(primitive["indices"]).reshape(-1, 3), mesh.faces)


def test_the_stated_bounds_hold_all_vertices() -> None:
    glb = Glb(write_glb(tile()))
    accessor = glb.document["accessors"][0]
    positions = glb.array(0)
    np.testing.assert_array_equal(accessor["min"], positions.min(axis=0))
    np.testing.assert_array_equal(accessor["max"], positions.max(axis=0))


def test_the_texture_is_an_unlit_jpeg_in_true_colours() -> None:
    glb = Glb(write_glb(tile()))
    image = glb.document["images"][0]
    assert image["mimeType"] == "image/jpeg"
    decoded = cv2.imdecode(np.frombuffer(glb.view(image["bufferView"]), np.uint8), cv2.IMREAD_COLOR_RGB)
    assert decoded is not None
    assert decoded.shape == (17, 23, 3)
    red, green, blue = decoded.reshape(-1, 3).mean(axis=0)
    assert red == pytest.approx(180.0, abs=4.0)
    assert max(green, blue) < 10.0
    assert glb.document["materials"][0]["extensions"] == {"KHR_materials_unlit": {}}
    assert glb.document["extensionsUsed"] == ["KHR_materials_unlit"]


def test_vertices_are_relative_to_the_origin_given() -> None:
    mesh = tile()
    positions = Glb(write_glb(mesh, origin_rig_m=(0.5, -0.25, 12.0))).array(0)
    np.testing.assert_allclose(positions, mesh.vertices_rig_m - (0.5, -0.25, 12.0), atol=1e-6)


def test_a_file_that_leaves_the_house_stands_upright() -> None:
    assert "rotation" not in Glb(write_glb(tile())).document["nodes"][0]
    rotation = Glb(write_glb(tile(), y_up=True)).document["nodes"][0]["rotation"]
    assert rotation == [1.0, 0.0, 0.0, 0.0]  # (x, y, z, w): a half turn about x, so -y becomes up


def test_a_mesh_without_faces_is_refused() -> None:
    mesh = tile()
    empty = DepthMesh(
        vertices_rig_m=mesh.vertices_rig_m,
        faces=np.empty((0, 3), dtype=np.uint32),
        uv=mesh.uv,
        texture=mesh.texture,
    )
    with pytest.raises(InvalidInput, match="0 faces"):
        write_glb(empty)
