"""How soon people are answered: the first minute, clicks, following, live views, a slow line."""
