"""Fixations and clouds as items of the retention rules: labels, ages, sizes, and whether in use."""

import re
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from sqlalchemy import String, cast, func, select
from sqlalchemy.orm import Session

from foveacam_server.foundation.job_table import JobState
from foveacam_server.foundation.names import age_s
from foveacam_server.foundation.store import JobRow
from foveacam_server.resources.looking.clouds.collection import CloudRow
from foveacam_server.resources.looking.fixations.table import FixationRow, TargetRow, newest_cloud_id

SHAPE_S = 600.0
"""Time after a fixation during which its cloud may still be computed."""
_NUMBERED = re.compile(r"Target \d+")
"""Matches a label that the server assigned."""


class Sessions(Protocol):
    """Opens sessions of the database."""

    def session(self) -> AbstractContextManager[Session]:
        """Open a session of the database."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RetainedLook:
    """A fixation, or its cloud.

    `label`: given by a person or a service; empty for one assigned by the server.
    """

    id: str
    name: str
    label: str
    created_utc: str
    size_bytes: int


class RetainedLooks:
    """Reads the fixations and clouds of a data directory; changes nothing.

    The same reads find out which are in use, for all at once: there may be tens of thousands.
    """

    def __init__(self, sessions: Sessions, clouds: Path) -> None:
        self._sessions, self._clouds = sessions, clouds
        self._fixations_in_use, self._clouds_in_use = frozenset[str](), frozenset[str]()

    def fixations(self) -> list[RetainedLook]:
        """Return all fixations, with the bytes of their rows.

        In use are the newest, those that have a cloud or may get one, and those that an open job names.
        """
        with self._sessions.session() as session:
            found = _fixations(session)
        newest = max(found, key=lambda each: each.seq, default=None)
        self._fixations_in_use = frozenset(
            each.id
            for each in found
            if each is newest or each.in_job or each.cloud_id is not None or age_s(each.created_utc) < SHAPE_S
        )
        return [_look(each.id, each, each.created_utc, size_bytes=each.size_bytes) for each in found]

    def clouds(self) -> list[RetainedLook]:
        """Return all clouds, with the bytes of their files.

        In use are the newest, and those whose fixation an open job names.
        """
        created = func.json_extract(CloudRow.document, "$.created_utc")
        with self._sessions.session() as session:
            by_id = {each.id: each for each in _fixations(session)}
            query = select(CloudRow.id, CloudRow.fixation_id, created).order_by(CloudRow.seq.desc())
            rows = [(row[0], by_id.get(row[1]), row[2]) for row in session.execute(query)]
        in_job = {row_id for row_id, fixation, _ in rows if fixation is not None and fixation.in_job}
        self._clouds_in_use = frozenset(in_job | {row_id for row_id, _, _ in rows[:1]})
        return [
            _look(row_id, fixation, utc, size_bytes=_bytes_of(self._clouds / row_id))
            for row_id, fixation, utc in rows
        ]

    def is_fixation_in_use(self, fixation_id: str) -> bool:
        """Return whether a fixation was in use at the last call of `fixations`."""
        return fixation_id in self._fixations_in_use

    def is_cloud_in_use(self, cloud_id: str) -> bool:
        """Return whether a cloud was in use at the last call of `clouds`."""
        return cloud_id in self._clouds_in_use


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fixation:
    """Columns of a fixation's row. `name`: its target's or request's; `in_job`: an open job names it."""

    id: str
    seq: int
    cloud_id: str | None
    created_utc: str
    size_bytes: int
    name: str
    in_job: bool


def _fixations(session: Session) -> list[_Fixation]:
    labels = {row[0]: row[1] for row in session.execute(select(TargetRow.id, TargetRow.label))}
    is_open = JobRow.state.in_([state.value for state in JobState if not state.ended])
    requests = "\n".join(session.scalars(select(cast(JobRow.request, String)).where(is_open)))
    document, row = FixationRow.document, FixationRow
    created, label = (func.json_extract(document, f"$.{name}") for name in ("created_utc", "request.label"))
    query = select(row.id, row.seq, newest_cloud_id(), created, func.length(document), row.target_id, label)
    return [
        _Fixation(
            id=row_id,
            seq=seq,
            cloud_id=cloud_id,
            created_utc=utc,
            size_bytes=size_bytes,
            name=labels.get(target_id) or asked or "",
            in_job=row_id in requests or (target_id is not None and target_id in requests),
        )
        for row_id, seq, cloud_id, utc, size_bytes, target_id, asked in session.execute(query)
    ]


def _look(row_id: str, fixation: _Fixation | None, created_utc: str, *, size_bytes: int) -> RetainedLook:
    name = "" if fixation is None else fixation.name
    return RetainedLook(
        id=row_id,
        name=name or row_id,
        label="" if _NUMBERED.fullmatch(name) else name,
        created_utc=created_utc,
        size_bytes=size_bytes,
    )


def _bytes_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.glob("*"))
