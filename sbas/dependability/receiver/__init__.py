"""Receiver states from recordings, and chains calibrated to published rows."""
