"""Tests of captures and what is made of them, by REST."""
