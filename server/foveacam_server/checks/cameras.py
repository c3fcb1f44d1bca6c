"""Checks which cameras each driver's library finds, and whether those of the rig file are among them."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from foveacam_hardware.contract import FoveaError
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.drivers.cameras.opencv.video_devices import is_device, is_named
from foveacam_server.checks.findings import Finding, failed, fine, problem, warning
from foveacam_server.checks.needs import MACHINE_VISION, NamedCamera, RigNeeds

Discover: TypeAlias = Callable[[], list[FoundCamera]]
"""Lists cameras without opening any; raises `NotConnected` when its library is missing."""


def look_for_cameras(
    discoveries: Mapping[str, Discover], needs: RigNeeds
) -> tuple[list[FoundCamera], list[Finding]]:
    """List the cameras of every driver; return them, and a finding for each driver."""
    cameras: list[FoundCamera] = []
    findings = []
    for kind, discover in discoveries.items():
        name = f"cameras_{kind}"
        try:
            found = discover()
        except FoveaError as failure:
            needed = kind in needs.kinds
            findings.append(
                problem(name, str(failure), f"install what {kind} needs, or give the camera another kind")
                if needed
                else fine(name, f"not usable here, and not needed: {failure}")
            )
            continue
        except Exception as error:  # noqa: BLE001 - a vendor's library may raise anything
            findings.append(failed(name, error))
            continue
        cameras.extend(found)
        findings.append(_judge(name, found))
    return cameras, findings


def check_named(cameras: Sequence[FoundCamera], needs: RigNeeds) -> list[Finding]:
    """Check whether each camera of the rig file was found; skip streams and files."""
    findings = []
    for named in needs.cameras:
        if named.kind not in MACHINE_VISION:
            if is_device(named.wanted):
                findings.append(_check_video_device(named, cameras))
            continue
        same = [camera for camera in cameras if camera.kind == named.kind]
        found = next((camera for camera in same if camera.info.serial == named.wanted), None)
        name = f"camera_{named.role}"
        if found is None:
            others = ", ".join(camera.info.serial for camera in same) or "none"
            elsewhere = next((camera.kind for camera in cameras if camera.info.serial == named.wanted), None)
            hint = f"; the {elsewhere} driver sees it: write that as its kind" if elsewhere else ""
            findings.append(
                problem(
                    name,
                    f"serial {named.wanted} is not there; {named.kind} found {others}{hint}",
                    "plug it in, check its power and its network address, or correct the serial in the rig"
                    " file",
                )
            )
        elif found.problem is not None:
            findings.append(problem(name, f"{_describe(found)}: {found.problem}", "free it, then ask again"))
        else:
            findings.append(fine(name, _describe(found)))
    return findings


def _check_video_device(named: NamedCamera, cameras: Sequence[FoundCamera]) -> Finding:
    """Check whether the rig file's video device is present."""
    name = f"camera_{named.role}"
    same = [camera for camera in cameras if camera.kind == named.kind]
    found = next((camera for camera in same if is_named(camera, named.wanted)), None)
    if found is None:
        others = ", ".join(camera.info.serial for camera in same) or "none"
        return problem(
            name,
            f"source {named.wanted} is not there; the system has {others}",
            "plug it in, or correct the source in the rig file",
        )
    if found.problem is not None:
        return problem(name, f"{_describe(found)}: {found.problem}", "let it be opened, then ask again")
    return fine(name, _describe(found))


def _judge(name: str, found: Sequence[FoundCamera]) -> Finding:
    cameras_text = ", ".join(map(_describe, found)) or "none found"
    twice = [serial for serial, count in Counter(camera.info.serial for camera in found).items() if count > 1]
    if twice:
        return warning(
            name,
            f"{cameras_text}; serial {', '.join(twice)} is there more than once",
            "give each camera a serial number of its own, or look on one interface alone (`interface = …`)",
        )
    return fine(name, cameras_text)


def _describe(camera: FoundCamera) -> str:
    where = f" at {camera.address}" if camera.address else ""
    word = "serial" if camera.kind in MACHINE_VISION else "source"
    return f"{camera.info.vendor} {camera.info.model} {word} {camera.info.serial or '?'}{where}"
