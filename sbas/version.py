"""The version that every report, recording and error names."""

__version__ = "0.1.0"
