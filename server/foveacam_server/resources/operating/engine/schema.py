"""Schemas of the engine's load. `flagged`: the part does not keep up."""

from typing import Literal, TypeAlias

from foveacam_server.foundation.schema import ResponseModel


class ProcessDocument(ResponseModel):
    """The server's process; null: not reported by the system.

    `cpu_share`: 1 is one fully used core. `services_opened_s`: since the process began.
    """

    began_utc: str | None
    up_s: float | None
    services_opened_s: float | None
    cores: int
    cpu_share: float | None
    memory_mb: float | None
    open_files: int | None
    open_files_limit: int
    database_mb: float


class ThreadDocument(ResponseModel):
    """Threads of one name; `busiest_share`: largest share of a core of one thread; null: not known (yet)."""

    name: str
    count: int
    cpu_share: float | None
    busiest_share: float | None
    flagged: bool


class EventLoopDocument(ResponseModel):
    """Largest lag of the event loop in the last `window_s`; null: not measured yet."""

    worst_lag_ms: float | None
    window_s: float
    flagged: bool


class HardwareLoadDocument(ResponseModel):
    """The hardware thread: queued commands, and its busy share of the time.

    `busy_share`: null while no rig is open. Waiting for a device counts as busy.
    """

    queue_length: int
    queue_limit: int
    busy_share: float | None
    flagged: bool


class StageDocument(ResponseModel):
    """Times of one stage in the last `window_s`, from its histogram; null: none.

    `queue`: wait of a command for the hardware thread; `request`: any request until its answer began.
    """

    stage: str
    window_s: float
    count: int
    rate_hz: float
    median_ms: float | None
    p99_ms: float | None


class CameraFlowDocument(ResponseModel):
    """Frames of a camera, and those lost by reason since it was started.

    `worst_gap_ms`: longest time between two frames shown, in the last 10 s. `lost_last_minute`: those of all
    reasons, each frame once.
    """

    role: str
    connected: bool
    rate_hz: float
    worst_gap_ms: float | None
    delivered: int
    skipped: int
    dropped: int
    incomplete: int
    late: int
    underrun: int
    lost_last_minute: int
    flagged: bool


class ViewFlowDocument(ResponseModel):
    """Pictures of a view; `dropped`: replaced by a newer picture before the client took them.

    `expected_hz`, `slow_reason`: as of the live views.
    """

    view: str
    rate_hz: float
    expected_hz: float | None
    slow_reason: str | None
    published: int
    repeated: int
    sent: int
    dropped: int


class StartTimeDocument(ResponseModel):
    """One step of the rig's last opening; `after_s`: from the process' beginning to the step's."""

    device: str
    state: str
    after_s: float | None
    duration_s: float | None


PartKind: TypeAlias = Literal["thread", "camera", "device", "view", "clients", "file"]


class PartDocument(ResponseModel):
    """A part of the server with flows in or out; `busy_share` and `waiting` are null where it has none.

    A thread has the name that it has under `threads`, a camera or a view `camera wide`, `view wide`.
    """

    name: str
    kind: PartKind
    busy_share: float | None
    waiting: int | None
    flagged: bool


class EdgeDocument(ResponseModel):
    """The flow from one part to another; rates of the last `flow_window_s`, counts since the process began.

    `mb_per_s`: null where sizes are not counted. `dropped`: items that did not arrive; pictures that slow
    viewers drop are not flagged.
    """

    source: str
    target: str
    items: str
    rate_hz: float
    dropped_hz: float
    mb_per_s: float | None
    count: int
    dropped: int
    flagged: bool


class EngineDocument(ResponseModel):
    """The load of the whole server at one moment; shares are of the last `window_s`."""

    utc: str
    version: str
    window_s: float | None
    process: ProcessDocument
    hardware: HardwareLoadDocument
    event_loop: EventLoopDocument
    threads: list[ThreadDocument]
    stages: list[StageDocument]
    cameras: list[CameraFlowDocument]
    views: list[ViewFlowDocument]
    start: list[StartTimeDocument]
    flow_window_s: float
    parts: list[PartDocument]
    edges: list[EdgeDocument]
