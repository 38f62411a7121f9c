"""Puts another FMU in the place of one that a system was made for, after its contract is checked.

The contract of a component is what the system uses of it: the connectors that something is connected to, by name,
causality, type and unit. The other FMU takes the system's names, so that connections, parameters, logs and scenarios
stay as they are; units are converted at its boundary. What it lacks and nobody uses is dropped; values that the
system's description gives to parameters it lacks are warned of, as for every FMU.
"""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..coupling.feedthrough import Output, evaluation_order
from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..ssp.component_fmus import read_fmus
from ..ssp.structure import ComponentElement, SystemElement
from ..ssp.wiring import Wiring
from ..values.names import Key
from ..values.variable import Variable
from .fitting import Fitting
from .swap_map import SwapMap


@dataclass
class Swaps:
    """The swaps of a system."""

    top: SystemElement
    components: Mapping[str, ComponentElement]
    files: Mapping[str, pathlib.Path]
    """By component, what takes its place."""
    maps: Mapping[str, SwapMap]
    problems: Problems
    before: dict[str, Fmu] = field(default_factory=dict)
    """The FMUs that were there, as far as they can be read."""
    variables: dict[Key, Variable] = field(default_factory=dict)
    """The variables that were there: what values in the system's description were written for."""

    def __post_init__(self) -> None:
        for name in sorted(self.maps.keys() - self.files.keys()):
            self.problems.add(f"there is a map for {name}, which is not swapped")

    def fit(self, fmus: Mapping[str, Fmu | None], sources: dict[str, dict[str, str]]) -> dict[str, Fmu | None]:
        """Return the FMUs with the new ones fitted, None for what does not fit; `sources` gets an entry for each."""
        fitted = dict(fmus)
        for path in self.files:
            fmu, element = fmus.get(path), self.components.get(path)
            if fmu is None or element is None:
                continue
            old = read_fmus({path: element}, {}, Problems())[path]
            if old is None:
                self.problems.warn(
                    f"swap {path}: {element.source} cannot be read, only what the connectors say is checked"
                )
            else:
                self.before[path] = old
                self.variables |= {(path, v.name): v for v in old.variables.values()}
            swap_map = self.maps.get(path, SwapMap())
            fitted[path] = Fitting(self.top, path, element, old, fmu, swap_map, self.problems).fit()
            sources[f"swap {path}"] = {
                "fmu": fmu.name,
                "instead_of": element.source or "",
                **({} if old is None else {"instead_of_sha256": old.sha256}),
                **{f"name {name}": own for name, own in swap_map.names.items()},
                **{f"unit {name}": unit for name, unit in swap_map.units.items()},
                **({"ignored": ", ".join(swap_map.ignore)} if swap_map.ignore else {}),
            }
        return fitted

    def refuse_loops(self, wiring: Wiring, fmus: Mapping[str, Fmu | None]) -> None:
        """Report algebraic loops that were not there before."""
        if not self.files:
            return
        now = {path: fmu.feedthrough for path, fmu in fmus.items() if fmu is not None}
        feeds = {key: link.source.key for key, link in wiring.links.items() if key[0] in now}
        was = {path: self.before[path].feedthrough if path in self.before else now[path] for path in now}
        known = {frozenset(loop) for loop in _loops(was, feeds)}
        for loop in _loops(now, feeds):
            inside = [
                p for p in self.files if any(p == c for c, _ in loop) and not self.maps.get(p, SwapMap()).allow_loop
            ]
            if inside and not any(set(loop) <= old for old in known):
                self.problems.add(
                    f"swap {', '.join(inside)}: feed-through closes an algebraic loop:"
                    f" {', '.join(f'{c}.{v}' for c, v in loop)} (allow_loop = true in its map accepts it)"
                )


def _loops(
    feedthrough: Mapping[str, Mapping[str, frozenset[str]]], feeds: Mapping[Key, Key]
) -> tuple[tuple[Output, ...], ...]:
    outputs = {(path, name) for path, own in feedthrough.items() for name in own}
    return evaluation_order(feedthrough, {key: source for key, source in feeds.items() if source in outputs}).loops
