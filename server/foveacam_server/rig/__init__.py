"""The one rig of this server: its thread, status, live views, streams and the stop. Knows no resource."""
