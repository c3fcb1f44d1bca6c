"""Samples the server's parts on a separate thread, and describes their load."""

import os
from collections import ChainMap, deque
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from foveacam_hardware.contract import CameraCounters, Clock
from foveacam_server import __version__
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.periodic import PeriodicThread
from foveacam_server.foundation.store import Store
from foveacam_server.foundation.watching.flows import HARDWARE, FlowCount, FlowKey, camera_part, read_flows
from foveacam_server.resources.operating.engine.graph import edge_documents, part_documents
from foveacam_server.resources.operating.engine.loads import (
    BUSY_SHARE,
    BucketCounts,
    ThreadSample,
    read_stages,
    stage_documents,
    thread_loads,
    thread_names,
    unknown_loads,
)
from foveacam_server.resources.operating.engine.process_files import ProcessFiles
from foveacam_server.resources.operating.engine.schema import (
    CameraFlowDocument,
    EngineDocument,
    EventLoopDocument,
    HardwareLoadDocument,
    ProcessDocument,
    StageDocument,
    StartTimeDocument,
    ThreadDocument,
    ViewFlowDocument,
)
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import LENGTH
from foveacam_server.rig.hardware_thread.opening_steps import OpeningStep
from foveacam_server.rig.loop_lag import WINDOW_S, LoopLag
from foveacam_server.rig.status import CameraStatus
from foveacam_server.rig.stream import LiveStreams

PERIOD_S = 2.0
MINUTE_S = 60.0
FLOW_SAMPLES = 6
"""Samples kept of the flows, whose rates are those of the last 10 s."""
MINUTE_SAMPLES = 6
"""Samples kept of a minute's counts: one every 10 s."""
LATE_MS = 500.0
"""Lag from which the event loop is flagged; opening a page causes less."""
_MB = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineParts:
    """The parts that are sampled."""

    hardware: HardwareThread
    streams: LiveStreams
    store: Store
    clock: Clock
    process: ProcessFiles
    lag: LoopLag
    loop_thread: int
    """The event loop's thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _LoadSample:
    threads: ThreadSample
    idle_s: float
    """Idle time of the hardware thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _FlowSample:
    t_s: float
    flows: Mapping[FlowKey, FlowCount]


@dataclass(frozen=True, slots=True, kw_only=True)
class _MinuteSample:
    t_s: float
    stages: Mapping[str, BucketCounts]
    lost: Mapping[str, int]
    """Frames by camera."""


