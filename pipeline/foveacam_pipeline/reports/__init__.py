"""Shared parts of HTML reports: base template, style and macros."""
