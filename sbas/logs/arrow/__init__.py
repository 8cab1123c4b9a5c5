"""Parquet: the format of this package, and tables of other programs."""
