"""Requests from outsiders: how the server and its stop behave under load and misuse."""
