"""Reads and writes fixations and targets as rows of the database."""

from dataclasses import dataclass

from pydantic import BaseModel
from sqlalchemy import ScalarSelect, Select, String, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import SchemaColumn, Store, TableRow
from foveacam_server.resources.looking.clouds.collection import CloudRow
from foveacam_server.resources.looking.fixations.schema import CorrectionDocument, FixationDocument


class FixationRow(TableRow):
    """Row of a fixation; `document` is REST's, without the ids of target and cloud.

    `cloud_id`: written by earlier versions only; now the cloud's row names its fixation.
    """

    __tablename__ = "fixations"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    job_id: Mapped[str] = mapped_column(index=True)
    target_id: Mapped[str | None]
    cloud_id: Mapped[str | None]
    document: Mapped[FixationDocument] = mapped_column(SchemaColumn(FixationDocument))


class TargetRecord(BaseModel):
    """The stored document of a target; documents of earlier versions repeat the fixation's fields."""

    fixation_id: str
    corrections: list[CorrectionDocument] = []
    created_utc: str


class TargetRow(TableRow):
    """Row of a target: a point that was fixated."""

    __tablename__ = "targets"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    label: Mapped[str]
    document: Mapped[TargetRecord] = mapped_column(SchemaColumn(TargetRecord))


@dataclass(frozen=True, slots=True, kw_only=True)
class FixatedTarget:
    """A labelled point with the fixation that measured it last; `corrections`: oldest first."""

    id: str
    label: str
    created_utc: str
    fixation: FixationDocument
    corrections: tuple[CorrectionDocument, ...] = ()


class FixationTable:
    """All fixations that ended with an answer, until the rules of retention remove them."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, fixation: FixationDocument) -> None:
        """Add a fixation."""
        with self._store.session() as session:
            session.add(
                FixationRow(
                    id=fixation.id,
                    job_id=fixation.job_id,
                    target_id=fixation.target_id,
                    document=fixation,
                )
            )

    def choose(self, fixation_id: str, alternative: int) -> FixationDocument:
        """Store the index of the chosen alternative; return the fixation, or raise `NotFound`."""
        with self._store.session() as session:
            row, cloud_id = _fixation_row(session, fixation_id)
            row.document = row.document.model_copy(update={"chosen_alternative": alternative})
            return _fixation(row, cloud_id)

    def get(self, fixation_id: str) -> FixationDocument:
        """Return a fixation by its id or raise `NotFound`."""
        with self._store.session() as session:
            return _fixation(*_fixation_row(session, fixation_id))

    def remove(self, fixation_id: str) -> None:
        """Delete a fixation, or raise `NotFound`."""
        with self._store.session() as session:
            session.delete(_fixation_row(session, fixation_id)[0])

    def newest(self, limit: int) -> list[FixationDocument]:
        """Return the newest fixations, newest first."""
        with self._store.session() as session:
            rows = session.execute(_fixations().order_by(FixationRow.seq.desc()).limit(limit))
            return [_fixation(*row) for row in rows]


class TargetTable:
    """Points that were looked at, until somebody removes them."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def put(self, target: FixatedTarget) -> bool:
        """Add or replace a target; return whether it is new.

        An existing one keeps label and time of creation.
        """
        record = TargetRecord(
            fixation_id=target.fixation.id,
            corrections=list(target.corrections),
            created_utc=target.created_utc,
        )
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == target.id)).one_or_none()
            if row is not None:
                row.document = record.model_copy(update={"created_utc": row.document.created_utc})
                return False
            session.add(TargetRow(id=target.id, label=target.label, document=record))
            return True

    def next_label(self) -> str:
        """Return the default label of the next target: `Target` and the number after the newest's."""
        with self._store.session() as session:
            newest = session.scalars(select(TargetRow.seq).order_by(TargetRow.seq.desc()).limit(1)).first()
        return f"Target {(newest or 0) + 1}"

    def rename(self, target_id: str, label: str) -> FixatedTarget:
        """Give a target another label."""
        with self._store.session() as session:
            row, fixation, cloud_id = _target_rows(session, target_id)
            row.label = label
            return _target(row, fixation, cloud_id)

    def remove(self, target_id: str) -> FixatedTarget:
        """Delete a target; return what it was."""
        with self._store.session() as session:
            row, fixation, cloud_id = _target_rows(session, target_id)
            session.delete(row)
            return _target(row, fixation, cloud_id)

    def remove_of(self, fixation_id: str) -> FixatedTarget | None:
        """Delete the target that shows a fixation; return what it was."""
        shown = self.showing(fixation_id)
        return None if shown is None else self.remove(shown.id)

    def get(self, target_id: str) -> FixatedTarget:
        """Return a target by its id or raise `NotFound`."""
        with self._store.session() as session:
            return _target(*_target_rows(session, target_id))

    def find(self, target_id: str) -> FixatedTarget | None:
        """Return a target by its id; None when there is none."""
        try:
            return self.get(target_id)
        except NotFound:
            return None

    def showing(self, fixation_id: str) -> FixatedTarget | None:
        """Return the target whose newest fixation this is; None without one."""
        with self._store.session() as session:
            rows = session.execute(_targets().where(FixationRow.id == fixation_id)).first()
            return None if rows is None else _target(*rows)

    def every(self) -> list[FixatedTarget]:
        """Return all targets, oldest first."""
        with self._store.session() as session:
            rows = session.execute(_targets().order_by(TargetRow.seq))
            return [_target(*row) for row in rows]


def newest_cloud_id() -> ScalarSelect[str | None]:
    """Return the id of a fixation's newest cloud as a column of a query."""
    clouds = select(CloudRow.id).where(CloudRow.fixation_id == FixationRow.id)
    return clouds.order_by(CloudRow.seq.desc()).limit(1).scalar_subquery()


def _fixations() -> Select[FixationRow, str | None]:
    return select(FixationRow, newest_cloud_id())


def _targets() -> Select[TargetRow, FixationRow, str | None]:
    held = func.json_extract(TargetRow.document, "$.fixation_id")
    return select(TargetRow, FixationRow, newest_cloud_id()).join(FixationRow, FixationRow.id == held)


def _fixation(row: FixationRow, cloud_id: str | None) -> FixationDocument:
    return row.document.model_copy(update={"target_id": row.target_id, "cloud_id": cloud_id})


def _target(row: TargetRow, fixation: FixationRow, cloud_id: str | None) -> FixatedTarget:
    return FixatedTarget(
        id=row.id,
        label=row.label,
        created_utc=row.document.created_utc,
        fixation=_fixation(fixation, cloud_id),
        corrections=tuple(row.document.corrections),
    )


def _fixation_row(session: Session, fixation_id: str) -> tuple[FixationRow, str | None]:
    row = session.execute(_fixations().where(FixationRow.id == fixation_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no fixation {fixation_id}; see /api/v1/fixations", asked=fixation_id)
    return row


def _target_rows(session: Session, target_id: str) -> tuple[TargetRow, FixationRow, str | None]:
    rows = session.execute(_targets().where(TargetRow.id == target_id)).one_or_none()
    if rows is None:
        raise NotFound(f"there is no target {target_id}; see /api/v1/targets", asked=target_id)
    return rows
