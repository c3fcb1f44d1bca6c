"""Builds the pan-tilt and the rail of a hardware rig, which may share one motor board.

Besides `rig`, the only module that names their drivers.
"""

import math
from dataclasses import dataclass

from foveacam_hardware.contract import Clock, PanTilt, Rail, RailPlace, Station
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt, ManualRail
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig, ManualPanTiltConfig, PtuPanTiltConfig
from foveacam_hardware.rail_config import GrblRailConfig, ManualRailConfig
from foveacam_hardware.rig_config import SerialRigConfig
from foveacam_hardware.wire.link import serial_link


@dataclass(frozen=True, slots=True, kw_only=True)
class RigBase:
    """Pan-tilt and rail (None where the rig has none), with their stations and named positions."""

    pan_tilt: PanTilt | None
    stations: tuple[Station, ...]
    rail: Rail | None
    places: tuple[RailPlace, ...]


def build_base(config: SerialRigConfig, clock: Clock) -> RigBase:
    """Return the pan-tilt and the rail of a rig file, not yet connected."""
    turns, moves = config.pan_tilt, config.rail
    board = _shared_board(config, clock)
    return RigBase(
        pan_tilt=None if turns is None else _pan_tilt(turns, clock, board),
        stations=() if turns is None else tuple(table.station() for table in turns.stations),
        rail=None if moves is None else _rail(moves, clock, board),
        places=() if moves is None else moves.named_positions,
    )


def _shared_board(config: SerialRigConfig, clock: Clock) -> GrblBoard | None:
    turns, moves = config.pan_tilt, config.rail
    if not (isinstance(turns, GrblPanTiltConfig) and isinstance(moves, GrblRailConfig)):
        return None
    if turns.port != moves.port:
        return None
    axes = [*_grbl_mounting(turns).axes(turns.limits), _rail_mounting(moves).axis(moves.limits)]
    return GrblBoard(
        serial_link(turns.port), clock, axes=axes, name=turns.port, has_switches=turns.has_switches
    )


def _pan_tilt(
    config: GrblPanTiltConfig | PtuPanTiltConfig | ManualPanTiltConfig, clock: Clock, board: GrblBoard | None
) -> PanTilt:
    match config:
        case ManualPanTiltConfig():
            return ManualPanTilt()
        case PtuPanTiltConfig():
            mounting = PtuMounting(
                zero=config.zero,
                speed_rad_s=math.radians(config.speed_deg_s),
                upside_down=config.upside_down,
            )
            link = serial_link(config.port, baud=config.baud)
            return PtuPanTilt(link, clock, limits=config.limits, name=config.port, mounting=mounting)
        case GrblPanTiltConfig():
            return GrblPanTilt(
                serial_link(config.port),
                clock,
                limits=config.limits,
                name=config.port,
                mounting=_grbl_mounting(config),
                board=board,
            )


def _rail(config: GrblRailConfig | ManualRailConfig, clock: Clock, board: GrblBoard | None) -> Rail:
    if isinstance(config, ManualRailConfig):
        return ManualRail(limits=config.limits)
    return GrblRail(
        serial_link(config.port),
        clock,
        limits=config.limits,
        name=config.port,
        mounting=_rail_mounting(config),
        board=board,
    )


def _grbl_mounting(config: GrblPanTiltConfig) -> GrblMounting:
    return GrblMounting(
        zero=config.zero,
        speed_rad_s=math.radians(config.speed_deg_s),
        has_switches=config.has_switches,
    )


def _rail_mounting(config: GrblRailConfig) -> GrblRailMounting:
    return GrblRailMounting(
        zero_m=1e-3 * (config.zero_mm or 0.0),
        speed_m_s=1e-3 * config.speed_mm_s,
        has_switches=config.has_switches,
        reversed=config.reversed,
    )
