"""Writes a textured depth mesh as one GLB file (glTF 2.0): unlit material, texture embedded as JPEG."""

import json
import struct
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.values import DepthMesh

# Names and numbers of the glTF 2.0 specification, sections 3.6, 3.8 and 4.4
_MAGIC, _VERSION, _JSON_CHUNK, _BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED_INT = 5126, 5125
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP_TO_EDGE = 9729, 9987, 33071
_HALF_TURN_ABOUT_X = [1.0, 0.0, 0.0, 0.0]
TEXTURE_QUALITY = 88


@dataclass(slots=True)
class _Buffer:
    """Collects the binary chunk and its buffer views; each part starts at a multiple of 4 bytes."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, int]] = field(default_factory=list)

    def add(self, part: bytes, *, target: int | None = None) -> int:
        """Append `part`; return the index of its view."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(part)}
        self.views.append(view if target is None else view | {"target": target})
        self.data += part + bytes(-len(part) % 4)
        return len(self.views) - 1


def write_glb(
    mesh: DepthMesh, *, origin_rig_m: tuple[float, float, float] = (0.0, 0.0, 0.0), y_up: bool = False
) -> bytes:
    """Return the bytes of a GLB file of `mesh`, vertices in metres relative to `origin_rig_m` (rig frame).

    `y_up`: turn the mesh to glTF's convention (+y up) for other programs; the rig frame is +y down.
    """
    if len(mesh.vertices_rig_m) == 0 or len(mesh.faces) == 0:
        raise InvalidInput(
            f"a mesh of {len(mesh.vertices_rig_m)} vertices and {len(mesh.faces)} faces cannot be written "
            "as GLB; it needs at least one face"
        )
    vertices_m = (mesh.vertices_rig_m - np.asarray(origin_rig_m)).astype("<f4")
    buffer = _Buffer()
    positions = buffer.add(vertices_m.tobytes(), target=_ARRAY_BUFFER)
    coordinates = buffer.add(mesh.uv.astype("<f4").tobytes(), target=_ARRAY_BUFFER)
    indices = buffer.add(mesh.faces.astype("<u4").tobytes(), target=_ELEMENT_ARRAY_BUFFER)
    picture = buffer.add(_jpeg(mesh.texture))
    accessors = [
        {
            "bufferView": positions,
            "componentType": _FLOAT,
            "count": len(vertices_m),
            "type": "VEC3",
            "min": vertices_m.min(axis=0).tolist(),
            "max": vertices_m.max(axis=0).tolist(),
        },
        {"bufferView": coordinates, "componentType": _FLOAT, "count": len(mesh.uv), "type": "VEC2"},
        {"bufferView": indices, "componentType": _UNSIGNED_INT, "count": mesh.faces.size, "type": "SCALAR"},
    ]
    node: dict[str, object] = {"mesh": 0, "name": "depth mesh"}
    if y_up:
        node["rotation"] = _HALF_TURN_ABOUT_X
    document = _SCENE | {
        "nodes": [node],
        "images": [{"bufferView": picture, "mimeType": "image/jpeg"}],
        "accessors": accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _container(document, bytes(buffer.data))


_SCENE: dict[str, object] = {
    "asset": {"version": "2.0", "generator": "FoveaCam Duo"},
    "extensionsUsed": ["KHR_materials_unlit"],
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}
    ],
    "materials": [
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0},
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "extensions": {"KHR_materials_unlit": {}},
            "doubleSided": True,
        }
    ],
    "textures": [{"sampler": 0, "source": 0}],
    "samplers": [
        {
            "magFilter": _LINEAR,
            "minFilter": _LINEAR_MIPMAP_LINEAR,
            "wrapS": _CLAMP_TO_EDGE,
            "wrapT": _CLAMP_TO_EDGE,
        }
    ],
}


def _container(document: dict[str, object], binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        (
            struct.pack("<III", _MAGIC, _VERSION, length),
            struct.pack("<II", len(text), _JSON_CHUNK),
            text,
            struct.pack("<II", len(binary), _BINARY_CHUNK),
            binary,
        )
    )


def _jpeg(texture: NDArray[np.uint8]) -> bytes:
    pixels = texture if texture.ndim == 2 else cv2.cvtColor(texture, cv2.COLOR_RGB2BGR)
    done, buffer = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, TEXTURE_QUALITY])
    if not done:
        raise InvalidInput(f"a texture of {texture.shape} {texture.dtype} could not be encoded as JPEG")
    return buffer.tobytes()
