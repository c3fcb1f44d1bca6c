"""Stores measurements as rows of the database until they are removed."""

from sqlalchemy import String, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import SchemaColumn, Store, TableRow
from foveacam_server.resources.looking.measurements.schema import MeasurementDocument


class MeasurementRow(TableRow):
    """Row of a measurement; `document` is REST's, except for the label."""

    __tablename__ = "measurements"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    label: Mapped[str]
    document: Mapped[MeasurementDocument] = mapped_column(SchemaColumn(MeasurementDocument))


class MeasurementTable:
    """Reads and writes the rows."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def next_number(self) -> int:
        """Return the number after that of the newest row."""
        query = select(MeasurementRow.seq).order_by(MeasurementRow.seq.desc()).limit(1)
        with self._store.session() as session:
            return (session.scalars(query).first() or 0) + 1

    def add(self, document: MeasurementDocument) -> None:
        """Add a row."""
        row = MeasurementRow(id=document.id, label=document.label, document=document)
        with self._store.session() as session:
            session.add(row)

    def every(self) -> list[MeasurementDocument]:
        """Return all, newest first."""
        with self._store.session() as session:
            rows = session.scalars(select(MeasurementRow).order_by(MeasurementRow.seq.desc()))
            return [_document(row) for row in rows]

    def get(self, measurement_id: str) -> MeasurementDocument:
        """Return a measurement or raise NotFound."""
        with self._store.session() as session:
            return _document(_row(session, measurement_id))

    def rename(self, measurement_id: str, label: str) -> MeasurementDocument:
        """Rename a measurement or raise NotFound."""
        with self._store.session() as session:
            row = _row(session, measurement_id)
            row.label = label
            return _document(row)

    def remove(self, measurement_id: str) -> MeasurementDocument:
        """Remove a measurement and return it, or raise NotFound."""
        with self._store.session() as session:
            row = _row(session, measurement_id)
            session.delete(row)
            return _document(row)


def _document(row: MeasurementRow) -> MeasurementDocument:
    return row.document.model_copy(update={"label": row.label})


def _row(session: Session, measurement_id: str) -> MeasurementRow:
    row = session.scalars(select(MeasurementRow).where(MeasurementRow.id == measurement_id)).one_or_none()
    if row is None:
        raise NotFound(
            f"there is no measurement {measurement_id}; see /api/v1/measurements", asked=measurement_id
        )
    return row
