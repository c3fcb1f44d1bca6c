"""Batches on a Dask cluster of this machine: equal bytes, lost workers, speed, overhead, memory."""
