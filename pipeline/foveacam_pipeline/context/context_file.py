"""The wide context on the disk: one npz file, written whole over an older one."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_pipeline.capture.dataset.disk import write_file
from foveacam_pipeline.context.values import ContextMap
from foveacam_pipeline.context.wide_context import WideContext

FORMAT = "foveacam-wide-context"
VERSION = 1
ARRAYS = ("inverse_z_per_m", "sigma_per_m", "measured_s", "source", "tangents")


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextOf:
    """What a stored context belongs to; it is of no use to any other rig, calibration or pose.

    `pose`: place and direction of the rig as text, "" for a rig that does not move.
    """

    rig_id: str
    calibration_id: str
    pose: str


def save_context(context: WideContext, path: Path, *, of: ContextOf) -> None:
    """Write the context. Raise `OSError`."""
    stored, reference = context.snapshot(aged=False), context.reference()
    content = io.BytesIO()
    np.savez_compressed(
        content,
        format=np.array(FORMAT),
        version=np.array(VERSION),
        rig_id=np.array(of.rig_id),
        calibration_id=np.array(of.calibration_id),
        pose=np.array(of.pose),
        cell_px=np.array(context.cell_px),
        reference=reference,
        inverse_z_per_m=stored.inverse_z_per_m,
        sigma_per_m=stored.sigma_per_m,
        measured_s=stored.measured_s,
        source=stored.source,
        tangents=stored.tangents,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content.getvalue())


def load_context(context: WideContext, path: Path, *, of: ContextOf) -> bool:
    """Restore what `save_context` wrote; return whether the file belongs to `of` and this grid.

    Raise `OSError` (`FileNotFoundError` where there is none), or `ValueError` for any other content.
    """
    with np.load(path, allow_pickle=False) as file:
        missing = [name for name in (*ARRAYS, "format", "version", "reference") if name not in file]
        if missing or (str(file["format"]), int(file["version"])) != (FORMAT, VERSION):
            raise ValueError(f"{path.name}: {FORMAT} version {VERSION} is needed; remove the file")
        found = ContextOf(
            rig_id=str(file["rig_id"]), calibration_id=str(file["calibration_id"]), pose=str(file["pose"])
        )
        if found != of or int(file["cell_px"]) != context.cell_px:
            return False
        stored = ContextMap(cell_px=context.cell_px, **{name: file[name] for name in ARRAYS})
        reference = file["reference"]
    if stored.known.shape[1:] != (context.rows, context.columns):
        return False
    context.restore(stored, reference=reference)
    return True
