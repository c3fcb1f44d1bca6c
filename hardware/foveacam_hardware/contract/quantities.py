"""Checks of limits, rates and periods where a value type or a device is made."""

import math

from foveacam_hardware.contract.errors import InvalidInput


def check_positive(what: str, **quantities: float) -> None:
    """Raise `InvalidInput` for a quantity that is not a finite number above 0."""
    for name, value in quantities.items():
        if not (0.0 < value < math.inf):
            raise InvalidInput(f"{what}: {name} = {value:g} is not a finite number above 0; give one")


def check_ordered(what: str, **ends: float) -> None:
    """Raise `InvalidInput` unless two quantities are finite and the first is below the second."""
    (low_name, low), (high_name, high) = ends.items()
    if not (-math.inf < low < high < math.inf):
        raise InvalidInput(
            f"{what}: {low_name} = {low:g} and {high_name} = {high:g} are not a range; give finite numbers,"
            " the first below the second"
        )