class EngineService:
    """Measures the load of the last two seconds and the counts of the last minute, until closed."""

    def __init__(self, parts: EngineParts) -> None:
        self._parts = parts
        age_s = parts.process.age_s()
        self._services_opened_s = age_s
        self._began_s = None if age_s is None else self._now_s() - age_s
        self._loads: deque[_LoadSample] = deque([self._sample()], maxlen=2)
        self._minute: deque[_MinuteSample] = deque([self._minute_sample()], maxlen=MINUTE_SAMPLES + 1)
        self._flows: deque[_FlowSample] = deque([self._flow_sample()], maxlen=FLOW_SAMPLES)
        self._thread = PeriodicThread("foveacam-engine", self.update, period_s=PERIOD_S)

    def start(self) -> None:
        """Start to sample."""
        self._thread.start()

    def close(self) -> None:
        """End the thread and the timer of the event loop."""
        self._thread.close()

    def update(self) -> None:
        """Take one sample; called every `PERIOD_S`."""
        self._loads.append(self._sample())
        self._flows.append(self._flow_sample())
        if self._now_s() - self._minute[-1].t_s >= MINUTE_S / MINUTE_SAMPLES:
            self._minute.append(self._minute_sample())

    def describe(self) -> EngineDocument:
        """Return the load of every part."""
        samples = tuple(self._loads)
        before, now = samples if len(samples) == 2 else (None, samples[0])
        threads, hardware, cameras = self._threads(before, now), self._hardware(before, now), self._cameras()
        flows, flows_before = self._flow_sample(), self._flows[0]
        flow_window_s = flows.t_s - flows_before.t_s
        edges = edge_documents(flows.flows, flows_before.flows, window_s=flow_window_s)
        return EngineDocument(
            utc=utc_now(),
            version=__version__,
            window_s=None if before is None else round(now.threads.t_s - before.threads.t_s, 2),
            process=self._process(threads),
            hardware=hardware,
            event_loop=self._event_loop(),
            threads=threads,
            stages=self._stages(),
            cameras=cameras,
            views=self._views(),
            start=[self._start(step) for step in self._parts.hardware.opening.steps.every],
            flow_window_s=round(flow_window_s, 2),
            parts=part_documents(edges, threads=threads, hardware=hardware, cameras=cameras),
            edges=edges,
        )

    def _now_s(self) -> float:
        return self._parts.clock.now_ns() / 1e9

    def _sample(self) -> _LoadSample:
        cpu_s = self._parts.process.cpu_s()
        return _LoadSample(
            threads=ThreadSample(t_s=self._now_s(), cpu_s=cpu_s), idle_s=self._parts.hardware.commands.idle_s
        )

    def _flow_sample(self) -> _FlowSample:
        cameras = {
            FlowKey(camera_part(camera.role.value), HARDWARE, "frames"): FlowCount(
                passed=camera.counters.delivered, dropped=_lost(camera.counters)
            )
            for camera in self._parts.hardware.status.cameras
        }
        return _FlowSample(t_s=self._now_s(), flows={**read_flows(), **cameras})

    def _minute_sample(self) -> _MinuteSample:
        return _MinuteSample(
            t_s=self._now_s(),
            stages=read_stages(),
            lost={
                camera.role.value: _lost(camera.counters) for camera in self._parts.hardware.status.cameras
            },
        )

    def _threads(self, before: _LoadSample | None, now: _LoadSample) -> list[ThreadDocument]:
        names = thread_names(self._parts.loop_thread)
        if before is None or not now.threads.cpu_s:
            return unknown_loads(names.values())
        return thread_loads(before.threads, now.threads, names=names)

    def _process(self, threads: list[ThreadDocument]) -> ProcessDocument:
        process, age_s = self._parts.process, self._parts.process.age_s()
        memory_mb = process.memory_mb()
        shares = [thread.cpu_share for thread in threads if thread.cpu_share is not None]
        return ProcessDocument(
            began_utc=None if age_s is None else _utc_before(age_s),
            up_s=_rounded(age_s),
            services_opened_s=_rounded(self._services_opened_s),
            cores=os.cpu_count() or 1,
            cpu_share=round(sum(shares), 3) if shares else None,
            memory_mb=_rounded(memory_mb),
            open_files=process.open_files(),
            open_files_limit=process.open_files_limit(),
            database_mb=round(self._parts.store.size_bytes / _MB, 2),
        )

    def _hardware(self, before: _LoadSample | None, now: _LoadSample) -> HardwareLoadDocument:
        hardware, busy_share = self._parts.hardware, None
        if before is not None and hardware.status.rig_id is not None:
            window_s = now.threads.t_s - before.threads.t_s
            busy_share = round(min(max(1.0 - (now.idle_s - before.idle_s) / window_s, 0.0), 1.0), 3)
        return HardwareLoadDocument(
            queue_length=hardware.commands.waiting,
            queue_limit=LENGTH,
            busy_share=busy_share,
            flagged=busy_share is not None and busy_share >= BUSY_SHARE,
        )

    def _event_loop(self) -> EventLoopDocument:
        worst_ms = self._parts.lag.worst_ms()
        return EventLoopDocument(
            worst_lag_ms=_rounded(worst_ms),
            window_s=WINDOW_S,
            flagged=worst_ms is not None and worst_ms >= LATE_MS,
        )

    def _stages(self) -> list[StageDocument]:
        before = self._minute[0]
        return stage_documents(read_stages(), before.stages, window_s=self._now_s() - before.t_s)

    def _cameras(self) -> list[CameraFlowDocument]:
        before = ChainMap(*(dict(sample.lost) for sample in tuple(self._minute)))  # the oldest sample wins
        return [_camera(camera, lost_before=before) for camera in self._parts.hardware.status.cameras]

    def _views(self) -> list[ViewFlowDocument]:
        streams = self._parts.streams
        statuses = [(name, streams.hub.status(name)) for name in streams.hub.names]
        return [
            ViewFlowDocument(
                view=name,
                rate_hz=round(status.rate_hz, 2),
                expected_hz=status.expected_hz,
                slow_reason=status.slow_reason,
                published=status.published,
                repeated=status.repeated,
                sent=streams.sent[name],
                dropped=streams.dropped[name],
            )
            for name, status in statuses
            if status.published > 0
        ]

    def _start(self, step: OpeningStep) -> StartTimeDocument:
        begun_s = None if step.began_ns is None else step.began_ns / 1e9
        ended = begun_s is not None and step.ended_ns is not None
        return StartTimeDocument(
            device=step.device,
            state=step.state.value,
            after_s=None if begun_s is None or self._began_s is None else round(begun_s - self._began_s, 3),
            duration_s=round((step.ended_ns or 0) / 1e9 - (begun_s or 0.0), 3) if ended else None,
        )


def _camera(camera: CameraStatus, *, lost_before: Mapping[str, int]) -> CameraFlowDocument:
    counters, lost = camera.counters, _lost(camera.counters)
    recently = max(lost - lost_before.get(camera.role.value, lost), 0)  # recounted after a loss
    return CameraFlowDocument(
        role=camera.role.value,
        connected=camera.connected,
        rate_hz=round(camera.frame_rate_hz, 2),
        worst_gap_ms=None if camera.worst_gap_ns is None else round(camera.worst_gap_ns / 1e6, 1),
        delivered=counters.delivered,
        skipped=counters.skipped,
        dropped=counters.dropped,
        incomplete=counters.incomplete,
        late=counters.late,
        underrun=counters.underrun,
        lost_last_minute=recently,
        flagged=recently > 0,
    )


def _lost(counters: CameraCounters) -> int:
    missing = max(counters.dropped, counters.underrun)  # an underrun leaves a gap in the numbers, too
    return missing + counters.incomplete + counters.late


def _utc_before(age_s: float) -> str:
    began = datetime.now(UTC) - timedelta(seconds=age_s)
    return began.isoformat(timespec="seconds").replace("+00:00", "Z")


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 1)
