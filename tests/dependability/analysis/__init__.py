"""Tests of the analyses on top of the exact solution."""
