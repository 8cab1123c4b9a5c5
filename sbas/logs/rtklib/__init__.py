"""RTKLIB solutions."""
