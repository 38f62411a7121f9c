"""Instances that serve one run of a system after the other."""

import pathlib

import numpy as np
from numpy.typing import NDArray

from ..model.message import Message
from ..model.system import Component
from .component import Instance
from .instantiate import instantiate
from .protocols import AnyInstance


class InstancePool:
    """Keeps the instances of finished runs, reset (FMI 2.0.4 section 4.2.2), for further runs of the same system.

    Loading and instantiating an FMU takes a few milliseconds that a reset does not, and pythonfmu leaks some memory at
    each instantiation. An FMU that forgets something at its reset makes later runs differ from the first. Close the
    pool, or use it as a context, to free the instances. Without `keeps` every run has instances of its own.
    """

    def __init__(self, keeps: bool = True):
        self._keeps = keeps
        self._waiting: dict[tuple[str, pathlib.Path], Instance] = {}

    def take(
        self,
        component: Component,
        folder: pathlib.Path,
        messages: list[Message],
        dead: set[pathlib.Path],
        clock: NDArray[np.float64],
    ) -> Instance:
        """Return an instance of the component's FMU, unpacked in `folder`, for a run; see `Instance`."""
        instance = self._waiting.pop((component.name, folder), None)
        if instance is None:
            return instantiate(component, folder, messages, dead, clock)
        instance.serve(component, messages, dead, clock)
        return instance

    def give_back(self, instance: AnyInstance, completed: bool) -> None:
        """Take an instance back at the end of a run; it is freed unless the run was completed and it can be reset.

        One in a process of its own always is.
        """
        if self._keeps and completed and isinstance(instance, Instance) and instance.reset():
            self._waiting[instance.name, instance.folder] = instance
        else:
            instance.close()

    def close(self) -> None:
        """Free the instances that wait for a run, the last first."""
        while self._waiting:
            self._waiting.popitem()[1].close()

    def __enter__(self) -> "InstancePool":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
