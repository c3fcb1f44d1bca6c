"""The user on whose authority a token of a service exists."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the owner; tokens that a user made, or a token of that user, get that user."""
    op.add_column("service_tokens", sa.Column("owner", sa.String))
    op.execute("UPDATE service_tokens SET owner = created_by WHERE created_by IN (SELECT name FROM users)")
    op.execute(
        "UPDATE service_tokens SET owner = (SELECT maker.owner FROM service_tokens AS maker"
        " WHERE maker.name = service_tokens.created_by) WHERE owner IS NULL"
    )
