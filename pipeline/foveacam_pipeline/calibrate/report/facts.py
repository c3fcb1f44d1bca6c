"""Data of a report beside the calibration itself: its session, its check and the drift checks since.

The types match the server's documents (degrees, milliseconds); parts may be missing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput

_Facts = TypeVar("_Facts")


@dataclass(frozen=True, slots=True, kw_only=True)
class LensFacts:
    """One fit of the wide camera."""

    model: str
    rms_px: float
    fov_x_deg: float
    fov_y_deg: float
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...] = ()
    accuracy_deg: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardFacts:
    """The board of the wide camera's views."""

    kind: str
    columns: int
    rows: int
    square_mm: float
    marker_mm: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WideFacts:
    """Stage 1; `samples` as the session lists them, of which only the number is used."""

    samples: tuple[dict[str, Any], ...] = ()  # Any: documents of views, not read
    coverage_fraction: float | None = None
    tilts_covered: float | None = None
    fit: LensFacts | None = None
    other_model: LensFacts | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LensParameterFacts:
    """A parameter of a fovea's lens; `assumed`: the views do not tell it."""

    name: str
    value: float
    sigma: float
    assumed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class FoveaFitFacts:
    """The fit of a fovea's lens."""

    rms_px: float
    fov_x_deg: float
    fov_y_deg: float
    parameters: tuple[LensParameterFacts, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FoveaLensFacts:
    """The lens of a fovea; of `samples` only the number is used."""

    camera: str
    samples: tuple[dict[str, Any], ...] = ()  # Any: documents of views, not read
    fit: FoveaFitFacts | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeFacts:
    """One pose of a sweep; `left`, `right`: centred, rim, refused or waiting."""

    index: int
    ax_deg: float
    ay_deg: float
    left: str
    right: str
    left_reason: str | None = None
    right_reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepFacts:
    """Stage 2 at one station."""

    station: str
    distance_m: float | None = None
    nodes: int = 0
    done: int = 0
    poses: tuple[NodeFacts, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """One candidate for a mirror, by its leave-one-out error (ax, ay)."""

    name: str
    eye: str
    loo_deg: tuple[float, float]
    order: int | None = None
    chosen: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MountDriftFacts:
    """Drift of an eye's mount during the sweeps, fovea px; `knocks_px`: steps at knocks."""

    px_per_minute: float
    moved_px: float
    sigma_px: float
    minutes: float
    knocks_px: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosingFacts:
    """Drift between the sweeps and the check; `corrected`: whether it was corrected."""

    corrected: bool
    rows_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FitFacts:
    """Result of the fit; `paper`, `parallax`: figures by name."""

    calibration_id: str = ""
    models: tuple[ModelFacts, ...] = ()
    volts_roundtrip_max_lsb: float | None = None
    paper: dict[str, Any] | None = None  # Any: figures of several shapes, shown as they are
    parallax: dict[str, Any] | None = None  # Any: as above
    drift: dict[str, MountDriftFacts] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisFacts:
    """Settling of one axis of one mirror; None where it could not be measured.

    `response_ms`: until half of a step is done; `response_open_ms`: the same with the filter wide open.
    """

    eye: str
    axis: str
    settle_ms: float | None = None
    settle_1pct_ms: float | None = None
    resonance_hz: float | None = None
    quality: float | None = None
    response_ms: float | None = None
    response_open_ms: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SettleFacts:
    """Settling of the mirrors."""

    axes: tuple[AxisFacts, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckFacts:
    """Errors of the calibration at poses outside the sweep."""

    epipolar_rms_px: float | None = None
    epipolar_p95_px: float | None = None
    pointing_rms_px: float | None = None
    poses: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFacts:
    """Everything measured for one calibration."""

    id: str
    label: str
    rig_id: str
    created_utc: str
    board: BoardFacts | None = None
    wide: WideFacts | None = None
    lenses: tuple[FoveaLensFacts, ...] = ()
    sweeps: tuple[SweepFacts, ...] = ()
    fit: FitFacts | None = None
    closing: ClosingFacts | None = None
    settle: SettleFacts | None = None
    check: CheckFacts | None = None
    problems: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftEyeFacts:
    """The drift of one eye."""

    eye: str
    shift_x_deg: float
    shift_y_deg: float
    rotation_deg: float
    scale: float
    sigma_deg: float | None = None
    significant: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftFacts:
    """One drift check."""

    id: str
    created_utc: str
    calibration_id: str
    looks: int
    applied: bool
    eyes: tuple[DriftEyeFacts, ...]
    detail: str = ""


def session_facts(document: Mapping[str, object]) -> SessionFacts:
    """Return the facts of a session's document; raise InvalidInput naming an invalid field."""
    return _facts(SessionFacts, document, what="session")


def drift_facts(document: Mapping[str, object]) -> DriftFacts:
    """Return the facts of a drift check's document; raise InvalidInput naming an invalid field."""
    return _facts(DriftFacts, document, what="drift check")


def _facts(kind: type[_Facts], document: Mapping[str, object], *, what: str) -> _Facts:
    try:
        return TypeAdapter(kind).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the document"
        raise InvalidInput(
            f"report of {what} {document.get('id')!r}: {where}: {first['msg']}; measure that part again"
        ) from error
