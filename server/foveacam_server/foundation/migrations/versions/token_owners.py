"""The user on whose authority a token of a service exists."""

import logging

import sqlalchemy as sa
from alembic import op

_log = logging.getLogger(__name__)

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the owner; a token made by a user, or by a token of a user, gets that user."""
    op.add_column("service_tokens", sa.Column("owner", sa.String))
    op.execute("UPDATE service_tokens SET owner = created_by WHERE created_by IN (SELECT name FROM users)")
    op.execute(
        "UPDATE service_tokens SET owner = (SELECT maker.owner FROM service_tokens AS maker"
        " WHERE maker.name = service_tokens.created_by) WHERE owner IS NULL"
    )
    left = op.get_bind().exec_driver_sql(
        "SELECT name, created_by FROM service_tokens WHERE owner IS NULL"
        " AND created_by NOT IN ('this machine', 'the shared token')"
        " AND created_by NOT IN (SELECT name FROM service_tokens)"
    )
    for name, maker in left:
        _log.warning(
            "the token %s was made by %s, who is no user any more; revoke it unless it is needed", name, maker
        )
