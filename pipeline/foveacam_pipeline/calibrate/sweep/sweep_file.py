"""The file of a sweep: JSON lines, the header, then one line a pose, each flushed before the next pose.

A truncated last line (power, full disk) is ignored and overwritten by the next append.
"""

import json
import os
from pathlib import Path
from typing import Annotated, Literal, TypeAlias, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from foveacam_hardware.contract import Binning, InvalidInput, PanTiltPose, Station, StationTarget
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import EyePose, Sweep, SweepHeader, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import NodeSpacing, SweepPlan
from foveacam_pipeline.models.content import Plain, plain
from foveacam_pipeline.storage.disk import write_file

FORMAT = "foveacam-sweep"
VERSION = 1
_Known = TypeVar("_Known", bound=BaseModel)
Pair: TypeAlias = tuple[float, float]
Size: TypeAlias = tuple[Annotated[int, Field(gt=0)], Annotated[int, Field(gt=0)]]


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Bearing(_Document):
    pan_rad: float
    tilt_rad: float

    def build(self) -> PanTiltPose:
        return PanTiltPose(pan_rad=self.pan_rad, tilt_rad=self.tilt_rad)


class _Station(_Document):
    name: str
    target: StationTarget
    pose: _Bearing
    distance_m: Annotated[float, Field(gt=0.0)] | None

    def build(self) -> Station:
        return Station(name=self.name, target=self.target, pose=self.pose.build(), distance_m=self.distance_m)


class _Layout(_Document):
    side_m: float
    spacing_m: float
    wide_id: int
    left_id: int
    right_id: int


class _Plan(_Document):
    columns: int
    rows: int
    half_width_rad: float
    half_height_rad: float
    spacing: NodeSpacing


class _Header(_Document):
    rig_id: str
    created_utc: str
    station: _Station
    layout: _Layout
    plan: _Plan
    wide_size: Size
    fovea_size: Size
    max_v: Annotated[float, Field(gt=0.0)]
    wide_serial: str
    left_serial: str
    right_serial: str

    def build(self) -> SweepHeader:
        given = {name: getattr(self, name) for name in type(self).model_fields}
        given["station"] = self.station.build()
        given["layout"] = MarkerLayout(**self.layout.model_dump())
        given["plan"] = SweepPlan(**self.plan.model_dump())
        return SweepHeader(**given)


class _First(_Document):
    format: Literal["foveacam-sweep"]
    version: Literal[1]
    header: _Header


class _Marker(_Document):
    id: int
    corners_px: list[Pair]
    places_m: list[Pair]
    sharpness: Annotated[float, Field(gt=0.0)]
    complete: bool
    sigma_px: float
    white_level: float = 0.0

    def build(self) -> MarkerView:
        return MarkerView(
            id=self.id,
            corners_px=np.array(self.corners_px).reshape(-1, 2),
            places_m=np.array(self.places_m).reshape(-1, 2),
            sharpness=self.sharpness,
            complete=self.complete,
            sigma_px=self.sigma_px,
            white_level=self.white_level,
        )


class _Eye(_Document):
    volts_v: Pair
    corners: _Marker
    centred: bool
    rim: bool
    looks: int

    def build(self) -> EyePose:
        return EyePose(
            volts_v=self.volts_v,
            corners=self.corners.build(),
            centred=self.centred,
            rim=self.rim,
            looks=self.looks,
        )


class _Pose(_Document):
    index: Annotated[int, Field(ge=0)]
    node_rad: Pair
    pan_tilt: _Bearing | None
    t_ns: int
    wide: dict[int, _Marker]
    left: _Eye | None
    right: _Eye | None
    left_refusal: str | None
    right_refusal: str | None
    repeat: Annotated[int, Field(ge=0)] = 0
    run: str = ""
    binning: Binning = 1

    def build(self) -> SweepPose:
        return SweepPose(
            index=self.index,
            node_rad=self.node_rad,
            pan_tilt=self.pan_tilt.build() if self.pan_tilt else None,
            t_ns=self.t_ns,
            wide={marker_id: marker.build() for marker_id, marker in self.wide.items()},
            left=self.left.build() if self.left else None,
            right=self.right.build() if self.right else None,
            left_refusal=self.left_refusal,
            right_refusal=self.right_refusal,
            repeat=self.repeat,
            run=self.run,
            binning=self.binning,
        )


