"""The command line: one verb a question; it parses, calls and prints, with no logic of its own."""

from sbas.cli.entry import main

__all__ = ["main"]
