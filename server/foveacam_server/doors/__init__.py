"""The HTTP server: limits of bodies, connections and threads; middleware; a fast path of the stop; TLS."""
