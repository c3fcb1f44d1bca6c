"""The error tree of the product, ordered by who has to act, and the install command used in remedies.

    FoveaError
    ├── InvalidInput     the caller's: fix the value (config, request, file)
    ├── OutOfRange       the caller's: ask for something the rig can do
    ├── NotCalibrated    the operator's: calibrate, or load the right calibration
    ├── NotConnected     the operator's: plug in, power up, free the port
    ├── StorageFull      the operator's: make room on the disk, or make it writable
    ├── Busy             wait, or take the lease
    ├── Stopped          the operator's: release the stop
    ├── Cancelled        nobody's: it was requested
    ├── Timeout          the device's: it did not answer in time
    └── DeviceFault      the device's: it answered wrongly, or broke

Every text states what was asked, what was found, and what to do: `FoveaError` composes it.
"""

import shlex
import sys


class FoveaError(Exception):
    """Root of every error that a user may see; `code` is stable and machine readable.

    `statement` says what was asked and what was found, without the remedy; left empty, it is composed as
    `{asked}: {found}`. The text is `{statement}; {remedy}`, so that it ends with the remedy verbatim. A
    statement's full stop is replaced by the semicolon, but stays before a remedy that is a complete sentence,
    with a capital and a full stop. An error that wraps another passes on its `statement` and its `remedy`
    separately.
    """

    code = "fovea_error"

    def __init__(
        self,
        statement: str = "",
        *,
        asked: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.statement = statement or ": ".join(filter(None, (asked, found)))
        super().__init__(_compose(self.statement, remedy))
        self.asked = asked
        self.found = found
        self.remedy = remedy

    @property
    def parts(self) -> tuple[str, str]:
        """The statement and the remedy; by default the text after the last semicolon is the remedy."""
        if self.remedy is not None:
            return self.statement, self.remedy
        statement, _, remedy = self.statement.rpartition("; ")
        return (statement, remedy) if statement else (remedy, "")


def _compose(statement: str, remedy: str | None) -> str:
    if not remedy or not statement:
        return statement or remedy or ""
    if statement.endswith((".", "!", "?")) and remedy[0].isupper() and remedy.endswith("."):
        return f"{statement} {remedy}"
    return f"{statement.removesuffix('.')}; {remedy}"


class InvalidInput(FoveaError):
    """A value, a file or a configuration that is not valid."""

    code = "invalid_input"


class OutOfRange(FoveaError):
    """A request beyond the rig's limits; it was refused and nothing moved."""

    code = "out_of_range"


class NotCalibrated(FoveaError):
    """A calibration is missing or belongs to another rig."""

    code = "not_calibrated"


class NotConnected(FoveaError):
    """A device that is missing, unplugged or held by another program."""

    code = "not_connected"


class StorageFull(FoveaError):
    """A disk that cannot be written: full, over quota, or read-only; the request was not carried out."""

    code = "storage_full"


class Busy(FoveaError):
    """Somebody else is using the rig."""

    code = "busy"


class Stopped(FoveaError):
    """The stop is active: the mirrors are parked until it is released."""

    code = "stopped"


class Cancelled(FoveaError):
    """The work was cancelled on request."""

    code = "cancelled"


class Timeout(FoveaError):
    """A device did not answer within its deadline."""

    code = "timeout"


class DeviceFault(FoveaError):
    """A device answered wrongly, or refused a valid request."""

    code = "device_fault"


def install_command(extra: str) -> str:
    """Return the command that installs an extra, such as `pylon`, into the running Python environment."""
    return f"{shlex.quote(sys.executable)} -m pip install 'foveacam-duo[{extra}]'"