def save_sweep(sweep: Sweep, path: Path) -> None:
    """Write a whole sweep to `path`, atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    poses = (_pose_line(pose) for pose in (*sweep.poses, *sweep.repeats))
    write_file(path, b"".join((_header_line(sweep.header), *poses)))


def append_pose(path: Path, pose: SweepPose) -> None:
    """Append one pose to the file of a sweep, after cutting off the rest of an interrupted append."""
    with path.open("r+b") as stream:
        stream.truncate(_whole_bytes(path))
        stream.seek(0, os.SEEK_END)
        stream.write(_pose_line(pose))
        stream.flush()
        os.fsync(stream.fileno())


def load_sweep(path: Path) -> Sweep:
    """Read a sweep: the last measurement of each pose, and every further visit to one.

    Raise InvalidInput naming file and line.
    """
    if not path.is_file():
        raise InvalidInput(f"sweep {path}: there is no such file; measure the sweep of that station first")
    lines = path.read_bytes()[: _whole_bytes(path)].splitlines()
    if not lines:
        raise InvalidInput(f"sweep {path}: it ends before its header does; delete it and sweep again")
    header = _header(path, lines[0])
    count = header.plan.columns * header.plan.rows
    poses: dict[tuple[int, int], SweepPose] = {}
    for number, line in enumerate(lines[1:], start=2):
        pose = _parsed(path, number, line, _Pose).build()
        if pose.index >= count:
            raise InvalidInput(
                f"sweep {path}, line {number}: pose {pose.index} of a plan of {count}; "
                "restore the file or sweep again"
            )
        poses[pose.index, pose.repeat] = pose
    return Sweep(
        header=header,
        poses=tuple(poses[key] for key in sorted(poses) if key[1] == 0),
        repeats=tuple(pose for pose in poses.values() if pose.repeat > 0),
    )


def read_new_poses(path: Path, *, start_byte: int) -> tuple[list[SweepPose], int]:
    """Return the poses whose lines begin at `start_byte` or after it, and the byte after the last of them."""
    end_byte = _whole_bytes(path)
    lines = path.read_bytes()[start_byte:end_byte].splitlines()
    first = 1 if start_byte == 0 else 0  # the file begins with the header
    return [_Pose.model_validate_json(line).build() for line in lines[first:]], end_byte


def _header(path: Path, line: bytes) -> SweepHeader:
    try:
        document = json.loads(line)
    except ValueError:
        document = None
    found = document.get("format") if isinstance(document, dict) else None
    if found != FORMAT or not isinstance(document, dict) or document.get("version") != VERSION:
        version = document.get("version") if isinstance(document, dict) else None
        raise InvalidInput(
            f"sweep {path}: {FORMAT} version {VERSION} is needed, {found} version {version} was found; "
            "pass the file of a sweep"
        )
    return _parsed(path, 1, line, _First).header.build()


def _parsed(path: Path, number: int, line: bytes, kind: type[_Known]) -> _Known:
    try:
        return kind.model_validate_json(line)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the line"
        raise InvalidInput(
            f"sweep {path}, line {number}: {where}: {first['msg']}; restore the file or sweep again"
        ) from error


def _whole_bytes(path: Path) -> int:
    """Return the number of bytes of the file's whole lines."""
    content = path.read_bytes()
    return content.rfind(b"\n") + 1


def _header_line(header: SweepHeader) -> bytes:
    return _line({"format": FORMAT, "version": VERSION, "header": plain(header)})


def _pose_line(pose: SweepPose) -> bytes:
    return _line(plain(pose))


def _line(document: Plain) -> bytes:
    return json.dumps(document, allow_nan=False, separators=(",", ":")).encode() + b"\n"
