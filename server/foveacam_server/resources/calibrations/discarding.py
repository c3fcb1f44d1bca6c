"""The rule which calibrations may be discarded: neither the one in force nor those shipped."""

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.models.calibration import Calibration


def check_discarded(calibration: Calibration, *, in_force: bool, kept: bool) -> None:
    """Raise `Busy` for the calibration in force, `InvalidInput` for one not `kept` in the data directory."""
    asked = f"discard calibration {calibration.id}"
    if in_force:
        raise Busy(
            f"calibration {calibration.id} ({calibration.label}) is in force; put another one in force first",
            asked=asked,
            found="it is in force",
            remedy="put another one in force first",
        )
    if not kept:
        raise InvalidInput(
            f"calibration {calibration.id} ({calibration.label}) came with the program or what was opened;"
            " only those kept in the data directory can be discarded",
            asked=asked,
            found="it is none of one's own",
        )
