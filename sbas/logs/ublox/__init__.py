"""u-blox logs: the binary UBX protocol, and UBX messages as hex in CSV."""
