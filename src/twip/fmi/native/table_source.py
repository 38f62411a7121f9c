"""A model's table of variables as C, and the model that the FMI functions see."""

from collections.abc import Sequence

from ..declare import Variable
from ..table import unit_of
from .expression import number
from .layout import text_literal

CAUSALITY = {"parameter": "TWIP_PARAMETER", "input": "TWIP_INPUT", "output": "TWIP_OUTPUT", "local": "TWIP_LOCAL"}
TYPE = {"Real": "TWIP_REAL", "Integer": "TWIP_INTEGER", "Boolean": "TWIP_BOOLEAN"}


def variables_source(name: str, variables: Sequence[Variable]) -> str:
    """Return the C table `<name>_variables` in the order of the value references."""
    rows = []
    for v in variables:
        low = "-TWIP_INFINITY" if v.minimum is None else number(v.minimum)
        high = "TWIP_INFINITY" if v.maximum is None else number(v.maximum)
        tunable = int(v.variability == "tunable")
        rows.append(
            f"  {{{text_literal(v.name)}, {text_literal(unit_of(v) or '')}, {CAUSALITY[v.causality]}, {TYPE[v.type]}, "
            f"{tunable}, {number(float(v.start or 0.0))}, {low}, {high}}},"
        )
    head = "/* name, unit, causality, type, whether tunable, start, minimum, maximum */"
    return "\n".join([head, f"static const twip_Variable {name}_variables[] = {{", *rows, "};"]) + "\n"


def block_model_source(name: str, size: int, exposed: int, initialize: str, check: str, step: str) -> str:
    """Return the model of a block: its functions, which take the values as a struct, behind ones that take doubles.

    `initialize`, `check` and `step` are names of C functions; an empty `check` stands for no rules.
    """
    rules = (
        f"return {check}((const {name}_values *)values, report);"
        if check
        else "(void)values, (void)report;\n  return 0;"
    )
    return f"""\
enum {{ {name}_exposed = {exposed}, {name}_size = {size} }};

static void {name}_clear_model(double *values) {{
  for (int i = 0; i < {name}_size; i++)
    if (i >= {name}_exposed || {name}_variables[i].causality > TWIP_INPUT) values[i] = 0.0;
}}

static void {name}_initialize_model(double *values, double time) {{
  {initialize}(({name}_values *)values, time);
}}

static int {name}_check_model(const double *values, twip_Report *report) {{
  {rules}
}}

static int {name}_step_model(double *values, double time, double step_size, twip_Report *report) {{
  (void)report;
  {step}(({name}_values *)values, time, step_size);
  return 0;
}}

extern const twip_Model {name}_model;
const twip_Model {name}_model = {{
  "{name}", {name}_exposed, {name}_size, {name}_variables, 0, 0.0,
  {name}_clear_model, {name}_initialize_model, {name}_check_model, {name}_step_model,
}};
"""
