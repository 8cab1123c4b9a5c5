"""Figures of a record by environment: which epochs, hours and events belong to each label."""
