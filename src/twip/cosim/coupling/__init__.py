"""Coupling: what a communication step is, in which order, in plain and in compiled code."""
