"""Putting another FMU in a component's place."""
