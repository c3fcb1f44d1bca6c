"""Schemas of the settle time in use."""

from pydantic import Field

from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.rig.settle_times import RIG_FILE, SettleTime


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
    """The wait of the rig after every move.

    `source`: `rig file`, or `measured` and the date. `rig_file_us`: the rig file's value. `measured`: the
    measured one in use; null: the rig file's is.
    """

    settle_us: int
    source: str
    rig_file_us: int
    measured: MeasuredSettleTime | None

    @classmethod
    def of(cls, in_use: SettleTime | None, *, rig_file_us: int) -> "SettleTimeDocument":
        """Describe the measured settle time in use, or the rig file's where there is none."""
        if in_use is None:
            return cls(settle_us=rig_file_us, source=RIG_FILE, rig_file_us=rig_file_us, measured=None)
        return cls(
            settle_us=in_use.settle_us,
            source=in_use.source,
            rig_file_us=rig_file_us,
            measured=MeasuredSettleTime.model_validate(in_use, from_attributes=True),
        )


class SettleTimeChanged(ResponseModel):
    """Data of `rig.settle_time`: the settle time from now on."""

    settle_us: int
    source: str
