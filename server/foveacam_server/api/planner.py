"""The planner: where to stand, how likely it is to see unnoticed, and where on a map. Needs no rig."""

from fastapi import APIRouter

from foveacam_pipeline.study.obstacles import Clutter
from foveacam_server.api.planner_models import RingAsked, StandoffAsked, StandoffDocument
from foveacam_server.runtime.planner import RingWish, standoff_document
from foveacam_server.runtime.store import Document

router = APIRouter(prefix="/planner", tags=["planner"])


@router.post("/standoff", summary="Where to stand about one target", response_model=StandoffDocument)
def standoff(request: StandoffAsked) -> Document:
    """Return the ring, and the probability of success among random obstacles with its curve (Eqs. 6-13)."""
    clutter = Clutter(occupancy=request.clutter.occupancy, radius_m=request.clutter.radius_m)
    return standoff_document(wish_of(request.ring), clutter, domain_m2=request.domain_m2)


def wish_of(asked: RingAsked) -> RingWish:
    """Return what REST asks a ring by as the runtime's value."""
    return RingWish(**asked.model_dump())
