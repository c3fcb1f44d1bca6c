"""Routes for monitoring: liveness, readiness, and counters for Prometheus."""

from dataclasses import dataclass

from fastapi.responses import JSONResponse, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, open_to_anybody
from foveacam_server.foundation.errors import StillOpening
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.foundation.watching import timings
from foveacam_server.resources.devices.rig_state.schema import StartDocument
from foveacam_server.resources.devices.rig_state.start_steps import start_document
from foveacam_server.rig.device_reconnector import BASE
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.status import RigState
from foveacam_server.rig.stop import StopSwitch
from foveacam_server.rig.stream import LiveStreams

router = GuardedRouter(tags=["health"], reading=Right.VIEW, changing=Right.ADMINISTER)


class Liveness(ResponseModel):
    """The process is alive."""

    status: str


class ReadyProblem(ResponseModel):
    """A device or service that is missing."""

    device: str
    detail: str


class Readiness(ResponseModel):
    """Whether a fixation could start now; `start`: the steps of the rig's start while it opens, else null."""

    ready: bool
    problems: list[ReadyProblem]
    start: StartDocument | None = None


@router.get("/healthz", summary="Is the process alive?")
@open_to_anybody
async def healthz() -> Liveness:
    """Answer in any state of the rig."""
    return Liveness(status="ok")


@router.get(
    "/readyz",
    summary="Can it foveate now?",
    response_model=Readiness,
    responses={503: {"model": Readiness, "description": "not ready; lists what is missing"}},
)
async def readyz(
    hardware: Provided[HardwareThread], calibration: Provided[CalibrationInForce], events: Provided[EventLog]
) -> JSONResponse:
    """Return 200 when a fixation could start now, else 503 and what is missing."""
    status = hardware.status
    missing = [
        ReadyProblem(device=problem.device, detail=problem.detail)
        for problem in status.problems
        if problem.device not in BASE  # not required for a fixation
    ]
    if status.state is RigState.OPENING:
        missing.append(ReadyProblem(device="rig", detail="the rig is still opening"))
    if status.rig_id is not None and calibration.problem is not None:
        missing.append(ReadyProblem(device="calibration", detail=calibration.problem))
    if events.fault is not None:
        missing.append(ReadyProblem(device="storage", detail=events.fault))
    start = None if status.opened else start_document(hardware, calibration)
    readiness = Readiness(ready=not missing, problems=missing, start=start)
    headers = {} if status.opened else {"Retry-After": str(StillOpening.wait_s)}
    return JSONResponse(readiness.model_dump(), status_code=503 if missing else 200, headers=headers)


@router.get("/metrics", summary="Counters for Prometheus", response_class=Response)
def metrics(
    hardware: Provided[HardwareThread],
    streams: Provided[LiveStreams],
    jobs: Provided[JobRunner],
    events: Provided[EventLog],
    stop: Provided[StopSwitch],
) -> Response:  # on a worker thread: rendering them takes too long for the event loop
    """Return the counters in Prometheus' text format."""
    registry = registry_of(hardware, streams, jobs, events, stop)
    text = generate_latest(registry) + generate_latest(timings.REGISTRY)
    return Response(text, media_type=CONTENT_TYPE_LATEST)


def registry_of(
    hardware: HardwareThread, streams: LiveStreams, jobs: JobRunner, events: EventLog, stop: StopSwitch
) -> CollectorRegistry:
    """Return a registry that reads the counters of these services once."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_ServiceCounters(hardware, streams, jobs, events, stop))
    return registry


@dataclass(frozen=True, slots=True)
class _ServiceCounters(Collector):
    hardware: HardwareThread
    streams: LiveStreams
    jobs: JobRunner
    events: EventLog
    stop: StopSwitch

    def collect(self) -> list[Metric]:
        """Return the present values of all metrics."""
        return [*self._rig(), *self._views(), *self._work()]

    def _rig(self) -> list[Metric]:
        status = self.hardware.status
        ready = GaugeMetricFamily("foveacam_rig_ready", "1 while the rig is ready")
        ready.add_metric([], float(status.state is RigState.READY))
        problems = GaugeMetricFamily("foveacam_rig_problems", "devices that fail now")
        problems.add_metric([], len(status.problems))
        delivered = CounterMetricFamily("foveacam_camera_frames", "frames delivered", labels=["camera"])
        dropped = CounterMetricFamily("foveacam_camera_dropped", "frames that were lost", labels=["camera"])
        skipped = CounterMetricFamily("foveacam_camera_skipped", "frames not read in time", labels=["camera"])
        for camera in status.cameras:
            delivered.add_metric([camera.role.value], camera.counters.delivered)
            skipped.add_metric([camera.role.value], camera.counters.skipped)
            dropped.add_metric([camera.role.value], camera.counters.dropped)
        packets = CounterMetricFamily("foveacam_controller_packets", "packets", labels=["kind"])
        round_trip = GaugeMetricFamily("foveacam_controller_rtt_ms", "round trip, ms", labels=["quantile"])
        if status.telemetry is not None:
            packets.add_metric(["sent"], status.telemetry.tx_packets)
            packets.add_metric(["received"], status.telemetry.rx_packets)
            packets.add_metric(["bad"], status.telemetry.bad_packets)
            packets.add_metric(["bad_crc"], status.telemetry.crc_errors)
            round_trip.add_metric(["0.5"], status.telemetry.rtt_p50_ms)
            round_trip.add_metric(["0.99"], status.telemetry.rtt_p99_ms)
        return [ready, problems, delivered, skipped, dropped, packets, round_trip]

    def _views(self) -> list[Metric]:
        streams = self.streams
        published = CounterMetricFamily("foveacam_view_pictures", "pictures published", labels=["view"])
        for name in streams.hub.names:
            published.add_metric([name], streams.hub.status(name).published)
        clients = GaugeMetricFamily("foveacam_stream_clients", "connected pages")
        clients.add_metric([], streams.clients)
        sent = CounterMetricFamily("foveacam_stream_bytes", "bytes of pictures sent")
        sent.add_metric([], streams.bytes_sent)
        return [published, clients, sent]

    def _work(self) -> list[Metric]:
        jobs = GaugeMetricFamily("foveacam_jobs_open", "jobs that wait or run")
        jobs.add_metric([], self.jobs.open_jobs)
        stopped = GaugeMetricFamily("foveacam_stop_engaged", "1 while the stop is engaged")
        stopped.add_metric([], float(self.stop.state.engaged))
        unwritten = CounterMetricFamily("foveacam_events_unwritten", "events not written to the disk")
        unwritten.add_metric([], self.events.unwritten)
        return [jobs, stopped, unwritten]
