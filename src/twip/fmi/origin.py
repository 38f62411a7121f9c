"""Who made an FMU, under which terms, and with what."""

import importlib.metadata
import tomllib

from ..errors import TwipError
from .blocks import PACKAGE
from .description import Origin


def licence() -> str:
    """Return the text of this project's licence."""
    for path in (PACKAGE / "LICENSE", PACKAGE.parents[1] / "LICENSE"):
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise TwipError(f"no LICENSE in {PACKAGE} or {PACKAGE.parents[1]}: an FMU must carry the licence of its code")


def licence_of(package: str) -> bytes:
    """Return the text of an installed package's licence."""
    theirs = [p for p in importlib.metadata.distribution(package).files or [] if p.name.startswith("LICENSE")]
    if not theirs:
        raise TwipError(f"the installed {package} comes without its licence text, which an FMU must carry")
    return theirs[0].read_text(encoding="utf-8").encode()


def origin_of(terms: str, package: str = "") -> Origin:
    """Return the origin of an FMU made with an installed package, or with nothing else, under the licence `terms`."""
    holder = next(line.strip() for line in terms.splitlines() if line.startswith("Copyright"))
    tool = f"twip, {package} {importlib.metadata.version(package)}" if package else "twip"
    return Origin(holder.split(maxsplit=3)[-1], version(), terms.split(maxsplit=1)[0], holder, tool)


def version() -> str:
    """Return the version of this project: from a checkout's pyproject.toml, else of the installed package."""
    project = PACKAGE.parents[1] / "pyproject.toml"
    if PACKAGE.parent.name == "src" and project.is_file():
        return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
    return importlib.metadata.version("twip")
