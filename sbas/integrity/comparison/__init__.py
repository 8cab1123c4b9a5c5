"""Two recordings of the same hours, and shares of time with intervals."""
