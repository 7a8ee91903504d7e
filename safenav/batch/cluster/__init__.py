"""Where cases run elsewhere: a Dask cluster."""
