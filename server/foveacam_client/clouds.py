"""Point clouds as the server writes them: PLY, binary, little endian."""

import io
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foveacam_client.cloud_view import cloud_frame
from foveacam_client.part_file import PartFile
from foveacam_client.problems import ClientError, UnexpectedAnswer
from foveacam_client.server_source import ServerSource

if TYPE_CHECKING:
    import numpy as np
    import open3d
    from numpy.typing import NDArray

_KINDS = {"float": "<f4", "uchar": "u1"}
_END = b"end_header\n"


@dataclass(frozen=True, slots=True)
class PointCloud:
    """A point cloud; `ply`: the file's content; `id`: on the server. The arrays need numpy."""

    ply: bytes = field(repr=False)
    id: str | None = None
    source: ServerSource = field(default_factory=ServerSource, repr=False, compare=False)

    def __len__(self) -> int:
        lines, _ = self._parsed()
        return _count(lines)

    def __repr__(self) -> str:
        try:
            return f"PointCloud(id={self.id!r}, {len(self)} points)"
        except UnexpectedAnswer:
            return f"PointCloud(id={self.id!r}, no binary PLY file)"

    def _repr_html_(self) -> str:
        return cloud_frame(self)

    @property
    def vertices(self) -> "NDArray[Any]":  # Any: a record of floats and bytes
        """The points as records with x, y, z (m, rig frame), red, green, blue, and sigma (m, along z)."""
        import numpy as np  # here, since numpy is optional

        lines, content = self._parsed()
        fields = [(words[2], _KINDS[words[1]]) for words in lines if words[:1] == ["property"]]
        return np.frombuffer(content, dtype=np.dtype(fields), count=_count(lines))

    @property
    def points_rig_m(self) -> "NDArray[np.float64]":
        """The points: (n, 3) float64, m, rig frame (x right, y down, z forward)."""
        return self._columns("x", "y", "z").astype("float64")

    @property
    def colors(self) -> "NDArray[np.uint8]":
        """Their colours: (n, 3) uint8, RGB."""
        return self._columns("red", "green", "blue")

    @property
    def sigma_m(self) -> "NDArray[np.float64]":
        """Their standard errors along z: (n,) float64, m."""
        return self.vertices["sigma"].astype("float64")

    def save(self, path: Path | str) -> Path:
        """Write the cloud to a file, which appears when it is complete; return the file's path.

        By the suffix: `.ply`; `.npz`, with `points_rig_m`, `colors` and `sigma_m`; `.glb`, the textured
        surface (+y up), which is read from the server.
        """
        place = Path(path)
        write = _WRITERS.get(place.suffix.lower())
        if write is None:
            raise ClientError(
                f"asked to save a point cloud as {place.name!r}, whose suffix is {place.suffix!r};"
                f" choose one of {', '.join(_WRITERS)}"
            )
        content = write(self)
        with PartFile(place) as file:
            file.write(content)
        return place

    def to_open3d(self) -> "open3d.geometry.PointCloud":
        """Return the points (m, rig frame) with their colours for Open3D, which must be installed."""
        try:
            import open3d
        except ImportError as error:
            raise ClientError(
                "asked for a point cloud of Open3D, and the package open3d is not installed:"
                " pip install open3d"
            ) from error
        made = open3d.geometry.PointCloud()
        made.points = open3d.utility.Vector3dVector(self.points_rig_m)
        made.colors = open3d.utility.Vector3dVector(self.colors / 255.0)
        return made

    def surface_glb(self) -> bytes:
        """Return the textured surface as GLB (m, +y up), read from the server."""
        with self.source.open_rig() as rig:
            return rig.api.clouds.glb(str(self.id)).read()

    def _parsed(self) -> tuple[list[list[str]], bytes]:
        """Return the words of the header's lines, and what follows the header."""
        header, found, content = self.ply.partition(_END)
        lines = header.decode("ascii", "replace").splitlines()
        if not found or lines[:2] != ["ply", "format binary_little_endian 1.0"]:
            raise UnexpectedAnswer("the point cloud is no binary PLY file")
        return [line.split() for line in lines], content

    def _columns(self, *names: str) -> "NDArray[Any]":  # Any: as in the file
        import numpy as np

        vertices = self.vertices
        return np.column_stack([vertices[name] for name in names])


def _count(lines: list[list[str]]) -> int:
    for words in lines:
        if words[:2] == ["element", "vertex"]:
            return int(words[2])
    raise UnexpectedAnswer("the point cloud is a PLY file without vertices")


def _npz(cloud: PointCloud) -> bytes:
    import numpy as np

    content = io.BytesIO()
    np.savez_compressed(content, points_rig_m=cloud.points_rig_m, colors=cloud.colors, sigma_m=cloud.sigma_m)
    return content.getvalue()


_WRITERS: dict[str, Callable[[PointCloud], bytes]] = {
    ".ply": lambda cloud: cloud.ply,
    ".npz": _npz,
    ".glb": PointCloud.surface_glb,
}
"""How the content of a file is made, by its suffix."""
