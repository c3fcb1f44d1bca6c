"""Reads and writes fixations and targets as rows of the database."""

from sqlalchemy import String, select, update
from sqlalchemy.orm import Mapped, Session, mapped_column

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import SchemaColumn, Store, TableRow
from foveacam_server.resources.looking.fixations.schema import FixationDocument, TargetDocument


class FixationRow(TableRow):
    """A fixation; `document` is what REST shows, without the ids that are set later."""

    __tablename__ = "fixations"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    job_id: Mapped[str] = mapped_column(index=True)
    target_id: Mapped[str | None]
    cloud_id: Mapped[str | None]
    document: Mapped[FixationDocument] = mapped_column(SchemaColumn(FixationDocument))


class TargetRow(TableRow):
    """A target: a point that was fixated; `document` is what REST shows, but for its label."""

    __tablename__ = "targets"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    label: Mapped[str]
    document: Mapped[TargetDocument] = mapped_column(SchemaColumn(TargetDocument))


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
                    cloud_id=fixation.cloud_id,
                    document=fixation,
                )
            )

    def set_cloud(self, fixation_id: str, cloud_id: str | None) -> None:
        """Set the cloud of a fixation."""
        with self._store.session() as session:
            query = update(FixationRow).where(FixationRow.id == fixation_id)
            session.execute(query.values(cloud_id=cloud_id))

    def choose(self, fixation_id: str, alternative: int) -> FixationDocument:
        """Set which alternative was chosen; return the fixation, or raise `NotFound`."""
        with self._store.session() as session:
            row = _fixation_row(session, fixation_id)
            row.document = row.document.model_copy(update={"chosen_alternative": alternative})
            return _fixation(row)

    def get(self, fixation_id: str) -> FixationDocument:
        """Return a fixation by its id or raise `NotFound`."""
        with self._store.session() as session:
            return _fixation(_fixation_row(session, fixation_id))

    def remove(self, fixation_id: str) -> FixationDocument:
        """Delete a fixation, or raise `NotFound`; return what it was."""
        with self._store.session() as session:
            row = _fixation_row(session, fixation_id)
            session.delete(row)
            return _fixation(row)

    def newest(self, limit: int) -> list[FixationDocument]:
        """Return the newest fixations, newest first."""
        with self._store.session() as session:
            rows = session.scalars(select(FixationRow).order_by(FixationRow.seq.desc()).limit(limit))
            return [_fixation(row) for row in rows]


class TargetTable:
    """Points that were looked at, until somebody removes them."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def put(self, target: TargetDocument) -> bool:
        """Add or replace a target; return whether it is new. A known one keeps its label."""
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == target.id)).one_or_none()
            if row is not None:
                row.document = target.model_copy(update={"created_utc": row.document.created_utc})
                return False
            session.add(TargetRow(id=target.id, label=target.label, document=target))
            return True

    def next_label(self) -> str:
        """Return the label of a target that was given none: the number after the newest's."""
        with self._store.session() as session:
            newest = session.scalars(select(TargetRow.seq).order_by(TargetRow.seq.desc()).limit(1)).first()
        return f"Target {(newest or 0) + 1}"

    def set_cloud(self, fixation_id: str, cloud_id: str | None) -> TargetDocument | None:
        """Set the cloud of the target that a fixation produced; return that target."""
        with self._store.session() as session:
            for row in session.scalars(select(TargetRow)):
                if row.document.fixation_id == fixation_id:
                    row.document = row.document.model_copy(update={"cloud_id": cloud_id})
                    return _target(row)
        return None

    def rename(self, target_id: str, label: str) -> TargetDocument:
        """Give a target another label."""
        with self._store.session() as session:
            row = _target_row(session, target_id)
            row.label = label
            return _target(row)

    def remove(self, target_id: str) -> TargetDocument:
        """Delete a target; return what it was."""
        with self._store.session() as session:
            row = _target_row(session, target_id)
            session.delete(row)
            return _target(row)

    def remove_of(self, fixation: FixationDocument) -> TargetDocument | None:
        """Delete the target that shows a fixation; return what it was."""
        found = None if fixation.target_id is None else self.find(fixation.target_id)
        return self.remove(found.id) if found is not None and found.fixation_id == fixation.id else None

    def get(self, target_id: str) -> TargetDocument:
        """Return a target by its id or raise `NotFound`."""
        with self._store.session() as session:
            return _target(_target_row(session, target_id))

    def find(self, target_id: str) -> TargetDocument | None:
        """Return a target by its id; None when there is none."""
        try:
            return self.get(target_id)
        except NotFound:
            return None

    def every(self) -> list[TargetDocument]:
        """Return all targets, oldest first."""
        with self._store.session() as session:
            return [_target(row) for row in session.scalars(select(TargetRow).order_by(TargetRow.seq))]


def _fixation(row: FixationRow) -> FixationDocument:
    return row.document.model_copy(update={"target_id": row.target_id, "cloud_id": row.cloud_id})


def _target(row: TargetRow) -> TargetDocument:
    return row.document.model_copy(update={"label": row.label})


def _fixation_row(session: Session, fixation_id: str) -> FixationRow:
    row = session.scalars(select(FixationRow).where(FixationRow.id == fixation_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no fixation {fixation_id}; see /api/v1/fixations", asked=fixation_id)
    return row


def _target_row(session: Session, target_id: str) -> TargetRow:
    row = session.scalars(select(TargetRow).where(TargetRow.id == target_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no target {target_id}; see /api/v1/targets", asked=target_id)
    return row
