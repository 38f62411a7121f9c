"""A wired system of models as one model in C: where the values of its components lie, and what a step does.

The values are those of the components one after the other, then one for each connector, then the memory of the
coupling. The statements of a step are those of the master's plain loop (cosim/coupling/plain_step.py) in its order,
with the same arithmetic, so that both give the same bits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..declare import Variable
from ..nested import Name
from .expression import number
from .layout import comment, wrapped
from .table_source import variables_source

PASSES = 100
"""Initial values are handed around at most so often until none changes."""
SAMPLES = 4
"""A copy to the middle of a step remembers the newest value and when it was, the last before and when that was."""


@dataclass(frozen=True)
class Link:
    """`destination = factor * source + offset`, each a variable of a component, or a connector of component ""."""

    source: Name
    destination: Name
    factor: float = 1.0
    offset: float = 0.0
    middle: bool = False
    """Whether it brings the value at the middle of the step, on the line through the source's last two values."""


@dataclass(frozen=True)
class Stage:
    """First all links, then all components, one after the other."""

    links: tuple[Link, ...]
    components: tuple[str, ...]


@dataclass(frozen=True)
class Part:
    """A component: its model in C, and the values that other components set, with what they are at the start."""

    name: str
    model: str
    size: int
    references: Mapping[str, int]
    """Indices of its values by variable."""
    connected: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SystemModel:
    """A system to be written as C; `shown` are its variables, each with what it stands for."""

    name: str
    symbol: str
    parts: Sequence[Part]
    initial: Sequence[Stage]
    """What is repeated until initial values settle."""
    stages: Sequence[Stage]
    """A step."""
    shown: Sequence[tuple[Variable, Name]]
    step_size: float


class Places:
    """Where each value of a system lies."""

    def __init__(self, system: SystemModel):
        self.base: dict[str, int] = {}
        at = 0
        for part in system.parts:
            self.base[part.name] = at
            at += part.size
        self._references = {part.name: part.references for part in system.parts}
        links = [link for stage in (*system.initial, *system.stages) for link in stage.links]
        ends = (*(n for link in links for n in (link.source, link.destination)), *(name for _, name in system.shown))
        self._connectors = {name: at + i for i, name in enumerate(dict.fromkeys(n for n in ends if not n[0]))}
        at += len(self._connectors)
        self.samples: dict[Link, int] = {}
        for link in (link for stage in system.stages for link in stage.links if link.middle):
            self.samples[link] = at
            at += SAMPLES
        self.reached = {part.name: at + i for i, part in enumerate(system.parts)}
        self.turn = self.reached[""] = at + len(system.parts)
        self.start = self.turn + 1
        self.size = self.start + 1

    def __getitem__(self, name: Name) -> int:
        component, variable = name
        return self.base[component] + self._references[component][variable] if component else self._connectors[name]


def system_source(system: SystemModel) -> str:
    """Return the C file of a system's model."""
    places = Places(system)
    models = dict.fromkeys(part.model for part in system.parts)
    texts = [
        comment(
            f"{system.name}: {', '.join(p.name for p in system.parts)}\nMade by twip from their wiring; do not edit."
        ),
        '#include "twip_model.h"\n',
        "\n".join(f"extern const twip_Model {model};" for model in models) + "\n",
        variables_source("system", [v for v, _ in system.shown]),
        "/* where the variables lie */",
        "\n".join(wrapped([_places(system, places)])) + "\n",
        _clear(system, places),
        _initialize(system, places),
        _check(system, places),
        _step(system, places),
        f"extern const twip_Model {system.symbol};\nconst twip_Model {system.symbol} = {{\n"
        f'  "{system.name}", {len(system.shown)}, {places.size}, system_variables, system_places, '
        f"{number(system.step_size)},\n  clear_system, initialize_system, check_system, step_system,\n}};\n",
    ]
    return "\n".join(texts)


def _places(system: SystemModel, places: Places) -> str:
    return f"static const uint32_t system_places[] = {{{', '.join(str(places[name]) for _, name in system.shown)}}};"


def _label(link: Link) -> str:
    return " → ".join(".".join(filter(None, name)) for name in (link.source, link.destination))


def _copied(link: Link, places: Places) -> str:
    return f"{number(link.factor)} * m[{places[link.source]}] + {number(link.offset)}"


def _clear(system: SystemModel, places: Places) -> str:
    lines = ["static void clear_system(double *m) {"]
    for part in system.parts:
        base = places.base[part.name]
        lines.append(f"  {part.model}.clear(m + {base}); /* {part.name} */")
        lines += [
            f"  m[{base + part.references[name]}] = {number(start)}; /* {part.name}.{name} */"
            for name, start in part.connected.items()
        ]
    return "\n".join([*lines, "}"]) + "\n"


