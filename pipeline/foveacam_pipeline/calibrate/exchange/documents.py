"""Schemas of the authors' documents, as far as we read them; other fields are preserved unchanged."""

import base64
import binascii
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from foveacam_pipeline.calibrate.exchange.canonical import ID_DIGITS

Id: TypeAlias = Annotated[str, Field(pattern=rf"^[0-9a-f]{{{ID_DIGITS}}}$")]
Positive: TypeAlias = Annotated[float, Field(gt=0.0)]
RoleLetter: TypeAlias = Literal["L", "C", "R"]
_TYPES = {"Float64Array": "<f8", "Float32Array": "<f4"}


class _Document(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False, frozen=True)


class Point2(_Document):
    """Two numbers; their unit depends on the field."""

    x: float
    y: float


class Point3(_Document):
    """A corner of an object, in sides of the marker."""

    x: float
    y: float
    z: float


class Marker(_Document):
    """Sides of an eye's and of the wide camera's marker, mm."""

    side_mm: Positive
    center_mm: Positive


class Datapoint(_Document):
    """One pose of one eye: corners, volts, and the angle (rad) of the wide camera's marker."""

    img_points: Annotated[list[Point2], Field(min_length=4)]
    obj_points: Annotated[list[Point3], Field(min_length=4)]
    voltage: Point2
    angle: Point2
    wide_img_points: Annotated[list[Point2], Field(min_length=4)] | None = None
    wide_center_points: Annotated[list[Point2], Field(min_length=4)] | None = None
    marker: Marker | None = None

    @model_validator(mode="after")
    def _has_a_place_for_each_corner(self) -> "Datapoint":
        if len(self.img_points) != len(self.obj_points):
            raise ValueError(f"{len(self.img_points)} img_points and {len(self.obj_points)} obj_points")
        return self


class ExtrinsicInner(_Document):
    """The poses of one eye."""

    kind: Literal["extrinsic"]
    dataset: list[Datapoint]


class ArrayProps(_Document):
    """Shape of an array; `channels` per element."""

    shape: list[Annotated[int, Field(ge=0)]]
    channels: Annotated[int, Field(ge=1)] = 1


class TypedArray(_Document):
    """Numbers as the base64 text of their bytes, lowest first."""

    type: Literal["Float64Array", "Float32Array"]
    buffer: str
    props: ArrayProps

    @model_validator(mode="after")
    def _fits_its_shape(self) -> "TypedArray":
        try:
            found = len(base64.b64decode(self.buffer, validate=True))
        except binascii.Error as error:
            raise ValueError(f"buffer is not base64: {error}") from error
        needed = int(np.prod(self.props.shape)) * self.props.channels * np.dtype(_TYPES[self.type]).itemsize
        if found != needed:
            raise ValueError(f"shape {self.props.shape} needs {needed} bytes, the buffer holds {found}")
        if not np.isfinite(self.values()).all():
            raise ValueError("it holds numbers that are not finite")
        return self

    def values(self) -> NDArray[np.float64]:
        """Return the numbers in their shape, float64."""
        flat = np.frombuffer(base64.b64decode(self.buffer), dtype=_TYPES[self.type])
        return flat.astype(np.float64).reshape(self.props.shape)


class ImageSizeDocument(_Document):
    """Size of an image, px."""

    width: Annotated[int, Field(gt=0)]
    height: Annotated[int, Field(gt=0)]


class Solve(_Document):
    """Result of a camera's solve."""

    sensor_size: ImageSizeDocument
    camera_matrix: TypedArray | list[float] | list[list[float]]
    dist_coeffs: TypedArray | list[float] | list[list[float]]
    rms: float | None = None


class IntrinsicInner(_Document):
    """The solve of one camera."""

    kind: Literal["intrinsic"]
    calibration: Solve


class ExportedRecord(_Document):
    """A record as exported."""

    id: str
    created: str
    label: str | None = None
    sources: list[Id] | None = None
    role: RoleLetter | None = None


class DeviceConfig(_Document):
    """The operator's settings of a rig."""

    nickname: str | None = None
    baseline_mm: Positive | None = None
    zoom_override: Annotated[float, Field(ge=0.0)] | None = None
    settle_time_us: Annotated[float, Field(ge=0.0)] | None = None
    delay_compensation_ms: float | None = None
    drift_l: Point2 | None = None
    drift_r: Point2 | None = None
