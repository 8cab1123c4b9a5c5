"""Episodes of combinations, competing risks, critical times."""
