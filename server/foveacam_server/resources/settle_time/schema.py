"""Schemas of the settle time in use."""

from pydantic import Field

from foveacam_server.foundation.schema import RequestModel, ResponseModel


class SettleTimeRequest(RequestModel):
    """The session whose settle time is to be used."""

    session_id: str = Field(max_length=64)


class MeasuredSettleTime(ResponseModel):
    """A measured settle time; `low_pass_hz`: cut-off of the drive filter during the measurement."""

    settle_us: int
    measured_utc: str
    session_id: str
    low_pass_hz: int | None


class SettleTimeDocument(ResponseModel):
    """How long the rig waits after every move.

    `source`: `rig file`, or `measured` and the date. `rig_file_us`: the rig file's value. `measured`: the
    measured one in use; null: the rig file's is.
    """

    settle_us: int
    source: str
    rig_file_us: int
    measured: MeasuredSettleTime | None
