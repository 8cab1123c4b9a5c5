"""Exact solution of a hybrid fault tree: windows, modules, product chains."""
