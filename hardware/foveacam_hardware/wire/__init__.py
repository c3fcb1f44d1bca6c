"""Links, framing, codecs: bytes in and out. The only importer of `serial`."""
