"""What can be broken in the simulated world, as plain attributes that a test or a demonstration sets."""

from dataclasses import dataclass, field

from foveacam_hardware.contract import Role


@dataclass(slots=True)
class WorldFaults:
    """Everything works when all sets are empty.

    `frozen`: cameras that go on counting frames but repeat the last picture. `unplugged`: cameras off the
    bus. `no_strobe`: cameras whose strobe cable is off (the exposure still happens). `no_trigger`: cameras
    whose trigger cable is off. `stuck`: mirrors that stay where they are.
    `drift_step_rad`: a knock to an eye's mount: its turn about the rig's x, y and z (roll), on top of the
    thermal drift.
    """

    frozen: set[Role] = field(default_factory=set)
    unplugged: set[Role] = field(default_factory=set)
    no_strobe: set[Role] = field(default_factory=set)
    no_trigger: set[Role] = field(default_factory=set)
    stuck: set[Role] = field(default_factory=set)
    drift_step_rad: dict[Role, tuple[float, float, float]] = field(default_factory=dict)
