"""Errors that trials raise when a driver contradicts the truth, or itself."""


class TrialFailed(Exception):
    """A driver contradicted itself, or could not be used any more."""


class FalsePosition(TrialFailed):
    """A driver reported as known a position, or volts, that are not the true ones."""


def require(holds: bool, otherwise: object) -> None:
    """Raise `TrialFailed` unless a condition holds."""
    if not holds:
        raise TrialFailed(str(otherwise))
