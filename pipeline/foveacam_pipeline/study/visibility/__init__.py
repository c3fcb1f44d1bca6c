"""Observing targets without being noticed (Sec. 4.4): formulas, maps, regions, Fig. 8."""
