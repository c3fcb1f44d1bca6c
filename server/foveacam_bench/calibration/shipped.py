"""Write the calibrations that ship with the simulated rigs; the procedures measure them as on any other rig.

`python -m foveacam_bench.calibration.shipped` runs all three stages on both rigs in virtual time, minutes
each. Run it again when mirrors, optics or lens of the simulation change.
"""

import argparse
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.calibration.procedures import StageTimer, calibrate_rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import save_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

PRESETS = ("rig120", "paper")


def write(preset: str, folder: Path) -> dict[str, float]:
    """Calibrate the simulated rig of a preset and write the result; return how long it took."""
    with (
        TemporaryDirectory() as session,
        open_simulated("calibration", preset=preset, inline=True) as rig,
    ):
        rig.mirrors.enable()
        watch = StageTimer(rig)
        label = f"shipped with {rig.rig_id}"
        calibration, _ = calibrate_rig(rig, Path(session), watch=watch, label=label)
        save_calibration(calibration, folder / f"{rig.rig_id}.json")
    return watch.seconds


def main() -> None:
    """Write the calibrations of both simulated rigs."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--folder", type=Path, default=SHIPPED)
    folder = parser.parse_args().folder
    for preset in PRESETS:
        sys.stdout.write(json.dumps({preset: write(preset, folder)}) + "\n")


if __name__ == "__main__":
    main()
