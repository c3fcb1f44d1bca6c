"""Look at a pixel of the wide view: distance, point cloud and the picture of a fovea."""

import sys
from pathlib import Path

import foveacam_client
from foveacam_client import models


def show_progress(progress: models.JobProgress) -> None:
    """Print the progress of the job."""
    left = "" if progress.eta_s is None else f", {progress.eta_s:.0f} s left"
    print(f"{progress.done} of {progress.total}{left}", file=sys.stderr)


def main(x_px: float, y_px: float, folder: Path) -> None:
    """Fixate, print the distance, and save cloud and picture in a folder."""
    with foveacam_client.connect() as rig:
        fixation = rig.fixate(x_px, y_px, on_progress=show_progress, cancel_on_interrupt=True)
        if fixation.distance_m is None or fixation.distance_sigma_m is None:
            sys.exit(f"no distance: {fixation.reason}")
        print(f"{fixation.distance_m:.4f} m ± {fixation.distance_sigma_m:.4f} m by {fixation.basis}")
        (folder / "cloud.ply").write_bytes(rig.cloud(fixation).ply)
        rig.api.views.snapshot("left").save(folder / "left.jpg")


if __name__ == "__main__":
    main(float(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]))
