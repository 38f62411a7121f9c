"""A balancing robot as FMI co-simulation components, the master that runs them and the logs that show them."""
