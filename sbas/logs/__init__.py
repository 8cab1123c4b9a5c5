"""Receiver logs to recordings, and back for SBF and Parquet; one file a format."""

from sbas.logs.registry import read, scan
from sbas.logs.track_files import load_track
from sbas.logs.truth_files import read_truth_table

__all__ = ["load_track", "read", "read_truth_table", "scan"]
