"""Runs all checks in their order: the machine, its cameras, the rig's devices, the program."""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field

from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_cameras import camera_searches
from foveacam_server.checks import buses, devices, ports
from foveacam_server.checks.cameras import Discover, check_named, look_for_cameras
from foveacam_server.checks.findings import Finding
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import needs_of
from foveacam_server.doctor import program
from foveacam_server.doctor.program import check_versions, installed
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.chosen_rig import rig_config


@dataclass(frozen=True, slots=True, kw_only=True)
class ExaminationContext:
    """What the checks examine; a test gives its own."""

    machine: Machine = field(default_factory=Machine)
    searches: Mapping[str, Discover] = field(default_factory=camera_searches)
    versions: Mapping[str, Callable[[], str | None]] = field(default_factory=installed)


def examine(
    settings: Settings, *, trigger_test: bool = False, surroundings: ExaminationContext | None = None
) -> list[Finding]:
    """Run all checks; leave nothing open or changed. Raise `InvalidInput` for a bad rig file."""
    where = surroundings or ExaminationContext()
    machine, config = where.machine, rig_config(settings)
    needs = needs_of(config)
    cameras, searched = look_for_cameras(where.searches, needs)
    findings = [
        check_versions(needs, where.versions),
        ports.check_ports(machine, needs),
        ports.check_port_permission(machine, needs),
        ports.check_holders(machine, needs),
        ports.check_latency(machine, needs),
        buses.check_usb_permission(machine),
        buses.check_usbfs(machine, needs),
        buses.check_receive_buffer(machine, needs),
        *searched,
        buses.check_mtu(machine, cameras),
        *check_named(cameras, needs),
    ]
    rig = open_rig(config)
    with closing(rig):
        rig.connect()
        findings += devices.check_devices(rig)
        if trigger_test:
            findings += devices.check_trigger(rig)
    findings.append(program.check_calibration(settings, rig.rig_id))
    if needs.simulated:
        findings.append(program.check_renderer_cache(settings))
    return [*findings, program.check_port(settings), program.check_data(settings), program.check_console()]
