"""Static fault trees: exact probability, cut sets and importance."""
