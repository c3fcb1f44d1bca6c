"""Rules that derive faults from events: which event begins a fault, and which one ends it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from foveacam_server.foundation.events import Event, EventLevel
from foveacam_server.foundation.schema import JobDocument, StorageFault
from foveacam_server.rig.schema import DeviceName, DeviceProblemDocument, StopChange

CALIBRATE = "check its drift, or calibrate again"

NO_FAULTS = frozenset(
    {
        "capture.ended",  # reported by its job
        "fixation.done",  # a regular answer, even without a distance
        "follow.changed",
        "follow.ended",
        "lease.changed",
        "loop.ended",  # reported by its job
        "rig.state",  # reported by its devices
    }
)
"""Kinds of warnings that are no faults: about a target or an operator, or reported by another event too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultPlace:
    """What a fault concerns: the `name` of one of `scope`, such as a device."""

    scope: str
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultNews:
    """A fault at a place, or, without `what`, the end of the lasting fault there.

    `lasting`: present until another event of that place; otherwise it is over at once.
    """

    place: FaultPlace
    what: str | None = None
    remedy: str | None = None
    lasting: bool = False


def news_of(event: Event) -> FaultNews | None:
    """Return the fault that an event begins or ends; None for any other event."""
    rule = _RULES.get(event.kind)
    if rule is not None:
        return rule(event)
    if event.level is EventLevel.INFO or event.kind in NO_FAULTS:
        return None
    scope, _, name = event.kind.partition(".")
    return FaultNews(place=FaultPlace(scope=scope, name=name), what=event.message)


def _device(event: Event) -> FaultNews:
    problem = DeviceProblemDocument.model_validate(event.data)
    place = FaultPlace(scope="device", name=problem.device)
    return FaultNews(place=place, what=problem.detail, remedy=problem.remedy, lasting=True)


def _device_back(event: Event) -> FaultNews:
    return FaultNews(place=FaultPlace(scope="device", name=DeviceName.model_validate(event.data).device))


def _storage(event: Event) -> FaultNews:
    fault = StorageFault.model_validate(event.data)
    what = f"the data directory takes no events: {fault.detail}"
    return FaultNews(place=_STORAGE, what=what, remedy=fault.remedy, lasting=True)


def _job(event: Event) -> FaultNews | None:
    if event.level is EventLevel.INFO:
        return None
    job = JobDocument.model_validate(event.data)
    place = FaultPlace(scope="job", name=job.kind)
    if job.problem is None:
        return FaultNews(place=place, what=event.message)
    return FaultNews(place=place, what=job.problem.detail, remedy=job.problem.remedy)


def _recording(event: Event) -> FaultNews | None:
    failed = event.data.get("ended") == "failed"  # reported by its job
    place = FaultPlace(scope="storage", name="recording")
    return None if failed or event.level is EventLevel.INFO else FaultNews(place=place, what=event.message)


def _stop(event: Event) -> FaultNews:
    parked = StopChange.model_validate(event.data).parked is not False
    what = None if parked else "the stop was engaged, but the mirrors did not confirm that they are parked"
    return FaultNews(
        place=FaultPlace(scope="device", name="stop"),
        what=what,
        remedy="look whether the controller has power and its cable holds; keep clear of the mirrors",
        lasting=True,
    )


def _lasting(scope: str, name: str, remedy: str | None = None) -> Callable[[Event], FaultNews]:
    """Return the rule of a kind of event whose warnings begin a fault and whose information ends it."""
    place = FaultPlace(scope=scope, name=name)

    def news(event: Event) -> FaultNews:
        bad = event.level is not EventLevel.INFO
        return FaultNews(place=place, what=event.message if bad else None, remedy=remedy, lasting=True)

    return news


_STORAGE = FaultPlace(scope="storage", name="event log")

_RULES: Mapping[str, Callable[[Event], FaultNews | None]] = MappingProxyType(
    {
        "device.fault": _device,
        "device.recovered": _device_back,
        "storage.fault": _storage,
        "storage.recovered": lambda _: FaultNews(place=_STORAGE),
        "job.updated": _job,
        "recording.ended": _recording,
        "stop.engaged": _stop,
        "stop.released": _stop,
        "rig.calibration": _lasting(
            "calibration", "in force", "choose or measure one on the calibration page"
        ),
        "calibration.health": _lasting("calibration", "health", CALIBRATE),
        "rig.settle_time": _lasting("calibration", "settle time", "measure it again by the step settle"),
        "viewer.failed": _lasting("view", "3D"),
    }
)
