"""One module a device family, speaking through `wire` or a vendor library opened in `connect`."""
