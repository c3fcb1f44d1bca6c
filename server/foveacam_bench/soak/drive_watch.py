"""Measures how long a simulated rig's mirrors were driven while they were required to rest."""

import threading
import time

from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.drivers.controller.volts import bias_code
from foveacam_hardware.sim.cables import DacCodes
from foveacam_hardware.sim.world import World


class DriveWatch:
    """The DAC codes of every world of this process; thread-safe."""

    def __init__(self, limits: MirrorLimits) -> None:
        self._rest: DacCodes = (bias_code(limits),) * 8
        self._lock = threading.Lock()
        self._driven = self._must_rest = False
        self._since_ns = 0
        self._unparked_ns = 0

    def attach(self) -> None:
        """Observe all drives of worlds that open from now on."""
        set_codes = World.set_codes

        def set_and_see(world: World, t_ns: int, codes: DacCodes) -> None:
            set_codes(world, t_ns, codes)
            self.see(codes)

        World.set_codes = set_and_see  # type: ignore[assignment, method-assign]  # the far end calls the world's own

    def see(self, codes: DacCodes) -> None:
        """Record the codes in force from now on."""
        with self._lock:
            self._count()
            self._driven = any(codes) and codes != self._rest

    def require_rest(self, required: bool) -> None:
        """Start, or stop, counting the time in which a mirror is driven."""
        with self._lock:
            self._count()
            self._must_rest = required

    @property
    def unparked_s(self) -> float:
        """Time in which a mirror was driven while both were required to rest."""
        with self._lock:
            self._count()
            return self._unparked_ns / 1e9

    def _count(self) -> None:
        now_ns = time.monotonic_ns()
        if self._driven and self._must_rest:
            self._unparked_ns += now_ns - self._since_ns
        self._since_ns = now_ns
