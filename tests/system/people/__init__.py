"""Tests of users, rights and upgrades on a whole server."""
