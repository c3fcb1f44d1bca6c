"""Stores the loop's settings, and translates them between the pipeline and REST."""

import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from foveacam_pipeline.continuous_loop.settings import Gains, LoopSettings
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_pipeline.track.image_tracker import TrackerKind
from foveacam_server.resources.looking.loop.schema import (
    LoopGains,
    LoopSettingsDocument,
    LoopSettingsGroup,
    LoopSettingsPatch,
)

_log = logging.getLogger(__name__)

FILE = "settings.json"
OFF = "off"
NULLABLE = frozenset({"correct_for_ms", "most_hz"})
"""Settings for which null is a value; for the others null means unchanged."""
GROUPS: dict[LoopSettingsGroup, tuple[str, ...]] = {
    "pan": ("pan",),
    "depth": ("depth",),
    "vertical": ("vertical",),
    "match": ("template_scale", "min_score", "expand_x", "expand_y"),
    "timing": ("sensitivity", "correct_for_ms", "most_hz"),
    "tracker": ("tracker", "box_width_px", "box_height_px"),
    "prediction": ("predict", "lead_ms"),
}


def describe_settings(settings: LoopSettings) -> LoopSettingsDocument:
    """Return REST's document of settings."""
    return LoopSettingsDocument(
        sensitivity=settings.sensitivity,
        template_scale=settings.template_scale,
        min_score=settings.min_score,
        correct_for_ms=settings.correct_for_ms,
        expand_x=settings.expand_x,
        expand_y=settings.expand_y,
        pan=_described(settings.pan),
        depth=_described(settings.depth),
        vertical=_described(settings.vertical),
        tracker="off" if settings.tracker is None else settings.tracker.value,
        box_width_px=settings.box_width_px,
        box_height_px=settings.box_height_px,
        predict=settings.predict,
        lead_ms=settings.lead_ms,
        most_hz=settings.most_hz,
    )


def patched(settings: LoopSettings, patch: LoopSettingsPatch) -> LoopSettings:
    """Return settings with a request's changes; raise `InvalidInput` for a value out of its bounds."""
    changes: dict[str, Any] = {}  # Any: the values of a dataclass
    for name in patch.model_fields_set:
        value = getattr(patch, name)
        if value is None and name not in NULLABLE:
            continue
        changes[name] = _value(value)
    return replace(settings, **changes)


def with_defaults(settings: LoopSettings, group: LoopSettingsGroup | None) -> LoopSettings:
    """Return settings with one group, or all, at their defaults."""
    groups = get_args(LoopSettingsGroup) if group is None else (group,)
    defaults = LoopSettings()
    return replace(settings, **{name: getattr(defaults, name) for one in groups for name in GROUPS[one]})


def load_settings(folder: Path) -> LoopSettings:
    """Return the stored settings; the defaults where none are stored or they cannot be read."""
    try:
        patch = LoopSettingsPatch.model_validate_json((folder / FILE).read_bytes())
    except FileNotFoundError:
        return LoopSettings()
    except (OSError, ValidationError) as error:
        _log.warning("the loop begins with its default settings: %s cannot be read (%s)", FILE, error)
        return LoopSettings()
    return patched(LoopSettings(), patch)


def store_settings(folder: Path, settings: LoopSettings) -> None:
    """Write settings; raise `StorageFull` when the disk is full."""
    content = json.dumps(describe_settings(settings).as_json(), indent=1).encode()
    with disk_errors("the settings of the loop", folder):
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / FILE, content)


def _described(gains: Gains) -> LoopGains:
    return LoopGains(kp=gains.kp, ki=gains.ki, kd=gains.kd)


def _value(value: object) -> object:
    """Return a request's value in the pipeline's type."""
    if isinstance(value, LoopGains):
        return Gains(kp=value.kp, ki=value.ki, kd=value.kd)
    if isinstance(value, str):
        return None if value == OFF else TrackerKind(value)
    return value
