"""A database that takes no more, as on a full disk."""

from foveacam_server.foundation.store import Store

ANY_SIZE = 1_073_741_823


def limit_database_pages(store: Store, most: int) -> None:
    """Let the database grow to so many pages and no further; 1: no more than it has."""
    with store.session() as session:
        session.connection().exec_driver_sql(f"PRAGMA max_page_count={most}")
