"""Schemas of measurements: request, answer, stored row and event data."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Label, Pixels
from foveacam_server.foundation.schema import RequestModel, ResponseModel

MeasurementKind = Literal["point", "length", "plane", "profile"]
ViewName = Literal["wide", "left", "right", "anaglyph", "difference", "depth"]
Triple = tuple[float, float, float]
Pair = tuple[float, float]


class PlaceRequest(RequestModel):
    """A pixel of a view; the centre of the first pixel is (0, 0).

    Without `fixation_id`, the newest look with depth is measured; the view must still show it. In the wide
    view the newest look that covers the pixel is measured, and `fixation_id` has no effect.
    """

    view: ViewName
    x_px: Pixels
    y_px: Pixels
    fixation_id: Annotated[str | None, Field(max_length=40)] = None


class MeasurementRequest(RequestModel):
    """One point; two ends of a length or of a profile's line; two opposite corners of a plane's rectangle."""

    kind: MeasurementKind
    points: Annotated[list[PlaceRequest], Field(min_length=1, max_length=2)]
    label: Label | None = None


class MeasurementPatch(RequestModel):
    """Fields of a measurement to change."""

    label: Label


class MeasuredPointDocument(ResponseModel):
    """A measured point, rig frame.

    `snapped_px`: distance of the measured pixel from the requested one, px of that view. `at_edge`: a depth
    edge is so near that the depth may be that of either surface.
    """

    view: ViewName
    x_px: float
    y_px: float
    snapped_px: float
    at_edge: bool
    fixation_id: str
    point_rig_m: Triple
    point_sigma_m: Triple
    distance_m: float
    distance_sigma_m: float


class LengthDocument(ResponseModel):
    """The length from the first point to the second; `same_look`: shared errors are counted once."""

    length_m: float
    length_sigma_m: float
    delta_rig_m: Triple
    delta_sigma_m: Triple
    same_look: bool


class PlaneDocument(ResponseModel):
    """A plane, rig frame; `normal` points to the rig.

    `normal_sigma_deg`: rms angle from the true normal. `pan_deg`: turned to the right about the vertical,
    `tilt_deg`: facing up; both 0 for a plane that faces the rig. `distance_m`: of the plane from the rig's
    origin. Residuals are the inlier pixels' distances from the plane: their rms, the rms expected from
    matching errors alone, and the width of their central 95 % (`flatness_m`).
    """

    normal: Triple
    normal_sigma_deg: float
    pan_deg: float
    pan_sigma_deg: float
    tilt_deg: float
    tilt_sigma_deg: float
    distance_m: float
    distance_sigma_m: float
    centre_rig_m: Triple
    corners_rig_m: list[Triple]
    residual_rms_m: float
    expected_rms_m: float
    flatness_m: float
    pixels: int
    outliers: int
    outlier_fraction: float


class SampleDocument(ResponseModel):
    """One sample of a profile; `z_m` and its matching error are null where there is no depth."""

    along_m: float
    z_m: float | None
    z_sigma_m: float | None


class ProfileDocument(ResponseModel):
    """Depth along a line; `along_m` is measured on a fronto-parallel surface at depth `median_z_m`.

    `shared_sigma_m`: standard error of Z that all samples share.
    """

    samples: list[SampleDocument]
    start_rig_m: Triple
    end_rig_m: Triple
    median_z_m: float
    shared_sigma_m: float
    known_fraction: float


class GazeDocument(ResponseModel):
    """Volts (x, y) of both mirrors while the foveae looked."""

    left_v: Pair
    right_v: Pair


class MeasurementDocument(ResponseModel):
    """One measurement; of `length`, `plane` and `profile` only that of its kind is set.

    `drawn_px`: its points, ends or corners in each view that can show them; a view other than the wide one
    draws them while it shows a look of `fixation_ids`, a raw fovea while the mirrors are at `gaze`.
    """

    id: str
    kind: MeasurementKind
    label: str
    created_utc: str
    fixation_ids: list[str]
    points: list[MeasuredPointDocument]
    length: LengthDocument | None = None
    plane: PlaneDocument | None = None
    profile: ProfileDocument | None = None
    drawn_px: dict[ViewName, list[Pair]]
    gaze: GazeDocument | None = None
