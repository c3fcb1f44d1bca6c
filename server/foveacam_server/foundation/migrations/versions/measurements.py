"""The table of measurements; databases made before they were numbered may have it."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Create the table where it is missing."""
    op.create_table(
        "measurements",
        sa.Column("seq", sa.Integer, primary_key=True),
        sa.Column("id", sa.String(40), nullable=False, unique=True),
        sa.Column("label", sa.String, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        if_not_exists=True,
    )
