"""Services of captures and stills on a stub rig, whose work runs on the thread that asks for it."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.devices.fake_rig import Pictures
from tests.support.devices.small_stub_rig import small_stub_rig
from tests.support.scenes.dataset_scenes import CALIBRATION

from foveacam_bench.capture.stub_rig import StubRig
from foveacam_hardware.contract import PARKED, Head, VirtualClock
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_server.datasets.capture_tools import CaptureTools
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.store import Store

T = TypeVar("T")


class StubHardware:
    """The part of a hardware thread that captures and stills need; nobody else uses its rig."""

    use = SimpleNamespace(holder=None, check_free=lambda _: None)
    mirrors = SimpleNamespace(check=lambda: None)
    halted = False
    pose = PARKED

    def __init__(self, rig: StubRig) -> None:
        self._rig = rig
        self.binnings: list[object] = []
        """Of the sessions so far; None: the rig's working binning."""

    def check_may_move(self) -> None:
        return

    def submit(self, work: Callable[[StubRig], T]) -> "Future[T]":
        done: Future[T] = Future()
        done.set_result(work(self._rig))
        return done

    expose = submit

    @contextmanager
    def session(self, holder: str, *, binning: object = None, **options: object) -> Iterator[Head]:
        self.binnings.append(binning)
        yield self._rig.head


class FlatWorld:
    """Knows a plane at 4 m in every direction."""

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        return DepthSamples(
            tangents=target[None], inverse_z_per_m=np.array([0.25]), sigma_per_m=np.array([1e-3])
        )


@pytest.fixture
def stub_rig() -> StubRig:
    return small_stub_rig()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path / "data") as found:
        yield found


@pytest.fixture
def events(store: Store) -> Iterator[EventLog]:
    found = EventLog(store)
    yield found
    found.close()


@pytest.fixture
def jobs(store: Store, events: EventLog) -> Iterator[JobRunner]:
    """Jobs that are queued until the runner is started."""
    found = JobRunner(store, events=events, clock=VirtualClock())
    yield found
    found.close()


@pytest.fixture
def tools(stub_rig: StubRig, jobs: JobRunner, events: EventLog) -> CaptureTools:
    return CaptureTools(
        hardware=cast(Any, StubHardware(stub_rig)),
        calibration=cast(Any, SimpleNamespace(current=CALIBRATION, require=lambda: CALIBRATION)),
        jobs=jobs,
        sink=Pictures(),
        overlay=lambda _: None,
        distance_m=lambda: 4.0,
        context=FlatWorld(),
        events=events,
        clock=stub_rig.clock,
    )
