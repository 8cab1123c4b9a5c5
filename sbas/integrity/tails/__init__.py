"""Beyond counting: declustered events, fitted tails, overbounds, priors."""
