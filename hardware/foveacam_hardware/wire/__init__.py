"""Serial links, framing and codecs. The only importer of `serial`."""
