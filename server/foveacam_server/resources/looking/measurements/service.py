"""Measures points, lengths, planes and profiles in the depth of looks, and stores the measurements."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.measure.length import length_between
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.plane import fit_plane
from foveacam_pipeline.measure.point import point_of
from foveacam_pipeline.measure.profile import profile_along
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.schema import ItemId
from foveacam_server.foundation.store import Store
from foveacam_server.resources.looking.measurements.documents import (
    length_document,
    metres,
    plane_document,
    point_document,
    profile_document,
)
from foveacam_server.resources.looking.measurements.drawing import (
    drawn_in_views,
    gaze_of,
    scene_drawing,
    value_text,
)
from foveacam_server.resources.looking.measurements.looks import LookReader, StoredClouds
from foveacam_server.resources.looking.measurements.point_finder import PointFinder, ShownViews
from foveacam_server.resources.looking.measurements.regions import (
    WindowRegion,
    line_of,
    mask_of,
    rectangle_of,
)
from foveacam_server.resources.looking.measurements.schema import (
    MeasurementDocument,
    MeasurementKind,
    MeasurementRequest,
    PlaceRequest,
    Triple,
)
from foveacam_server.resources.looking.measurements.table import MeasurementTable
from foveacam_server.rig.ports import SceneViewer

PUT_BACK = 30
"""Number of measurements of earlier runs, newest first, that are drawn again in the 3D pane at the start."""
POINTS: dict[MeasurementKind, int] = {"point": 1, "length": 2, "plane": 2, "profile": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuringTools:
    """Services that measurements need."""

    clouds: StoredClouds
    wide: Callable[[], Intrinsics]
    """Returns the calibrated wide camera or raises NotCalibrated."""
    shown: ShownViews
    events: EventLog
    viewer: SceneViewer | None


class MeasurementService:
    """Creates, lists, renames and removes measurements; callable from any thread but the hardware's."""

    def __init__(self, store: Store, tools: MeasuringTools) -> None:
        self._table = MeasurementTable(store)
        self._tools = tools
        self._places = PointFinder(LookReader(tools.clouds), tools.clouds.patches, tools.shown)

    def put_back(self) -> None:
        """Show the newest measurements of earlier runs in the 3D pane."""
        for document in reversed(self._table.every()[:PUT_BACK]):
            self._draw(document)

    def create(self, request: MeasurementRequest) -> MeasurementDocument:
        """Measure, store, and emit an event."""
        wanted = POINTS[request.kind]
        if len(request.points) != wanted:
            raise InvalidInput(
                f"a {request.kind} takes {wanted} point{'s' if wanted > 1 else ''}, {len(request.points)} "
                "came",
                asked=f"{len(request.points)} points",
                remedy=f"send `points` with {wanted}",
            )
        label = request.label or f"{request.kind.capitalize()} {self._table.next_number()}"
        document = self._measured(request, label)
        self._table.add(document)
        self._draw(document)
        self._tools.events.emit("measurement.created", value_text(document), data=ItemId(id=document.id))
        return document

    def every(self) -> list[MeasurementDocument]:
        """Return all, newest first."""
        return self._table.every()

    def get(self, measurement_id: str) -> MeasurementDocument:
        """Return a measurement or raise NotFound."""
        return self._table.get(measurement_id)

    def rename(self, measurement_id: str, label: str) -> MeasurementDocument:
        """Rename a measurement and emit an event."""
        document = self._table.rename(measurement_id, label)
        self._draw(document)
        self._tools.events.emit(
            "measurement.updated", f"{measurement_id} is now {label}", data=ItemId(id=document.id)
        )
        return document

    def remove(self, measurement_id: str) -> None:
        """Remove a measurement and emit an event."""
        document = self._table.remove(measurement_id)
        if self._tools.viewer is not None:
            self._tools.viewer.remove_measurement(measurement_id)
        self._tools.events.emit(
            "measurement.deleted", f"{document.label} was removed", data=ItemId(id=measurement_id)
        )

    def _draw(self, document: MeasurementDocument) -> None:
        drawing = scene_drawing(document)
        if self._tools.viewer is not None and drawing is not None:
            self._tools.viewer.show_measurement(document.id, drawing)

    def _measured(self, request: MeasurementRequest, label: str) -> MeasurementDocument:
        wide = self._tools.wide()
        if request.kind in ("point", "length"):
            return self._of_points(request, label, wide)
        ends = (request.points[0], request.points[1])
        if request.kind == "plane":
            return self._plane(ends, label, wide)
        return self._profile(ends, label, wide)

    def _of_points(self, request: MeasurementRequest, label: str, wide: Intrinsics) -> MeasurementDocument:
        placed = [self._places.point(place, wide=wide) for place in request.points]
        points = [point_document(each) for each in placed]
        names = list(dict.fromkeys(each.fixation_id for each in placed))
        look = placed[0].look if len(names) == 1 and all(each.look for each in placed) else None
        length = length_between(placed[0].point, placed[1].point) if len(placed) == 2 else None
        return MeasurementDocument(
            id=new_id("mea"),
            kind=request.kind,
            label=label,
            created_utc=utc_now(),
            fixation_ids=names,
            points=points,
            length=None if length is None else length_document(length),
            drawn_px=drawn_in_views([point.point_rig_m for point in points], look=look, wide=wide),
            gaze=None if look is None else gaze_of(look),
        )

    def _plane(
        self, ends: tuple[PlaceRequest, PlaceRequest], label: str, wide: Intrinsics
    ) -> MeasurementDocument:
        region = rectangle_of(self._places, ends, wide=wide)
        plane = plane_document(fit_plane(region.look, mask_of(region), outline_px=np.array(region.window_px)))
        document = _of_region(region, "plane", label, plane.corners_rig_m, wide=wide)
        return document.model_copy(update={"plane": plane})

    def _profile(
        self, ends: tuple[PlaceRequest, PlaceRequest], label: str, wide: Intrinsics
    ) -> MeasurementDocument:
        region = line_of(self._places, ends, wide=wide)
        profile = profile_along(region.look, *region.window_px[:2])
        known = [(sample.x_px, sample.y_px, sample.z_m) for sample in profile.samples if sample.z_m]
        start, end = (_rig_point(region.look, at) for at in (known[0], known[-1]))
        document = _of_region(region, "profile", label, [start, end], wide=wide)
        measured = profile_document(profile, start_rig_m=start, end_rig_m=end)
        return document.model_copy(update={"profile": measured})


def _of_region(
    region: WindowRegion, kind: MeasurementKind, label: str, drawn_rig_m: list[Triple], *, wide: Intrinsics
) -> MeasurementDocument:
    return MeasurementDocument(
        id=new_id("mea"),
        kind=kind,
        label=label,
        created_utc=utc_now(),
        fixation_ids=[region.fixation_id],
        points=[],
        drawn_px=drawn_in_views(drawn_rig_m, look=region.look, wide=wide),
        gaze=gaze_of(region.look),
    )


def _rig_point(look: LookDepth, at: tuple[float, float, float]) -> Triple:
    point = point_of(look, at[:2], at[2], sigma_px=0.0, look_id="").point_rig_m
    return metres(tuple(point.tolist()))
