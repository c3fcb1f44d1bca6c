"""Assembles the simulated rig: one world, the real drivers on simulated far ends, and simulated cameras."""

import math
from contextlib import ExitStack

from foveacam_hardware.contract import (
    Clock,
    MonotonicClock,
    PanTiltLimits,
    PanTiltPose,
    RailLimits,
    Role,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_hardware.rail_config import PAPER_PLACES
from foveacam_hardware.rig import Rig, RigName
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.cameras import SimCamera
from foveacam_hardware.sim.far_ends.board_far_end import BoardKind
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackLink
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.grbl_firmware import RAIL_SWITCH_MM, SWITCHES_DEG
from foveacam_hardware.sim.optics import HALF_BASELINE_M
from foveacam_hardware.sim.pan_tilt import Operator
from foveacam_hardware.sim.presets import find_preset
from foveacam_hardware.sim.truth import Truth
from foveacam_hardware.sim.world import World
from foveacam_hardware.simulated_faults import MirrorDisturbance
from foveacam_hardware.wire.link import PortLinkFactory

PAN_TILT_LIMITS = PanTiltLimits(
    pan_min_rad=math.radians(-70.0),
    pan_max_rad=math.radians(70.0),
    tilt_min_rad=math.radians(-30.0),
    tilt_max_rad=math.radians(30.0),
)
PAN_TILT_MOUNTING = GrblMounting(
    zero=PanTiltPose(pan_rad=math.radians(SWITCHES_DEG[0]), tilt_rad=math.radians(SWITCHES_DEG[1])),
    speed_rad_s=math.radians(25.0),
)
RAIL_LIMITS = RailLimits(min_m=-0.305, max_m=0.305)
RAIL_MOUNTING = GrblRailMounting(zero_m=1e-3 * RAIL_SWITCH_MM, speed_m_s=0.1)
PULSE_US = 4_000
"""Half of the default exposure; the head shortens it with the exposure."""
SLOW_LINK = LinkSupervision(answer_s=1.0, probe_s=0.5, least_baseline_ms=10.0)
"""Longer times than on a real link: the renderer competes with the far end for this machine's cores."""
VIRTUAL_START_NS = 1_000_000_000
"""Start of virtual time: the controller has been up for a second, and histories have room before it."""


def open_simulated(
    scene: str = "bench",
    preset: str = "rig120",
    *,
    clock: Clock | None = None,
    inline: bool = False,
    seed: int = 0,
    mirror_disturbance: MirrorDisturbance | None = None,
) -> Rig:
    """Return a connected simulated rig; its mirrors are ideal without a `mirror_disturbance`.

    `inline`: everything in this process on virtual time, faster than real time and deterministic;
    else in real time, the far ends in processes of their own behind pseudo terminals.
    """
    config = SimulatedRigConfig(
        scene=scene,
        preset=preset,
        seed=seed,
        mirror_disturbance=mirror_disturbance or MirrorDisturbance(),
    )
    rig = simulated_rig(config, clock=clock, inline=inline)
    rig.connect()
    return rig


def simulated_rig(config: SimulatedRigConfig, *, clock: Clock | None = None, inline: bool = False) -> Rig:
    """Return the simulated rig of a configuration, not yet connected."""
    preset = find_preset(config.preset)
    if clock is None:
        clock = VirtualClock(VIRTUAL_START_NS) if inline else MonotonicClock()
    scene = AnimatedScene(config.scene)
    world = World(scene=scene, preset=preset, seed=config.seed, clock=clock, assembly=config.assembly)
    world.faults.set_faults(config.faults)
    world.mirrors.disturb(config.mirror_disturbance)
    with ExitStack() as cleanup:  # a far end that fails to start leaves no thread behind
        cleanup.callback(scene.close)
        board = _start_board(world, clock, inline=inline)  # it starts while the controller starts
        cleanup.callback(board.close)
        controller, link_factory = _start_controller(world, clock, strict=config.strict, inline=inline)
        cleanup.pop_all()
    mirrors = ControllerMirrors(
        link_factory, clock, low_pass_hz=preset.low_pass_hz, name="simulated", supervision=SLOW_LINK
    )
    wide, left, right = (SimCamera(world, role, clock=clock) for role in (Role.WIDE, Role.LEFT, Role.RIGHT))
    head = TriggeredHead(
        mirrors, left, right, wide, clock=clock, settle_us=preset.settle_us, pulse_us=PULSE_US
    )
    name = RigName(
        rig_id=preset.rig_id(config.seed),
        name=config.name,
        simulated=True,
        baseline_m=2.0 * HALF_BASELINE_M,
        scene=scene.name,
    )
    rig = Rig(name, clock=clock, mirrors=mirrors, cameras=(wide, left, right), head=head)
    _add_positioners(rig, board, clock)
    if config.pan_tilt == "manual":
        operator = Operator(world.manual_motion, clock, config.operator, seed=config.seed)
        rig.pan_tilt = ManualPanTilt(on_wanted=operator.turn_to)
    rig.stations = tuple(table.station() for table in scene.file.stations)
    rig.breakable = world.faults
    rig.working_binning = config.working_binning
    rig.truth = Truth(world, controller, board)
    rig.own([scene, board] if isinstance(controller, ControllerFarEnd) else [scene, board, controller])
    return rig


def _add_positioners(rig: Rig, board: BoardLoopback[GrblFarEnd] | BoardProcess, clock: Clock) -> None:
    """Add the pan-tilt and the rail, both driven by one board."""
    axes = [*PAN_TILT_MOUNTING.axes(PAN_TILT_LIMITS), RAIL_MOUNTING.axis(RAIL_LIMITS)]
    motors = GrblBoard(board.open, clock, axes=axes, name="pan-tilt and rail")
    rig.pan_tilt = GrblPanTilt(
        board.open,
        clock,
        limits=PAN_TILT_LIMITS,
        name="pan-tilt",
        mounting=PAN_TILT_MOUNTING,
        board=motors,
    )
    rig.rail = GrblRail(board.open, clock, limits=RAIL_LIMITS, mounting=RAIL_MOUNTING, board=motors)
    rig.rail_places = PAPER_PLACES


def _start_board(world: World, clock: Clock, *, inline: bool) -> BoardLoopback[GrblFarEnd] | BoardProcess:
    """Start the far end of the pan-tilt and rail, whose motors move the world's rig."""
    if not inline:
        return BoardProcess(BoardKind.GRBL_WITH_RAIL, world)
    board = BoardLoopback(GrblFarEnd(clock, world, has_rail=True), clock)
    world.advance_motors = board.advance
    return board


def _start_controller(
    world: World, clock: Clock, *, strict: bool, inline: bool
) -> tuple[ControllerFarEnd | ControllerProcess, PortLinkFactory]:
    """Start the controller's far end; return it and the factory of links to it."""
    flaws = world.assembly
    # a strobe follows its exposure, which the camera's own settings may delay
    left_us, right_us = (eye.exposure_delay_us + eye.strobe_delay_us for eye in (flaws.left, flaws.right))
    delays_us = (left_us, right_us)
    if not inline:
        process = ControllerProcess(
            world, strict=strict, strobe_delay_us=delays_us, clock_ppm=flaws.controller_clock_ppm
        )
        return process, process.open
    far_end = ControllerFarEnd(clock, world, strict=strict)
    far_end.be_flawed(strobe_delay_us=delays_us, clock_ppm=flaws.controller_clock_ppm)
    return far_end, lambda: LoopbackLink(far_end, clock)
