"""Septentrio SBF, read and written."""
