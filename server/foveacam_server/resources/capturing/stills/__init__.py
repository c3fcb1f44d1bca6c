"""Stills: taken where the mirrors point, held until they are saved or discarded."""
