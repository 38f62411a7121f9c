"""What a coupling algorithm is: everything that planning, checks, files, the command line and messages need of one."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ...model.iteration import Iteration
from ..feedthrough import Output


@dataclass(frozen=True)
class Option:
    """A number that an algorithm takes, besides what every coupling takes."""

    name: str
    """In Python; with dashes on the command line, with spaces in messages."""
    attribute: str
    """In the annotation of a system's description."""
    kind: type[int] | type[float]
    default: float
    metavar: str
    help: str
    """For the command line, with the unit and the default."""
    problem: Callable[[float], str]
    """Returns what is wrong with a value; an empty text if it is right."""

    @property
    def words(self) -> str:
        """The name for messages."""
        return self.name.replace("_", " ")


@dataclass(frozen=True)
class Stages:
    """Which components step together in a communication step, and what is repeated."""

    members: tuple[tuple[str, ...], ...]
    """The components of each stage, in the order of execution. All components of a stage get their inputs before the
    first of them steps. Every component is in one stage.
    """
    cycles: tuple[tuple[int, int], ...] = ()
    """Stages that are repeated together until their values agree: the first, and the one after the last. A repeated
    stage has one component.
    """


class CouplingAlgorithm(ABC):
    """How components exchange values in a communication step. A class in a file of this folder is one more coupling."""

    name: ClassVar[str]
    """On the command line, in files and in messages."""
    summary: ClassVar[str]
    """How components get their inputs, to follow "all components step", in half a sentence."""
    rank: ClassVar[int] = 100
    """Place in lists of all couplings; those of the same rank come by name."""
    takes_order: ClassVar[bool] = False
    """Whether a user may give the order of the components by hand."""
    repeats: ClassVar[bool] = False
    """Whether steps may be repeated from their beginning. Then the FMUs in cycles must save their state, all components
    have the same step, and only the plain loop runs the steps.
    """
    in_a_loop: ClassVar[str] = "a value in it is a step old"
    """What an algebraic loop means, for the warning; empty if the algorithm solves it."""
    unlike_jacobi: ClassVar[str | None] = None
    """What a container that steps by Jacobi does not do, following "components exchange values once per step (Jacobi)".
    Empty if the results are the same; None stands for "not by" the name.
    """
    options: ClassVar[tuple[Option, ...]] = ()

    @abstractmethod
    def stages(
        self, order: Sequence[str], sources: Mapping[tuple[str, str], Output], options: Mapping[str, float]
    ) -> Stages:
        """Return the stages of a step.

        `order` has all components as their feed-through wants them, or as given by hand. `sources` maps each connected
        input (component, variable) to the output that feeds it. `options` has a value of each option, by name.
        """

    def completed(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return the values of all options, by name: those `given`, else the defaults."""
        return {option.name: given.get(option.name, option.default) for option in self.options}

    def iteration(self, options: Mapping[str, float]) -> Iteration:  # noqa: ARG002
        """Return when repeated stages are accepted; for `options` see `stages`."""
        return Iteration()

    def described(self, options: Mapping[str, float]) -> list[tuple[str, str]]:
        """Return lines (name, text) on the options for the overview of a run."""
        return [(option.words, f"{options[option.name]:g}") for option in self.options]
