"""Response times: the first minute, clicks, following, live views, a slow line."""
