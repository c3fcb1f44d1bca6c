"""Point clouds as the server writes them: PLY, binary, little endian."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from foveacam_client.problems import UnexpectedAnswer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_KINDS = {"float": "<f4", "uchar": "u1"}
_END = b"end_header\n"


@dataclass(frozen=True, slots=True)
class PointCloud:
    """A point cloud; `ply`: the file's content. The arrays need numpy."""

    ply: bytes = field(repr=False)

    @property
    def vertices(self) -> "NDArray[Any]":  # Any: a record of floats and bytes
        """The points as records with x, y, z (m, rig frame), red, green, blue, and sigma (m, along z)."""
        import numpy as np  # here, since numpy is optional

        header, found, content = self.ply.partition(_END)
        lines = header.decode("ascii", "replace").splitlines()
        if not found or lines[:2] != ["ply", "format binary_little_endian 1.0"]:
            raise UnexpectedAnswer("the point cloud is no binary PLY file")
        words = [line.split() for line in lines]
        number = next(int(word[2]) for word in words if word[:2] == ["element", "vertex"])
        fields = [(word[2], _KINDS[word[1]]) for word in words if word[0] == "property"]
        return np.frombuffer(content, dtype=np.dtype(fields), count=number)

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

    def _columns(self, *names: str) -> "NDArray[Any]":  # Any: as in the file
        import numpy as np

        vertices = self.vertices
        return np.column_stack([vertices[name] for name in names])
