"""Save and load the wide context as one npz file, which replaces an older one atomically."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import Binning
from foveacam_pipeline.storage.disk import write_file
from foveacam_pipeline.wide_depth.values import ContextMap
from foveacam_pipeline.wide_depth.wide_context import WideContext

FORMAT = "foveacam-wide-context"
VERSION = 1
NAMES = ("format", "version", "rig_id", "calibration_id", "pose", "cell_px", "reference")
ARRAYS = ("inverse_z_per_m", "sigma_per_m", "measured_s", "source", "tangents")


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextIdentity:
    """The rig, calibration and pose for which a stored context is valid.

    `pose`: position and direction of the rig as text, "" for a rig that does not move.
    """

    rig_id: str
    calibration_id: str
    pose: str


def save_context(context: WideContext, path: Path, *, of: ContextIdentity) -> None:
    """Write the context to `path`. Raise `OSError`."""
    stored, (binning, reference) = context.snapshot(aged=False), context.reference()
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
        reference_binning=np.array(binning),
        inverse_z_per_m=stored.inverse_z_per_m,
        sigma_per_m=stored.sigma_per_m,
        measured_s=stored.measured_s,
        source=stored.source,
        tangents=stored.tangents,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content.getvalue())


def load_context(context: WideContext, path: Path, *, of: ContextIdentity) -> bool:
    """Load a file of `save_context` if it is of this identity and grid; return whether it is.

    Raise `OSError` (`FileNotFoundError` where there is none), or `ValueError` for any other content.
    """
    wrong = ValueError(f"{path.name}: {FORMAT} version {VERSION} is needed; remove the file")
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except (zipfile.BadZipFile, EOFError) as error:
        raise wrong from error
    if not {*ARRAYS, *NAMES} <= content.keys():
        raise wrong
    if (str(content["format"]), int(content["version"])) != (FORMAT, VERSION):
        raise wrong
    found = ContextIdentity(
        rig_id=str(content["rig_id"]),
        calibration_id=str(content["calibration_id"]),
        pose=str(content["pose"]),
    )
    if found != of or int(content["cell_px"]) != context.cell_px:
        return False
    stored = ContextMap(cell_px=context.cell_px, **{name: content[name] for name in ARRAYS})
    if stored.known.shape[1:] != (context.rows, context.columns):
        return False
    binning: Binning = 1 if int(content.get("reference_binning", 2)) == 1 else 2  # absent until 0.13
    context.restore(stored, reference=content["reference"], binning=binning)
    return True
