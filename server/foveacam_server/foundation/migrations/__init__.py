"""Alembic migrations of the database: `env.py` runs them, `versions/` holds one file a change."""
