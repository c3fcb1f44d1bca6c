"""The command `foveacam accept [--rig FILE] [--server URL]`."""

from pathlib import Path
from typing import Annotated

import typer

from foveacam_server.commands.options import RigOptions, on_rig


@on_rig(usual_scene="calibration")
def accept(
    rig_options: RigOptions,
    *,
    looks: Annotated[
        int, typer.Option(help="looks without a pause, to find lost frames", min=20, max=5000)
    ] = 300,
    wide_s: Annotated[
        float, typer.Option(help="seconds of the wide camera at full rate", min=2.0, max=600.0)
    ] = 60.0,
    report: Annotated[Path | None, typer.Option(help="also write the HTML report to this file")] = None,
) -> None:
    """Measure whether the rig is what it should be and name what is wrong, on its first day and after a move.

    The rig turns to its markers and takes ten minutes or so. The result is kept with its calibration.
    Exit status 0: accepted; 1: something is wrong, or could not be measured.
    """
    from foveacam_server.resources.calibrating.acceptances.cli_run import run_and_print

    run_and_print(rig_options, looks=looks, wide_s=wide_s, report=report)
