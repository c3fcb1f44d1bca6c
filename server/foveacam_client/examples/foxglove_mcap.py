"""Write a recording, and the point clouds of the newest fixations, as an MCAP file that Foxglove shows.

Images are `foxglove.CompressedImage` on /wide, /left and /right, clouds `foxglove.PointCloud` on /cloud, in
JSON. Needs mcap and numpy.
"""

import base64
import json
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

import foveacam_client
from foveacam_client import PointCloud, Rig

Message = dict[str, Any]  # Any: JSON

FRAME = "rig"
TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
TEXT = {"type": "string"}
BYTES = {"type": "string", "contentEncoding": "base64"}
FIELD = {
    "type": "object",
    "properties": {"name": TEXT, "offset": {"type": "integer"}, "type": {"type": "integer"}},
}
SCHEMAS: dict[str, Message] = {
    "foxglove.CompressedImage": {"timestamp": TIME, "frame_id": TEXT, "data": BYTES, "format": TEXT},
    "foxglove.PointCloud": {
        "timestamp": TIME,
        "frame_id": TEXT,
        "pose": {"type": "object"},
        "point_stride": {"type": "integer"},
        "fields": {"type": "array", "items": FIELD},
        "data": BYTES,
    },
}
NUMERIC = {"uint8": 1, "float32": 7}
"""Numbers of Foxglove's numeric types."""
AT_ORIGIN = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
}


def stamp(t_ns: int) -> Message:
    """Return a time in Foxglove's format."""
    sec, nsec = divmod(t_ns, 10**9)
    return {"sec": sec, "nsec": nsec}


def utc_ns(text: str) -> int:
    """Return the nanoseconds since 1970 of a time of the server."""
    since = datetime.fromisoformat(text) - datetime(1970, 1, 1, tzinfo=UTC)
    return round(since.total_seconds() * 1e6) * 1000


def image(jpeg: bytes, *, t_ns: int, camera: str) -> Message:
    """Return a JPEG picture as a message."""
    data = base64.b64encode(jpeg).decode("ascii")
    return {"timestamp": stamp(t_ns), "frame_id": camera, "data": data, "format": "jpeg"}


def cloud(points: PointCloud, *, t_ns: int) -> Message:
    """Return a point cloud as a message with the unchanged vertices of the PLY file."""
    vertices = points.vertices
    kinds = dict(vertices.dtype.fields or {})
    return {
        "timestamp": stamp(t_ns),
        "frame_id": FRAME,
        "pose": AT_ORIGIN,
        "point_stride": vertices.dtype.itemsize,
        "fields": [
            {"name": name, "offset": offset, "type": NUMERIC[kind.name]}
            for name, (kind, offset, *_) in kinds.items()
        ],
        "data": base64.b64encode(vertices.tobytes()).decode("ascii"),
    }


def images(rig: Rig, recording_id: str) -> Iterator[tuple[str, str, int, Message]]:
    """Yield topic, schema, time and message of every frame of a recording."""
    begun_ns = utc_ns(rig.api.recordings.get(recording_id).created_utc or "1970-01-01T00:00:00+00:00")
    for stream in rig.api.recordings.timeline(recording_id).streams:
        for index, t_s in enumerate(stream.t_s):
            t_ns = begun_ns + round(t_s * 1e9)
            jpeg = rig.api.recordings.frame(recording_id, stream.role, index).read()
            yield (
                f"/{stream.role}",
                "foxglove.CompressedImage",
                t_ns,
                image(jpeg, t_ns=t_ns, camera=stream.role),
            )


def clouds(rig: Rig, count: int) -> Iterator[tuple[str, str, int, Message]]:
    """Yield topic, schema, time and message of the newest clouds."""
    for document in rig.api.clouds.list(limit=count):
        t_ns = utc_ns(document.created_utc)
        points = PointCloud(rig.api.clouds.ply(document.id).read())
        yield "/cloud", "foxglove.PointCloud", t_ns, cloud(points, t_ns=t_ns)


def write(path: Path, messages: Iterator[tuple[str, str, int, Message]]) -> None:
    """Write messages into an MCAP file."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(library="foveacam-client")
        schemas = {
            name: writer.register_schema(
                name=name,
                encoding="jsonschema",
                data=json.dumps({"title": name, "type": "object", "properties": properties}).encode(),
            )
            for name, properties in SCHEMAS.items()
        }
        channels: dict[str, int] = {}
        for topic, schema, t_ns, message in messages:
            if topic not in channels:
                channels[topic] = writer.register_channel(
                    topic=topic, message_encoding="json", schema_id=schemas[schema]
                )
            writer.add_message(
                channels[topic], log_time=t_ns, publish_time=t_ns, data=json.dumps(message).encode()
            )
        writer.finish()  # type: ignore[no-untyped-call]  # of mcap


def main(recording_id: str, path: Path) -> None:
    """Write a recording and the ten newest clouds."""

    def messages() -> Iterator[tuple[str, str, int, Message]]:
        yield from images(rig, recording_id)
        yield from clouds(rig, 10)

    with foveacam_client.connect() as rig:
        write(path, messages())


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
