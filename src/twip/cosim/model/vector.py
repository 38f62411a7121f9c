"""The values of a system in memory that compiled code and other processes can share."""

import ctypes

Vector = ctypes.Array[ctypes.c_double]


def vector(columns: int) -> Vector:
    """Return a value vector of zeros."""
    return (ctypes.c_double * columns)()
