"""The changes of the database, one file each, chained by `down_revision`."""
