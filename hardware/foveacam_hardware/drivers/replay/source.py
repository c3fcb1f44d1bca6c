"""What a recording must tell to be played, as Protocols: reading files is not the hardware's.

Whoever opens a recording implements them; here nothing is known of its format.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceInfo, Image, MirrorVolts, Role


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedExposure:
    """One recorded exposure: `image` as in `Frame`; what nobody wrote down is None."""

    image: Image
    bits: int
    volts: MirrorVolts | None = None
    exposure_ns: int | None = None
    frame_id: int | None = None


class RecordedCamera(Protocol):
    """The frames of one camera. Any thread may call, one at a time."""

    @property
    def info(self) -> DeviceInfo:
        """Which camera it was, and in which recording."""
        ...

    @property
    def t_ns(self) -> NDArray[np.int64]:
        """(n,) moments of the exposures, ascending, on the recording's clock; at least one."""
        ...

    def frame(self, index: int) -> RecordedExposure:
        """Return one frame; raise a `FoveaError` where the recording is damaged."""
        ...

    def volts(self, index: int) -> MirrorVolts | None:
        """Return the mirror's drive during an exposure, without its picture."""
        ...


class RecordedRig(Protocol):
    """A whole recording. Closing it releases the file."""

    @property
    def rig_id(self) -> str:
        """Which rig was recorded."""
        ...

    @property
    def name(self) -> str:
        """The same, for people."""
        ...

    @property
    def baseline_m(self) -> float:
        """Nominal distance between its mirrors, metres."""
        ...

    @property
    def cameras(self) -> Mapping[Role, RecordedCamera]:
        """The cameras that were recorded."""
        ...

    def close(self) -> None:
        """Release the file; harmless when released."""
        ...