def _initialize(system: SystemModel, places: Places) -> str:
    lines = [
        "/* Copies a value, and tells whether that changed anything. */",
        "static bool moved(double *to, double value) {",
        "  const bool same = *to == value;",
        "  *to = value;",
        "  return !same;",
        "}",
        "",
        "static void initialize_system(double *m, double time) {",
        f"  for (int pass = 0, moving = 1; moving && pass < {PASSES}; pass++) {{",
        "    moving = 0;",
    ]
    for stage in system.initial:
        lines += [f"    moving |= moved(m + {places[k.destination]}, {_copied(k, places)}); /* {_label(k)} */"
                  for k in stage.links]  # fmt: skip
        for name in stage.components:
            part = next(p for p in system.parts if p.name == name)
            lines.append(f"    {part.model}.initialize(m + {places.base[name]}, time); /* {name} */")
    lines.append("  }")
    for link, at in places.samples.items():
        lines.append(f"  m[{at}] = m[{at + 2}] = {_copied(link, places)}; /* {_label(link)} */")
        lines.append(f"  m[{at + 1}] = 0.0, m[{at + 3}] = -1.0;")
    lines += [f"  m[{at}] = 0.0;" for at in places.reached.values()]
    return "\n".join([*lines, f"  m[{places.start}] = time;", "}"]) + "\n"


def _check(system: SystemModel, places: Places) -> str:
    lines = ["static int check_system(const double *m, twip_Report *report) {", "  int broken = 0;"]
    for part in system.parts:
        lines.append(f'  if (report) report->prefix = "{part.name}: ";')
        lines.append(f"  broken += {part.model}.check(m + {places.base[part.name]}, report);")
    return "\n".join([*lines, '  if (report) report->prefix = "";', "  return broken;", "}"]) + "\n"


def _step(system: SystemModel, places: Places) -> str:
    size, turn = number(system.step_size), f"m[{places.turn}]"
    lines = [
        "/* One step of the inside: from m[turn] to the next. */",
        "static int step_once(double *m, twip_Report *report) {",
        f"  const double step_size = {size}, time = m[{places.start}] + {turn} * step_size, end = {turn} + 1.0;",
        "  int told = 0;",
        "  (void)end;",
    ]
    for stage in system.stages:
        for link in stage.links:
            to = places[link.destination]
            if link not in places.samples:
                lines.append(f"  m[{to}] = {_copied(link, places)}; /* {_label(link)} */")
                continue
            at, reached = places.samples[link], places.reached[link.source[0]]
            lines += [
                f"  {{ /* {_label(link)}, at the middle of the step */",
                f"    const double value = {_copied(link, places)}, reached = m[{reached}];",
                f"    if (reached > m[{at + 1}]) m[{at + 2}] = m[{at}], m[{at + 3}] = m[{at + 1}];",
                f"    m[{at}] = value, m[{at + 1}] = reached;",
                f"    m[{to}] = value + (end - 0.5 - reached) / (reached - m[{at + 3}]) * (value - m[{at + 2}]);",
                "  }",
            ]
        for name in stage.components:
            part = next(p for p in system.parts if p.name == name)
            base = places.base[name]
            lines.append(f"  told += {part.model}.step(m + {base}, time, step_size, report); /* {name} */")
            lines.append(f"  m[{places.reached[name]}] = end;")
    return (
        "\n".join([*lines, f"  {turn} = end;", "  return told;", "}"])
        + f"""

static int step_system(double *m, double time, double step_size, twip_Report *report) {{
  const double inner = {size}, steps = twip_floor(step_size / inner + 0.5), begin = m[{places.start}] + {turn} * inner;
  const double rounding = 1e-6 * inner + 1e-12 * twip_fabs(time);
  const char *wrong = 0;
  if (!(steps >= 1.0) || twip_fabs(step_size - steps * inner) > rounding)
    wrong = " s: it must be a whole multiple of the step of the inside, ";
  else if (twip_fabs(time - begin) > 1e-3 * inner + 1e-9 * twip_fabs(time))
    wrong = " s: it must begin where the last one ended, at ";
  if (wrong) {{
    twip_begin(report);
    twip_say(report, "the step from ");
    twip_say_number(report, time, 10);
    twip_say(report, " s by ");
    twip_say_number(report, step_size, 10);
    twip_say(report, wrong);
    twip_say_number(report, steps >= 1.0 && twip_fabs(step_size - steps * inner) <= rounding ? begin : inner, 10);
    twip_say(report, " s");
    twip_end(report);
    return 1;
  }}
  for (int64_t i = 0, count = twip_integer(steps); i < count; i++) {{
    const int told = step_once(m, report);
    if (told) return told;
  }}
  return 0;
}}
"""
    )
