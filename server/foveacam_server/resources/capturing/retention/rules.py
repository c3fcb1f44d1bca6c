"""Reads the rules of a data directory, and finds what they would remove."""

import hashlib
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pydantic import ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.names import age_s
from foveacam_server.foundation.plain_words import explain_validation
from foveacam_server.resources.capturing.retention.schema import (
    DueItem,
    RetainedKind,
    RetentionPreview,
    RetentionRule,
    RetentionRules,
)

FILE = "retention.toml"
DAY_S = 86_400.0
GB = 1_000_000_000


class RetainedDocument(Protocol):
    """An item to which the rules apply."""

    @property
    def id(self) -> str:
        """Its id."""
        ...

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def label(self) -> str:
        """Its label; an item with a label is never removed."""
        ...

    @property
    def created_utc(self) -> str | None:
        """When it was made; an item of unknown age is never removed."""
        ...

    @property
    def size_bytes(self) -> int:
        """Its size."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RetentionSource:
    """Source of one kind of items: lists them, knows which are in use, moves one to the trash.

    `for_good`: the kind has no trash, and `remove` deletes.
    """

    every: Callable[[], Sequence[RetainedDocument]]
    in_use: Callable[[str], bool]
    remove: Callable[[str], object]
    for_good: bool = False


Sources = Mapping[RetainedKind, RetentionSource]


class RetainedLooks(Protocol):
    """Lists fixations and clouds of a data directory; which are in use is known of those listed last."""

    def fixations(self) -> Sequence[RetainedDocument]:
        """Return all fixations."""
        ...

    def clouds(self) -> Sequence[RetainedDocument]:
        """Return all clouds."""
        ...

    def is_fixation_in_use(self, fixation_id: str) -> bool:
        """Return whether a fixation is in use."""
        ...

    def is_cloud_in_use(self, cloud_id: str) -> bool:
        """Return whether a cloud is in use."""
        ...


def look_sources(
    looks: RetainedLooks, *, remove_cloud: Callable[[str], object], remove_fixation: Callable[[str], object]
) -> Sources:
    """Return the sources of clouds and fixations, neither of which has a trash."""
    return {
        "clouds": RetentionSource(
            every=looks.clouds, in_use=looks.is_cloud_in_use, remove=remove_cloud, for_good=True
        ),
        "fixations": RetentionSource(
            every=looks.fixations, in_use=looks.is_fixation_in_use, remove=remove_fixation, for_good=True
        ),
    }


def read_rules(data: Path) -> RetentionRules:
    """Return the rules of a data directory, none without its file; raise InvalidInput for a wrong file."""
    path = data / FILE
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return RetentionRules()
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path} cannot be read ({error}); correct it or remove it") from error
    try:
        if set(found) - {"retention"}:
            raise InvalidInput(f"{path}: it has other tables than [retention]; remove them")
        return RetentionRules.model_validate(found.get("retention", {}))
    except ValidationError as error:
        raise InvalidInput(f"{path}: {explain_validation(error.errors()).detail}") from error


def preview(data: Path, sources: Sources) -> RetentionPreview:
    """Return what the rules of a data directory would remove now."""
    rules = read_rules(data)
    items = [item for kind, source in sources.items() for item in _due(kind, source, rules.rule(kind))]
    named = "\n".join(sorted(f"{item.kind} {item.id} {item.size_bytes}" for item in items))
    return RetentionPreview(
        file=str(data / FILE),
        rules=rules,
        items=items,
        size_bytes=sum(item.size_bytes for item in items),
        digest=hashlib.sha256(named.encode()).hexdigest(),
    )


def _due(kind: RetainedKind, source: RetentionSource, rule: RetentionRule) -> list[DueItem]:
    """Return the items of a kind that are too old or beyond its size limit, counted from the newest."""
    if rule.keep_days is None and rule.keep_gb is None:
        return []
    found, counted_bytes = list[DueItem](), 0
    for each in sorted(source.every(), key=lambda one: one.created_utc or "", reverse=True):
        counted_bytes += each.size_bytes
        why = _why(rule, each, counted_bytes)
        if why is None or each.created_utc is None or each.label or source.in_use(each.id):
            continue
        counted_bytes -= each.size_bytes
        found.append(
            DueItem(
                kind=kind,
                id=each.id,
                name=each.name,
                created_utc=each.created_utc,
                size_bytes=each.size_bytes,
                why=why,
                for_good=source.for_good,
            )
        )
    return found


def _why(rule: RetentionRule, each: RetainedDocument, counted_bytes: int) -> str | None:
    oldest_s = None if rule.keep_days is None else rule.keep_days * DAY_S
    if each.created_utc is not None and oldest_s is not None and age_s(each.created_utc) > oldest_s:
        return f"older than {rule.keep_days:g} days"
    if rule.keep_gb is not None and counted_bytes > rule.keep_gb * GB:
        return f"beyond the newest {rule.keep_gb:g} GB"
    return None
