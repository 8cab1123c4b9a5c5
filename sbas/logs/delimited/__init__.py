"""Delimited text: CSV and its kin, with the alias map of column names."""
