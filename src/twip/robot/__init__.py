"""The robot's physics: scalar functions, standard library only, so that an FMU can carry them anywhere."""

from .parameters import PARAMETERS, Parameter, value

__all__ = ["PARAMETERS", "Parameter", "value"]
