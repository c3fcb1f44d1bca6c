"""Read and write the calibration file: JSON with format, version and content hash, written atomically."""

import json
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from foveacam_hardware.contract import InvalidInput, NotCalibrated
from foveacam_pipeline.geometry.polynomial import BivariatePolynomial, exponents
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.models.content import Plain, content_id, plain
from foveacam_pipeline.models.homography import ENTRIES, HomographyField
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import MirrorModel
from foveacam_pipeline.storage.disk import write_file

FORMAT = "foveacam-calibration"
VERSION = 2

Number: TypeAlias = Annotated[float, Field(ge=-1e12, le=1e12)]
"""Any number; the bounds keep results computed with it finite."""
Positive: TypeAlias = Annotated[float, Field(gt=0.0, le=1e12)]
NotNegative: TypeAlias = Annotated[float, Field(ge=0.0, le=1e12)]
Pair: TypeAlias = tuple[Number, Number]
PixelCount: TypeAlias = Annotated[int, Field(gt=0, le=1_000_000)]


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Polynomial(_Document):
    order: Annotated[int, Field(ge=0, le=12)]
    centre: Pair
    scale: tuple[Positive, Positive]
    coefficients: list[list[Number]]

    @model_validator(mode="after")
    def _has_its_rows(self) -> "_Polynomial":
        rows, widths = len(self.coefficients), {len(row) for row in self.coefficients}
        if rows != len(exponents(self.order)) or len(widths) != 1:
            raise ValueError(
                f"order {self.order} needs {len(exponents(self.order))} rows of coefficients of one width, "
                f"{rows} of widths {sorted(widths)} were found"
            )
        return self

    def build(self, outputs: int) -> BivariatePolynomial:
        coefficients = np.array(self.coefficients, dtype=np.float64)
        if coefficients.shape[1] != outputs:
            raise InvalidInput(
                f"calibration file: a polynomial with {outputs} outputs is needed, "
                f"{coefficients.shape[1]} were found; restore the file or calibrate again"
            )
        return BivariatePolynomial(
            order=self.order, centre=self.centre, scale=self.scale, coefficients=coefficients
        )


class _Mirror(_Document):
    forward: _Polynomial
    inverse: _Polynomial
    hull_rad: Annotated[list[Pair], Field(min_length=3)]
    margin_rad: NotNegative
    max_v: tuple[Positive, Positive]
    sigma_rad: tuple[NotNegative, NotNegative]
    loo_rad: tuple[NotNegative, NotNegative]

    def build(self) -> MirrorModel:
        hull: NDArray[np.float64] = np.array(self.hull_rad, dtype=np.float64)
        return MirrorModel(
            forward=self.forward.build(2),
            inverse=self.inverse.build(2),
            hull_rad=hull,
            margin_rad=self.margin_rad,
            max_v=self.max_v,
            sigma_rad=self.sigma_rad,
            loo_rad=self.loo_rad,
        )


class _Homography(_Document):
    polynomial: _Polynomial
    centre_px: Pair
    scale_px: Positive
    loo_px: NotNegative

    def build(self) -> HomographyField:
        return HomographyField(
            polynomial=self.polynomial.build(ENTRIES),
            centre_px=self.centre_px,
            scale_px=self.scale_px,
            loo_px=self.loo_px,
        )


class _Eye(_Document):
    mirror: _Mirror
    homography: _Homography
    pivot_offset_m: tuple[Number, Number, Number]
    pivot_sigma_m: NotNegative
    reference_depth_m: Positive | None

    def build(self) -> EyeCalibration:
        return EyeCalibration(
            mirror=self.mirror.build(),
            homography=self.homography.build(),
            pivot_offset_m=self.pivot_offset_m,
            pivot_sigma_m=self.pivot_sigma_m,
            reference_depth_m=self.reference_depth_m,
        )


class _Intrinsics(_Document):
    width: PixelCount
    height: PixelCount
    fx_px: Positive
    fy_px: Positive
    cx_px: Number
    cy_px: Number
    distortion: Annotated[tuple[Number, ...], Field(min_length=4, max_length=14)]
    known_tan: Positive | None = None


