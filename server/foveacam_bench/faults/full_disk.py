"""A full disk while the server's hardware thread runs: steering continues, no event is lost.

The data directory is on a file system of one megabyte that is filled up; where none can be mounted, the
database is limited in size. Either way the database itself reports that there is no space.
"""

import random
import tempfile
import time
from pathlib import Path
from typing import Protocol

from sqlalchemy import select

from foveacam_bench.faults.hardware_host import BenchHost, controller_rig, seconds_until, sleep_until
from foveacam_bench.faults.killed_host import random_volts
from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_bench.small_disk import SmallDisk, small_disk
from foveacam_hardware.contract import FoveaError, MirrorLimits
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_server.foundation.store import EventRow

SEQUENCES, QUICK_SEQUENCES = 8, 1
SEED = 2812
DISK_BYTES = 1_000_000
EVENTS, EVENT_BYTES = 40, 2000
AWAY_S = (0.3, 2.0)
NOTICE_S, RECOVER_S = 5.0, 15.0
STEER_S = 0.5
"""Longest time of a move; more means that the rig waits for the disk."""
STEER_PERIOD_S = 0.02
LATE_IN_A_ROW = 3
"""Late moves in a row that mean that the rig waits for the disk; a busy machine causes one or two."""
ANY_PAGES = 1_073_741_823


class FillableDisk(Protocol):
    """A disk that can be filled."""

    def fill(self) -> None:
        """Use all space."""
        ...

    def free(self) -> None:
        """Free the space."""
        ...


class CappedDatabase:
    """A database that may not grow."""

    def __init__(self, host: BenchHost) -> None:
        self._host = host

    def fill(self) -> None:
        """Limit the database to its present pages."""
        self._cap(1)

    def free(self) -> None:
        """Remove the limit."""
        self._cap(ANY_PAGES)

    def _cap(self, pages: int) -> None:
        with self._host.store.session() as session:
            session.connection().exec_driver_sql(f"PRAGMA max_page_count={pages}")


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Run the sequences; return whether a file system was filled, and how many events were lost."""
    lost = 0
    with (
        tempfile.TemporaryDirectory(prefix="foveacam-disk-") as name,
        small_disk(Path(name), size_bytes=DISK_BYTES) as disk,
    ):
        for number in range(QUICK_SEQUENCES if quick else SEQUENCES):
            folder = Path(name) / str(number)
            lost += _one_sequence(tally, number, disk, folder)
        return {"disk_was_real": disk is not None, "events_lost": lost}


def _one_sequence(tally: FaultTally, number: int, disk: SmallDisk | None, folder: Path) -> int:
    """Fill the disk once, or twice in a row; return how many events were lost."""
    rng = random.Random(SEED + number)  # noqa: S311 - not a secret
    cables = LimitCables(MirrorLimits())
    with (
        ControllerProcess(cables, strict=True) as controller,
        BenchHost(controller_rig(controller.port), folder=folder) as host,
    ):
        for _ in range(rng.randint(1, 2)):
            _fill_once(tally, disk or CappedDatabase(host), host, rng)
        lost = _lost_events(host)
    for file in folder.iterdir():
        file.unlink()  # frees space for the next sequence
    tally.add_violations(cables.violations)
    tally.add_sequence()
    return lost


def _fill_once(tally: FaultTally, disk: FillableDisk, host: BenchHost, rng: random.Random) -> None:
    disk.fill()
    began_ns = time.monotonic_ns()
    for number in range(EVENTS):
        host.events.emit("bench", f"{number} " + "x" * EVENT_BYTES)
    noticed_s = seconds_until(lambda: host.events.fault is not None, since_ns=began_ns, within_s=NOTICE_S)
    away_s = rng.uniform(*AWAY_S)
    late, in_time = 0, 0
    while (time.monotonic_ns() - began_ns) / 1e9 < away_s:
        if _steers(host, rng):
            late, in_time = 0, in_time + 1
        elif (late := late + 1) == LATE_IN_A_ROW:
            break
        time.sleep(STEER_PERIOD_S)
    sleep_until(began_ns, away_s)
    disk.free()
    back_ns = time.monotonic_ns()
    recovered_s = seconds_until(lambda: host.events.fault is None, since_ns=back_ns, within_s=RECOVER_S)
    if noticed_s is None or late == LATE_IN_A_ROW or (late and not in_time):
        tally.add_hang()
        return
    # `parked`: the mirrors need not be parked, since the rig is not affected
    tally.add_fault(kind="disk_full", detected_s=noticed_s, recovered_s=recovered_s, parked=True)


def _steers(host: BenchHost, rng: random.Random) -> bool:
    """Return whether the rig moves as fast as with an empty disk."""
    try:
        volts = host.run_on_mirrors(lambda mirrors: mirrors.steer(random_volts(rng)), timeout_s=STEER_S)
    except (FoveaError, TimeoutError):
        return False
    return host.mirrors.state.volts == volts and not host.mirrors_faulty


def _lost_events(host: BenchHost) -> int:
    """Return how many of the emitted events are not in the table after the writer's timeout."""
    emitted = {event.id for event in host.events.recent(2000)}

    def missing() -> set[int]:
        with host.store.session() as session:
            return emitted - set(session.scalars(select(EventRow.id)))

    seconds_until(lambda: not missing(), since_ns=time.monotonic_ns(), within_s=NOTICE_S)
    return len(missing())
