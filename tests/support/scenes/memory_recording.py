"""A recording without a file, for tests of what plays one."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, DeviceInfo, MirrorVolts, Role
from foveacam_hardware.drivers.replay.source import RecordedExposure

BEGIN_NS = 7_000_000_000_000


class MemoryRecordedCamera:
    """Frames that tell their number, `period_ns` apart; the last of `binnings` is that of all others."""

    def __init__(
        self,
        role: Role,
        *,
        frames: int,
        period_ns: int,
        late_ns: int = 0,
        binnings: tuple[Binning, ...] = (1,),
    ) -> None:
        self.info = DeviceInfo(vendor="test", model="played", serial=f"played-{role}")
        self.t_ns: NDArray[np.int64] = BEGIN_NS + late_ns + np.arange(frames, dtype=np.int64) * period_ns
        self._role = role
        self._binnings = binnings

    def frame(self, index: int) -> RecordedExposure:
        binning = self._binnings[min(index, len(self._binnings) - 1)]
        image = np.full((6 // binning, 8 // binning), index % 256, dtype=np.uint8)
        return RecordedExposure(
            image=image, bits=8, volts=self.volts(index), exposure_ns=2_000_000, binning=binning
        )

    def volts(self, index: int) -> MirrorVolts | None:
        return None if self._role is Role.WIDE else MirrorVolts(x_v=float(index), y_v=-1.0)


class MemoryRecording:
    """Implements `RecordedRig`; both foveae at the same moments, the wide camera a little later."""

    rig_id = "played"
    name = "A recording"
    baseline_m = 0.2

    def __init__(
        self,
        *,
        frames: int = 10,
        period_ns: int = 20_000_000,
        roles: tuple[Role, ...] = tuple(Role),
        binnings: tuple[Binning, ...] = (1,),
    ) -> None:
        self.cameras: Mapping[Role, MemoryRecordedCamera] = {
            role: MemoryRecordedCamera(
                role,
                frames=frames,
                period_ns=period_ns,
                late_ns=3_000_000 if role is Role.WIDE else 0,
                binnings=binnings,
            )
            for role in roles
        }
        self.closed = False

    def close(self) -> None:
        self.closed = True
