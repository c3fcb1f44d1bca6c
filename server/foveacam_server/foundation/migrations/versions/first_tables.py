"""Tables of the first version: jobs, events, fixations, targets and clouds."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Create the tables."""
    _create_jobs_and_events()
    _create_fixations_and_targets()
    op.create_table(
        "clouds",
        sa.Column("seq", sa.Integer, primary_key=True),
        sa.Column("id", sa.String(40), nullable=False, unique=True),
        sa.Column("fixation_id", sa.String, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
    )
    op.create_index("ix_clouds_fixation_id", "clouds", ["fixation_id"])


def _create_jobs_and_events() -> None:
    op.create_table(
        "jobs",
        sa.Column("seq", sa.Integer, primary_key=True),
        sa.Column("id", sa.String(40), nullable=False, unique=True),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("state", sa.String, nullable=False),
        sa.Column("request", sa.JSON, nullable=False),
        sa.Column("created_utc", sa.String, nullable=False),
        sa.Column("started_utc", sa.String),
        sa.Column("ended_utc", sa.String),
        sa.Column("done", sa.Integer, nullable=False),
        sa.Column("total", sa.Integer, nullable=False),
        sa.Column("note", sa.String, nullable=False),
        sa.Column("result_url", sa.String),
        sa.Column("problem", sa.JSON),
        sa.Column("idempotency_key", sa.String(200), unique=True),
    )
    op.create_index("ix_jobs_state", "jobs", ["state"])
    op.create_table(
        "events",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
    )
    op.create_index("events_by_kind", "events", ["kind", "id"])


def _create_fixations_and_targets() -> None:
    op.create_table(
        "fixations",
        sa.Column("seq", sa.Integer, primary_key=True),
        sa.Column("id", sa.String(40), nullable=False, unique=True),
        sa.Column("job_id", sa.String, nullable=False),
        sa.Column("target_id", sa.String),
        sa.Column("cloud_id", sa.String),
        sa.Column("document", sa.JSON, nullable=False),
    )
    op.create_index("ix_fixations_job_id", "fixations", ["job_id"])
    op.create_table(
        "targets",
        sa.Column("seq", sa.Integer, primary_key=True),
        sa.Column("id", sa.String(40), nullable=False, unique=True),
        sa.Column("label", sa.String, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
    )
