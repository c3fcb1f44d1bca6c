"""Work in many independent parts: in processes of this machine, or on a Dask cluster, with equal results."""
