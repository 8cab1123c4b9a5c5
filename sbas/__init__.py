"""SBAS protection levels and integrity risk for railway signalling."""
