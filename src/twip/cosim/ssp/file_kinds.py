"""What a file that is no system is called, and where it belongs."""

import pathlib

_BELONGS = {
    ".ssv": ("a parameter set", "parameter sets go with --parameters"),
    ".ssm": ("a parameter mapping", "mappings belong to the parameter bindings of a system"),
    ".ssb": ("a signal dictionary", "dictionaries belong to the description of a system"),
    ".fmu": ("an FMU", "an FMU becomes part of a system, or takes a component's place with --swap"),
    ".csv": ("a table", "time series go with --input-file"),
    ".toml": ("a TOML file", "scenarios go with --scenario"),
    ".mcap": ("a log", "twip report shows logs"),
    ".checkpoint": ("a checkpoint", "a run goes on from it with --resume"),
}
SYSTEM = "a system is an .ssp archive, its unpacked folder or an .ssd file"


def why_no_system(path: pathlib.Path) -> str:
    """Return what `path` is instead of a system, a file by its ending; nothing where it may be one."""
    ending = path.suffix.lower()
    if path.is_dir():
        ending = ".fmu" if (path / "modelDescription.xml").is_file() else ""
    found = _BELONGS.get(ending)
    return "" if found is None else f"{path} is {found[0]}; {SYSTEM} ({found[1]})"
