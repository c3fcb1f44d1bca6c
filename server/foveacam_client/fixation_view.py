"""What a notebook shows of a fixation: read once from the server, then held in its output alone.

The pictures are those of the fixation's own look: the left fovea, rectified, and the depth. HTML and PNG
together take at most about 200 kB.
"""

import base64
import html
import json
import struct
from dataclasses import dataclass, field

from foveacam_client.cloud_view import cloud_frame
from foveacam_client.clouds import PointCloud
from foveacam_client.generated import models
from foveacam_client.measured import distance_text
from foveacam_client.pictures import shrunk_picture
from foveacam_client.problems import ClientError, WaitTimeout
from foveacam_client.server_source import ServerSource

CLOUD_WAIT_S = 10.0
"""Timeout for the point cloud of a verged fixation, which is computed after its answer."""
PICTURE_WIDTH_PX, PNG_WIDTH_PX = 320, 240
_GLB_HEADER, _CHUNK_HEADER = struct.Struct("<4sII"), struct.Struct("<I4s")


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationView:
    """Pictures and point cloud of a fixation; `missing`: why there are none, or not all."""

    left_jpg: bytes | None = field(default=None, repr=False)
    depth_png: bytes | None = field(default=None, repr=False)
    cloud: PointCloud | None = None
    missing: str = ""

    def html(self, fixation: models.FixationDocument) -> str:
        """Return the fixation as HTML that needs no server."""
        parts = [
            f"<p>{_heading(fixation)}</p>",
            '<div style="display:flex;gap:8px;flex-wrap:wrap">',
            *(_figure(content, title) for content, title in self._pictures() if content is not None),
            "</div>",
            "" if self.cloud is None else cloud_frame(self.cloud),
            f"<p>{html.escape(self.missing)}</p>" if self.missing else "",
        ]
        return f"<div>{''.join(parts)}</div>"

    def _pictures(self) -> tuple[tuple[bytes | None, str], ...]:
        return (self.left_jpg, "Left fovea"), (self.depth_png, "Depth")

    def png(self) -> bytes | None:
        """Return the picture of the depth as PNG; None without one."""
        if self.depth_png is None:
            return None
        return shrunk_picture(self.depth_png, width_px=PNG_WIDTH_PX, form="png")


def read_view(fixation: models.FixationDocument, source: ServerSource) -> FixationView:
    """Read pictures and point cloud of a fixation; say what is missing instead of raising."""
    if fixation.distance_m is None:
        return FixationView(missing="There is no point cloud, since there is no distance.")
    if fixation.request.get("depth") is False:
        return FixationView(missing="There is no point cloud, since the request left the depth out.")
    try:
        with source.open_rig() as rig:
            cloud = rig.cloud(fixation, timeout_s=CLOUD_WAIT_S if fixation.state == "verged" else 0.0)
            document = rig.api.clouds.get(str(cloud.id))
            depth_png = rig.api.clouds.depth_png(document.id).read()
            surface = None if document.glb_url is None else rig.api.clouds.glb(document.id).read()
    except WaitTimeout:
        return FixationView(missing=f"There is no point cloud; the fixation ended as {fixation.state}.")
    except ClientError as error:
        return FixationView(missing=f"Pictures and point cloud could not be read: {error}")
    return FixationView(
        left_jpg=None if surface is None else texture_of_surface(surface), depth_png=depth_png, cloud=cloud
    )


def texture_of_surface(content: bytes) -> bytes | None:
    """Return the picture in a GLB file; None where there is none."""
    try:
        magic, _, _ = _GLB_HEADER.unpack_from(content)
        length, _ = _CHUNK_HEADER.unpack_from(content, _GLB_HEADER.size)
        start = _GLB_HEADER.size + _CHUNK_HEADER.size
        document = json.loads(content[start : start + length])
        view = document["bufferViews"][document["images"][0]["bufferView"]]
        begin = start + length + _CHUNK_HEADER.size + view.get("byteOffset", 0)
        picture = content[begin : begin + view["byteLength"]]
    except (struct.error, ValueError, LookupError, TypeError):
        return None
    return picture if magic == b"glTF" and picture else None


def _heading(fixation: models.FixationDocument) -> str:
    """Return the line above the pictures: the distance as a number, how it is known, and the id."""
    distance = distance_text(fixation.distance_m, fixation.distance_sigma_m)
    how = fixation.state if fixation.basis is None else f"{fixation.state}, by {fixation.basis}"
    texts = [f"({how}), {fixation.id}", *([fixation.reason] if fixation.reason else [])]
    return f"<b>{html.escape(distance)}</b> {html.escape('; '.join(texts))}"


def _figure(content: bytes, title: str) -> str:
    """Return a picture with its title; a sentence where it is too large to be shown as it is."""
    shown = shrunk_picture(content, width_px=PICTURE_WIDTH_PX, form="jpg")
    if shown is None:
        return f"<p>{title}: the picture is large; pip install opencv-python-headless to show it small.</p>"
    kind = "png" if shown.startswith(b"\x89PNG") else "jpeg"
    data = base64.b64encode(shown).decode("ascii")
    return (
        f'<figure style="margin:0"><img alt="{title}" width="{PICTURE_WIDTH_PX}"'
        f' src="data:image/{kind};base64,{data}"><figcaption>{title}</figcaption></figure>'
    )
