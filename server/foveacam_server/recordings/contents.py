"""What an open recording holds, as its documents need it."""

import json
from collections.abc import Mapping

from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import STATISTICS
from foveacam_server.recording_command.information import information_of
from foveacam_server.runtime.store import Document


def contents(recording: Recording) -> Document:
    """Return what an open recording holds, with what its recorder counted where it says so."""
    return {**information_of(recording), "statistics": _statistics(recording.metadata.get(STATISTICS, {}))}


def _statistics(record: Mapping[str, str]) -> Document:
    found = {}
    for stream, text in record.items():
        try:
            counts = json.loads(text)
        except ValueError:
            continue
        if isinstance(counts, dict):
            found[stream] = counts
    return found
