"""How long position errors stay correlated: estimate, interval, misfit."""
