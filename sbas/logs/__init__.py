"""Receiver logs to recordings, and back for SBF and Parquet; one file a format."""
