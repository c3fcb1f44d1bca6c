"""Target localisation (Fig. 4, Sec. 4.1): a figurine on an infinity-shaped rail, seen by both pairs."""
