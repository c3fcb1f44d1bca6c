"""Mosaics made of captures, in processes of their own."""
