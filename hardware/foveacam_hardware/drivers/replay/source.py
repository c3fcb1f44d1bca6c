"""Protocols of a recording that can be played, implemented by whoever reads the file.

The file format is not known here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, DeviceInfo, Image, MirrorVolts, Role


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedExposure:
    """One recorded exposure: `image` as in `Frame`; None for what was not recorded."""

    image: Image
    bits: int
    volts: MirrorVolts | None = None
    exposure_ns: int | None = None
    frame_id: int | None = None
    binning: Binning = 1


class RecordedCamera(Protocol):
    """The frames of one camera. Any thread may call, one at a time."""

    @property
    def info(self) -> DeviceInfo:
        """Identity of the camera and of the recording."""
        ...

    @property
    def t_ns(self) -> NDArray[np.int64]:
        """(n,) times of the exposures, ascending, on the recording's clock; at least one."""
        ...

    def frame(self, index: int) -> RecordedExposure:
        """Return one frame; raise a `FoveaError` when the recording is damaged."""
        ...

    def volts(self, index: int) -> MirrorVolts | None:
        """Return the mirror's drive during an exposure, without loading its image."""
        ...


class RecordedRig(Protocol):
    """A whole recording. Closing it releases the file."""

    @property
    def rig_id(self) -> str:
        """Id of the recorded rig."""
        ...

    @property
    def name(self) -> str:
        """Name of the recorded rig, for display."""
        ...

    @property
    def baseline_m(self) -> float:
        """Nominal distance between its mirrors, metres."""
        ...

    @property
    def cameras(self) -> Mapping[Role, RecordedCamera]:
        """The recorded cameras by role."""
        ...

    def close(self) -> None:
        """Release the file; do nothing when released."""
        ...
