"""Writes a round, one look at each followed target, as a dataset."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    DatasetHeader,
    DatasetWriter,
    PlanPosition,
    Shot,
    WriterSettings,
)
from foveacam_pipeline.track.position_filter import PositionEstimate

RETAKE_REMEDY = "take the round again"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenTarget:
    """A followed target and the look at it. `shown`: whether the target was found in the look."""

    target_id: str
    label: str
    sighting: Sighting
    estimate: PositionEstimate
    shown: bool


def write_round(folder: Path, seen: Sequence[SeenTarget], header: DatasetHeader) -> None:
    """Write the looks as the points of a new dataset, in their order; raise `StorageFull`, `DeviceFault`."""
    with DatasetWriter.create(folder, header, WriterSettings(depth=2, again=RETAKE_REMEDY)) as writer:
        for index, target in enumerate(seen):
            writer.add(_point(index, target))
        writer.finish()


def target_conditions(seen: Sequence[SeenTarget]) -> list[JsonValue]:
    """Return each target's estimate during its look, for the description of the dataset."""
    return [
        {
            "index": index,
            "id": target.target_id,
            "label": target.label,
            "shown": target.shown,
            "t_ns": target.sighting.left.t_ns,
            "point_rig_m": target.estimate.position_rig_m.tolist(),
            "velocity_rig_m_s": target.estimate.velocity_rig_m_s.tolist(),
            "distance_sigma_m": target.estimate.distance_sigma_m,
        }
        for index, target in enumerate(seen)
    ]


def _point(index: int, target: SeenTarget) -> CapturedPoint:
    ax_rad, ay_rad = np.arctan(target.estimate.tangents).tolist()
    frames = (target.sighting.left, target.sighting.right, target.sighting.wide)
    return CapturedPoint(
        place=PlanPosition(index=index, aim_rad=(ax_rad, ay_rad), distance_m=target.estimate.distance_m),
        shots=tuple(Shot(frame=frame) for frame in frames),
    )
