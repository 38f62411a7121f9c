"""A system, its run and its schedule as pure data."""
