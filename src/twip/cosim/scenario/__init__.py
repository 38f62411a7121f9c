"""What is done to a system during a run: inputs over time, changes of parameters, faults."""
