"""Writes a still as a dataset of one point, which is on disk when the call returns."""

import math
import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pydantic import JsonValue

from foveacam_hardware.contract import DeviceFault, MirrorVolts, Role, StereoVolts, StorageFull
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    DatasetHeader,
    DatasetWriter,
    ImageCodec,
    Shot,
    WriterSettings,
)
from foveacam_pipeline.capture.dataset.document import LICENCE
from foveacam_pipeline.capture.still.values import Still, StillFrame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import crossing_z_m

RETAKE_REMEDY = "then take the still again"


@dataclass(frozen=True, slots=True, kw_only=True)
class StillLabels:
    """Label, licence, image format and id of a still's dataset. `id`: None generates one."""

    label: str = ""
    licence: str = LICENCE
    codec: ImageCodec = ImageCodec.PNG
    id: str | None = None


def write_still(folder: Path, still: Still, calibration: Calibration | None, labels: StillLabels) -> None:
    """Write a still into a folder that does not exist yet; remove it if the disk refuses.

    Raise StorageFull, DeviceFault. The point's distance is where the gazes cross by the calibration.
    """
    header = DatasetHeader(
        points=1,
        plan=still.plan.document(),
        rig=still.rig,
        conditions={**still.conditions, **_still_conditions(still)},
        calibration=calibration,
        label=labels.label,
        licence=labels.licence,
        codec=labels.codec,
    )
    if labels.id is not None:
        header = replace(header, id=labels.id)
    place = replace(still.place, distance_m=_crossing_m(still.shots, calibration))
    try:
        with DatasetWriter.create(folder, header, WriterSettings(depth=1, again=RETAKE_REMEDY)) as writer:
            writer.add(CapturedPoint(place=place, shots=still.shots))
            writer.finish()
    except (StorageFull, DeviceFault):
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _still_conditions(still: Still) -> dict[str, JsonValue]:
    """Return what a dataset's index does not hold: every exposure of a mean, and the missing frames."""
    return {
        "exposures": [_exposure(exposure) for exposure in still.exposures],
        "missing": [each.document() for each in still.missing],
    }


def _exposure(exposure: StillFrame) -> dict[str, JsonValue]:
    volts = None if exposure.volts_v is None else list(exposure.volts_v)
    return {**asdict(exposure), "role": exposure.role.value, "volts_v": volts}


def _crossing_m(shots: tuple[Shot, ...], calibration: Calibration | None) -> float | None:
    """Return the depth at which the gazes cross, m; None where they do not, or it is unknown."""
    drives: dict[Role, MirrorVolts] = {
        shot.frame.role: shot.frame.volts for shot in shots if shot.frame.volts is not None
    }
    if calibration is None or not {Role.LEFT, Role.RIGHT} <= drives.keys():
        return None
    z_m = crossing_z_m(calibration, StereoVolts(left=drives[Role.LEFT], right=drives[Role.RIGHT]))
    return z_m if math.isfinite(z_m) else None
