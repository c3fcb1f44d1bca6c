"""Seeded faults of a GigE Vision camera under the server's own hardware thread, in real time.

libaravis' fake camera is a process of its own: killed and restarted, or stopped and continued, while the
mirrors are not at rest. A fault is detected when the problem is reported, and recovered with a frame of a new
epoch.
"""

import random
import shutil
import signal
import subprocess
import time

from foveacam_bench.drivers.aravis import INTERFACE, PROGRAM, lock_interface
from foveacam_bench.faults.hardware_host import (
    OPEN_PATIENCE_S,
    BenchHost,
    controller_rig,
    seconds_until,
    sleep_until,
)
from foveacam_bench.faults.killed_host import random_volts
from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_hardware.camera_config import AravisCameraConfig, CamerasConfig
from foveacam_hardware.contract import CameraPhase, FoveaError, MirrorLimits, Role
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_server.rig.ports import AssembledRig

SEQUENCES, QUICK_SEQUENCES = 16, 2
SEED = 1606
SERIAL = "BENCH-2"
AWAY_S = (0.2, 3.0)
NOTICE_S, RECOVER_S = 5.0, 15.0
PARK_S, ANSWER_S = 1.5, 5.0
TRIGGERED_READ_MS = 300.0
DOWN = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Run the sequences; report that there are none without the fake camera."""
    program = shutil.which(PROGRAM)
    if program is None:
        return {"gige_camera": False}
    with lock_interface():
        for number in range(QUICK_SEQUENCES if quick else SEQUENCES):
            _one_sequence(tally, number, program, most=1 if quick else 2)
    return {"gige_camera": True}


def _one_sequence(tally: FaultTally, number: int, program: str, *, most: int) -> None:
    """Run one sequence: odd numbers with a triggered left camera, even numbers with a wide one."""
    rng = random.Random(SEED + number)  # noqa: S311 - not a secret
    role = Role.LEFT if number % 2 else Role.WIDE
    cables = LimitCables(MirrorLimits())
    with (
        _CameraProgram(program) as camera,
        ControllerProcess(cables, strict=True) as controller,
        BenchHost(controller_rig(controller.port, _cameras(role)), rate_hz=15.0) as host,
    ):
        outages = _Outages(camera, cables, host, rng, role)
        outages.await_delivery()
        for index in range(rng.randint(1, most)):
            outages.cause_fault(tally, killed=(number + number // 2 + index) % 2 == 0)
    tally.add_violations(cables.violations)
    tally.add_sequence()


def _cameras(role: Role) -> CamerasConfig:
    camera = AravisCameraConfig(
        kind="aravis",
        serial=SERIAL,
        interface=INTERFACE,
        width_px=720,
        height_px=540,
        packet_size_bytes=8900,
        trigger="none" if role is Role.WIDE else "software",
    )
    return CamerasConfig(wide=camera) if role is Role.WIDE else CamerasConfig(left=camera)


class _Outages:
    """Lets a camera disappear and return while a host uses it."""

    def __init__(
        self, camera: "_CameraProgram", cables: LimitCables, host: BenchHost, rng: random.Random, role: Role
    ) -> None:
        self._camera = camera
        self._cables = cables
        self._host = host
        self._rng = rng
        self._role = role
        self._epoch = 0

    def await_delivery(self) -> None:
        """Wait for the first frame of the camera."""
        if seconds_until(self._is_recovered, since_ns=time.monotonic_ns(), within_s=OPEN_PATIENCE_S) is None:
            raise TimeoutError(f"{PROGRAM} does not serve on {INTERFACE}; end another one that is there")

    def cause_fault(self, tally: FaultTally, *, killed: bool) -> None:
        """Cause one outage; measure the times of its detection and of the first frame afterwards."""
        self._host.run_on_mirrors(lambda mirrors: mirrors.steer(random_volts(self._rng)), timeout_s=ANSWER_S)
        time.sleep(self._rng.uniform(0.0, 0.3))
        began_ns = time.monotonic_ns()
        self._camera.take_away(killed=killed)
        detected_s = seconds_until(self._is_reported, since_ns=began_ns, within_s=NOTICE_S)
        parked_s = seconds_until(
            lambda: self._cables.rested_since(began_ns), since_ns=time.monotonic_ns(), within_s=PARK_S
        )
        sleep_until(began_ns, self._rng.uniform(*AWAY_S))
        self._camera.bring_back(killed=killed)
        recovered_s = seconds_until(self._is_recovered, since_ns=time.monotonic_ns(), within_s=RECOVER_S)
        if detected_s is None:
            tally.add_hang()
            return
        tally.add_fault(
            kind="camera_killed" if killed else "camera_stopped",
            detected_s=detected_s,
            recovered_s=recovered_s,
            parked=parked_s is not None,
        )

    def _is_reported(self) -> bool:
        """Return whether the fault is reported; an eye's problem stays until a look, so its link is read."""
        if self._role is Role.WIDE:
            return self._host.has_problem(self._role.value)
        links = [camera.link for camera in self._host.hardware.status.cameras if camera.role is self._role]
        return any(link.phase in DOWN for link in links)

    def _is_recovered(self) -> bool:
        """Return whether a frame of a new epoch arrived."""
        if self._is_reported():
            return False
        try:
            epoch = self._host.hardware.submit(self._epoch_of_a_frame).result(ANSWER_S)
        except (FoveaError, TimeoutError):
            return False
        if epoch <= self._epoch:
            return False
        self._epoch = epoch
        return True

    def _epoch_of_a_frame(self, rig: AssembledRig) -> int:
        camera = rig.wide if self._role is Role.WIDE else rig.left
        if self._role is not Role.WIDE:
            camera.software_trigger()
        return camera.read(timeout_ms=TRIGGERED_READ_MS).epoch


class _CameraProgram:
    """The fake camera's process; a context manager."""

    def __init__(self, program: str) -> None:
        self._command = [program, "-i", INTERFACE, "-s", SERIAL]
        self._process = self._launch()

    def __enter__(self) -> "_CameraProgram":
        return self

    def __exit__(self, *_: object) -> None:
        self.take_away(killed=True)

    def take_away(self, *, killed: bool) -> None:
        """Kill or stop the process."""
        if not killed:
            self._process.send_signal(signal.SIGSTOP)
            return
        self._process.kill()
        self._process.wait()

    def bring_back(self, *, killed: bool) -> None:
        """Start it again, or let it continue."""
        if killed:
            self._process = self._launch()
        else:
            self._process.send_signal(signal.SIGCONT)

    def _launch(self) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(  # noqa: S603 - a program found by its name, with constant arguments
            self._command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
