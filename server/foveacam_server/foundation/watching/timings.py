"""Histograms of the durations of stages in this process, for `/metrics`."""

from prometheus_client import CollectorRegistry, Histogram

REGISTRY = CollectorRegistry(auto_describe=False)
_STAGES = Histogram(
    "foveacam_stage_seconds",
    "Time of one part of the work.",
    ["stage"],
    buckets=(0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0),
    registry=REGISTRY,
)
REQUEST = Histogram(
    "foveacam_request_seconds",
    "Time until a request was answered or its stream began.",
    ["method", "route", "status"],
    buckets=(0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0),
    registry=REGISTRY,
)

QUEUE = _STAGES.labels("queue")
"""Wait of a command for the hardware thread."""
LOOK = _STAGES.labels("look")
"""A look: both mirrors moved and settled, both foveae exposed and read."""
VERGE = _STAGES.labels("verge")
"""A fixation, from its start on the rig to its answer."""
DEPTH = _STAGES.labels("depth")
"""The disparities of a fixation's pair by the backend in use."""
ENCODE = _STAGES.labels("encode")
"""One picture as JPEG."""
