"""One run: prepared, started, stepped, paced, saved and freed."""
