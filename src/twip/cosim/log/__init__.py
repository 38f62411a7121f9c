"""Logs as MCAP: written while a run goes on, read back afterwards."""
