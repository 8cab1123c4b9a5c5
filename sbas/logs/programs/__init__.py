"""Solutions that other programs computed."""
