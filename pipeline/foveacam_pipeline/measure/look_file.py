"""Save and load the depth of a look as a compressed npz file with format and version."""

from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from foveacam_hardware.contract import InvalidInput, MirrorVolts, StereoVolts
from foveacam_pipeline.measure.look import LookDepth

FORMAT = "foveacam-look-depth"
VERSION = 1


def save_look(look: LookDepth, path: Path) -> None:
    """Write the depth of a look; `sigma_px` is stored as float16 (relative error below 1e-3)."""
    drives = (look.volts.left, look.volts.right)
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            format=FORMAT,
            version=VERSION,
            z_m=look.z_m,
            sigma_px=look.sigma_px.astype(np.float16),
            f_px=look.f_px,
            baseline_m=look.baseline_m,
            u0_left_px=look.u0_left_px,
            u0_right_px=look.u0_right_px,
            v0_px=look.v0_px,
            scale=look.scale,
            pose_sigma_px=np.array(look.pose_sigma_px),
            window_from_left=look.window_from_left,
            window_from_right=look.window_from_right,
            volts_v=np.array([(drive.x_v, drive.y_v) for drive in drives]),
            t_ns=look.t_ns,
        )


def load_look(path: Path) -> LookDepth:
    """Load a file of `save_look`; raise InvalidInput for another format or version or a damaged file."""
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise InvalidInput(f"{path.name} cannot be read: {error}; look at the target again") from error
    if str(found.get("format")) != FORMAT or int(found.get("version", 0)) != VERSION:
        raise InvalidInput(
            f"{path.name}: {FORMAT} version {VERSION} is needed, found {found.get('format')} "
            f"version {found.get('version')}; update the program, or look at the target again"
        )
    left_v, right_v = found["volts_v"].tolist()
    sigma_left, sigma_right, sigma_v = found["pose_sigma_px"].tolist()
    return LookDepth(
        z_m=found["z_m"].astype(np.float32),
        sigma_px=found["sigma_px"].astype(np.float32),
        f_px=float(found["f_px"]),
        baseline_m=float(found["baseline_m"]),
        u0_left_px=float(found["u0_left_px"]),
        u0_right_px=float(found["u0_right_px"]),
        v0_px=float(found["v0_px"]),
        scale=float(found["scale"]),
        pose_sigma_px=(sigma_left, sigma_right, sigma_v),
        window_from_left=found["window_from_left"],
        window_from_right=found["window_from_right"],
        volts=StereoVolts(
            left=MirrorVolts(x_v=left_v[0], y_v=left_v[1]),
            right=MirrorVolts(x_v=right_v[0], y_v=right_v[1]),
        ),
        t_ns=int(found["t_ns"]),
    )
