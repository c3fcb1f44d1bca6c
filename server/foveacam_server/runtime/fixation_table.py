"""Fixations and targets as rows."""

from sqlalchemy import select, update

from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document, FixationRow, Store, TargetRow


class FixationTable:
    """Answered fixations, for good."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, document: Document) -> None:
        """Write one down."""
        with self._store.session() as session:
            session.add(
                FixationRow(
                    id=document["id"],
                    job_id=document["job_id"],
                    target_id=document["target_id"],
                    cloud_id=document["cloud_id"],
                    document=document,
                )
            )

    def set_cloud(self, fixation_id: str, cloud_id: str | None) -> None:
        """Write down which cloud belongs to a fixation."""
        with self._store.session() as session:
            query = update(FixationRow).where(FixationRow.id == fixation_id)
            session.execute(query.values(cloud_id=cloud_id))

    def choose(self, fixation_id: str, alternative: int) -> Document:
        """Write down which alternative was chosen; return the fixation, or raise `NotFound`."""
        with self._store.session() as session:
            row = session.scalars(select(FixationRow).where(FixationRow.id == fixation_id)).one_or_none()
            if row is None:
                raise _no_fixation(fixation_id)
            row.document = {**row.document, "chosen_alternative": alternative}
            return _fixation(row)

    def get(self, fixation_id: str) -> Document:
        """Return one or raise `NotFound`."""
        with self._store.session() as session:
            row = session.scalars(select(FixationRow).where(FixationRow.id == fixation_id)).one_or_none()
        if row is None:
            raise _no_fixation(fixation_id)
        return _fixation(row)

    def newest(self, limit: int) -> list[Document]:
        """Return the newest, newest first."""
        with self._store.session() as session:
            rows = session.scalars(select(FixationRow).order_by(FixationRow.seq.desc()).limit(limit))
            return [_fixation(row) for row in rows]


class TargetTable:
    """Points that were looked at and kept until somebody removes them."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def put(self, document: Document) -> bool:
        """Write a target down; tell whether it is a new one. The label of a known one stays."""
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == document["id"])).one_or_none()
            if row is not None:
                row.document = {**document, "created_utc": row.document["created_utc"]}
                return False
            session.add(TargetRow(id=document["id"], label=document["label"], document=document))
            return True

    def next_label(self) -> str:
        """Return the label for a target that got none: the number after the newest's."""
        with self._store.session() as session:
            newest = session.scalars(select(TargetRow.seq).order_by(TargetRow.seq.desc()).limit(1)).first()
        return f"Target {(newest or 0) + 1}"

    def set_cloud(self, fixation_id: str, cloud_id: str | None) -> Document | None:
        """Write the cloud of a fixation down at the target that came of it; return that target."""
        with self._store.session() as session:
            for row in session.scalars(select(TargetRow)):
                if row.document["fixation_id"] == fixation_id:
                    row.document = {**row.document, "cloud_id": cloud_id}
                    return _target(row)
        return None

    def rename(self, target_id: str, label: str) -> Document:
        """Give a target another label."""
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == target_id)).one_or_none()
            if row is None:
                raise _no_target(target_id)
            row.label = label
            return _target(row)

    def remove(self, target_id: str) -> Document:
        """Forget a target; return what it was."""
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == target_id)).one_or_none()
            if row is None:
                raise _no_target(target_id)
            session.delete(row)
            return _target(row)

    def get(self, target_id: str) -> Document:
        """Return one or raise `NotFound`."""
        with self._store.session() as session:
            row = session.scalars(select(TargetRow).where(TargetRow.id == target_id)).one_or_none()
        if row is None:
            raise _no_target(target_id)
        return _target(row)

    def find(self, target_id: str) -> Document | None:
        """Return one; None when it was removed or never was."""
        try:
            return self.get(target_id)
        except NotFound:
            return None

    def every(self) -> list[Document]:
        """Return all targets, oldest first."""
        with self._store.session() as session:
            return [_target(row) for row in session.scalars(select(TargetRow).order_by(TargetRow.seq))]


def _fixation(row: FixationRow) -> Document:
    return {**row.document, "target_id": row.target_id, "cloud_id": row.cloud_id}


def _target(row: TargetRow) -> Document:
    return {**row.document, "label": row.label}


def _no_fixation(fixation_id: str) -> NotFound:
    return NotFound(f"there is no fixation {fixation_id}; see /api/v1/fixations", asked=fixation_id)


def _no_target(target_id: str) -> NotFound:
    return NotFound(f"there is no target {target_id}; see /api/v1/targets", asked=target_id)
