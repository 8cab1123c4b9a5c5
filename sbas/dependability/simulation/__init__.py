"""Independent simulation: slots, Petri nets, forced failures, agreement."""
