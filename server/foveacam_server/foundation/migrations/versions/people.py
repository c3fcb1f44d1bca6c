"""The tables of users, sign-ins, tokens of services and the audit log."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "users",
        sa.Column("name", sa.String(64), primary_key=True),
        sa.Column("role", sa.String, nullable=False),
        sa.Column("password_hash", sa.String),
        sa.Column("disabled", sa.Boolean, nullable=False),
        sa.Column("created_utc", sa.String, nullable=False),
        sa.Column("last_seen_utc", sa.String),
        sa.Column("invitation_hash", sa.String),
        sa.Column("invitation_until_utc", sa.String),
    )
    op.create_table(
        "sign_ins",
        sa.Column("id", sa.String(40), primary_key=True),
        sa.Column("secret_hash", sa.String, nullable=False, unique=True),
        sa.Column("user", sa.String, nullable=False, index=True),
        sa.Column("address", sa.String, nullable=False),
        sa.Column("browser", sa.String, nullable=False),
        sa.Column("created_utc", sa.String, nullable=False),
        sa.Column("last_seen_utc", sa.String, nullable=False),
        sa.Column("expires_utc", sa.String, nullable=False),
    )
    op.create_table(
        "service_tokens",
        sa.Column("id", sa.String(40), primary_key=True),
        sa.Column("name", sa.String, nullable=False, unique=True),
        sa.Column("prefix", sa.String, nullable=False),
        sa.Column("secret_hash", sa.String, nullable=False, unique=True),
        sa.Column("scopes", sa.JSON, nullable=False),
        sa.Column("created_by", sa.String, nullable=False),
        sa.Column("created_utc", sa.String, nullable=False),
        sa.Column("expires_utc", sa.String),
        sa.Column("last_used_utc", sa.String),
    )
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("utc", sa.String, nullable=False),
        sa.Column("who", sa.String, nullable=False, index=True),
        sa.Column("kind", sa.String, nullable=False),
        sa.Column("method", sa.String, nullable=False),
        sa.Column("path", sa.String, nullable=False),
        sa.Column("what", sa.String, nullable=False),
        sa.Column("address", sa.String, nullable=False),
        sa.Column("status", sa.Integer, nullable=False),
        sa.Column("outcome", sa.String, nullable=False),
        sa.Column("repeated", sa.Integer, nullable=False),
        sa.Column("detail", sa.String, nullable=False),
    )
