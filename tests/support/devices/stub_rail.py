"""A rail of the stub rig."""

from dataclasses import dataclass, field

from foveacam_hardware.contract import Clock, DeviceInfo, RailLimits, RailState


@dataclass
class StubRail:
    """A rail that moves instantly. `moves_itself` false: it is pushed by hand."""

    did: list[tuple[int, str]]
    clock: Clock
    moves_itself: bool = True
    stuck: bool = False
    limits: RailLimits = field(default_factory=lambda: RailLimits(min_m=-0.305, max_m=0.305))
    info: DeviceInfo = field(default_factory=lambda: DeviceInfo(vendor="nobody", model="stub", serial="r"))
    _at_m: float | None = None

    @property
    def state(self) -> RailState:
        return RailState(connected=True, homed=self._at_m is not None, position_m=self._at_m)

    def connect(self) -> None:
        return

    def close(self) -> None:
        return

    def home(self) -> None:
        self.did.append((self.clock.now_ns(), "rail homes"))
        self._at_m = 0.0

    def confirm_zero(self) -> None:
        self.did.append((self.clock.now_ns(), "rail at its zero"))
        self._at_m = 0.0

    def move_to(self, position_m: float) -> None:
        self.did.append((self.clock.now_ns(), f"rail to {1e3 * position_m:g} mm"))
        if self.moves_itself and not self.stuck:
            self._at_m = position_m

    def hold(self) -> None:
        return