class _Content(_Document):
    rig_id: Annotated[str, Field(min_length=1)]
    created_utc: str
    origin: Literal["factory", "measured", "corrected", "imported"]
    label: str
    wide: _Intrinsics
    left: _Eye
    right: _Eye
    baseline_m: Positive
    fovea_f_px: Positive
    fovea_width: PixelCount
    fovea_height: PixelCount
    pupil_m: Number
    parent_id: str | None
    session_id: str | None

    @model_validator(mode="after")
    def _has_a_date(self) -> "_Content":
        if datetime.fromisoformat(self.created_utc).tzinfo is None:
            raise ValueError("created_utc has no time zone; write it as 2026-01-31T12:00:00+00:00")
        return self

    def build(self) -> Calibration:
        return Calibration(
            rig_id=self.rig_id,
            created_utc=self.created_utc,
            origin=self.origin,
            label=self.label,
            wide=Intrinsics(**self.wide.model_dump()),
            left=self.left.build(),
            right=self.right.build(),
            baseline_m=self.baseline_m,
            fovea_f_px=self.fovea_f_px,
            fovea_width=self.fovea_width,
            fovea_height=self.fovea_height,
            pupil_m=self.pupil_m,
            parent_id=self.parent_id,
            session_id=self.session_id,
        )


def save_calibration(calibration: Calibration, path: Path) -> None:
    """Write the calibration to `path` atomically and durably."""
    content = calibration_bytes(calibration)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content)


def calibration_bytes(calibration: Calibration) -> bytes:
    """Return the content of a calibration file."""
    return (json.dumps(calibration_document(calibration), indent=1, allow_nan=False) + "\n").encode()


def calibration_document(calibration: Calibration) -> dict[str, Plain]:
    """Return the document of a calibration file; `calibration_from` reads it."""
    content = plain(calibration)
    return {"format": FORMAT, "version": VERSION, "hash": content_id(content), "calibration": content}


def load_calibration(path: Path) -> Calibration:
    """Read a calibration; raise NotCalibrated when there is none, InvalidInput when it cannot be trusted."""
    return _built(_content_of(_read(path), str(path)), str(path))


def calibration_from(document: object, *, what: str) -> Calibration:
    """Return the calibration of a document that another JSON library may have rewritten.

    Its numbers may be written differently (1 for 1.0); `what` names the document in error messages.
    """
    content = _version_of(_as_file(document, what), what)
    calibration = _built(content, what)
    found = document.get("hash") if isinstance(document, dict) else None
    if calibration.id != found:
        raise _changed(calibration.id, found, what)
    return calibration


def _built(content: Plain, what: str) -> Calibration:
    try:
        return _Content.model_validate_json(json.dumps(content)).build()
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "calibration"
        raise InvalidInput(
            f"calibration file {what}: {where}: {first['msg']}; restore the file or calibrate again"
        ) from error


def _read(path: Path) -> dict[str, Any]:  # Any: JSON of unknown shape, checked by _Content
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise NotCalibrated(
            f"no calibration file at {path}; calibrate the rig or give another path"
        ) from error
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise InvalidInput(
            f"calibration file {path} cannot be read as JSON ({error}); restore it or calibrate again"
        ) from error
    return _as_file(document, str(path))


def _as_file(document: object, what: str) -> dict[str, Any]:  # Any: as above
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        found = document.get("format") if isinstance(document, dict) else type(document).__name__
        raise InvalidInput(
            f"{what}: format {FORMAT!r} is needed, {found!r} was found; give a calibration file of a rig"
        )
    return document


def _version_of(document: dict[str, Any], what: str) -> Plain:  # Any: as above
    version = document.get("version")
    if version != VERSION:
        raise InvalidInput(
            f"calibration file {what}: version {version!r} was found, this program reads {VERSION}; "
            "use the program that wrote it or calibrate again"
        )
    content: Plain = document.get("calibration")
    return content


def _content_of(document: dict[str, Any], what: str) -> Plain:  # Any: as above
    content = _version_of(document, what)
    try:
        found = content_id(content)
    except ValueError as error:
        raise InvalidInput(f"calibration file {what}: {error}; restore it or calibrate again") from error
    if found != document.get("hash"):
        raise _changed(found, document.get("hash"), what)
    return content


def _changed(found: str, stated: object, what: str) -> InvalidInput:
    return InvalidInput(
        f"calibration file {what}: its content hashes to {found}, the file says {stated!r}: it was changed "
        "after it was written; restore it or calibrate again"
    )
