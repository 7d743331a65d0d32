"""Execution of batches in this process, threads, processes or on a Dask cluster."""
