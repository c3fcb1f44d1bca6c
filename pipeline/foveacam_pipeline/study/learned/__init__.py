"""Sec. 5 of the paper: Table 3 and Fig. 12, on simulated pairs with truth."""
