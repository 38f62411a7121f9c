"""Blocks as FMUs without Python: the kernel subset becomes C99, compiled for every platform (docs/native.md)."""
