"""Experiments with the robot: they use the physics, the FMUs and the master; nothing uses them."""
