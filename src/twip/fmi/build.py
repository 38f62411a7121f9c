"""Builds the FMUs of all blocks and the .ssp archives of all systems."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..errors import Problem, TwipError
from ..outputs import make_writable, write_file
from ..platform import PLATFORMS, Platform
from .blocks import PACKAGE, block_folders, source_root
from .native.package import package_native
from .ssp_package import needed_fmus, package_system, system_folders

REFUSED = 3
"""Exit status of the build of one block when it has said why; any other but 0 is a crash."""
LOOSE = (".ssv", ".csv", ".ssm", ".toml")
"""Endings of the parameter sets, inputs, mappings and scenarios that belong to no system and lie beside them."""


def build_all(
    output: Path, names: Iterable[str] | None = None, progress: Callable[[Path], None] | None = None
) -> list[Path]:
    """Build `output/fmus/*.fmu` and `output/ssp/*.ssp`, all in FMI 2.0, and return their paths.

    `names` limits the build to some blocks (default: all) and to the systems that contain them and have all their other
    FMUs in place. `progress` is called with each finished file. Outside the repository the loose parameter sets and
    inputs are copied too. The problems of all blocks are raised together as one TwipError.
    """
    root = source_root()
    faces = _chosen(names)
    chosen = list(faces)
    fmus, report = output / "fmus", progress or (lambda _: None)
    built = build_blocks([(face, fmus / f"{n}.fmu") for n, face in faces.items()], report)
    for name, folder in system_folders(root).items():
        needed = needed_fmus(folder)
        if names is None or (needed & set(chosen) and all((fmus / f"{n}.fmu").is_file() for n in needed)):
            built.append(output / "ssp" / f"{name}.ssp")
            package_system(folder, fmus, built[-1])
            report(built[-1])
    if output.resolve() != root.resolve():
        _copy_loose(root / "ssp", output / "ssp")
    return built


def build_fmi3(
    output: Path, names: Iterable[str] | None = None, progress: Callable[[Path], None] | None = None
) -> list[Path]:
    """Build `output/fmus/<block>_fmi3.fmu`, the blocks in FMI 3.0, and return their paths; see `build_all`."""
    jobs = [(face, output / "fmus" / f"{n}_fmi3.fmu") for n, face in _chosen(names).items()]
    return build_blocks(jobs, progress or (lambda _: None), "3.0")


def build_native(
    output: Path,
    names: Iterable[str] | None = None,
    progress: Callable[[Path], None] | None = None,
    version: str = "2.0",
    platforms: Sequence[Platform] = PLATFORMS,
) -> list[Path]:
    """Build `output/fmus/<block>_native.fmu`, in FMI 3.0 `<block>_native_fmi3.fmu`, the blocks without Python; for FMI
    2.0 also the systems of them, `output/ssp/<system>_native.ssp`. Returns their paths; see `build_all`.
    """
    report, ending = progress or (lambda _: None), "_native" if version == "2.0" else "_native_fmi3"
    fmus = output / "fmus"
    make_writable(fmus)
    jobs = [(face, fmus / f"{n}{ending}.fmu") for n, face in _chosen(names).items()]
    built = _in_parallel(jobs, report, lambda face, fmu: _build_native(face, fmu, version, platforms))
    if version == "2.0":
        for name, folder in system_folders(source_root()).items():
            needed = needed_fmus(folder)
            if (names is None or needed & set(names)) and all((fmus / f"{n}_native.fmu").is_file() for n in needed):
                built.append(output / "ssp" / f"{name}_native.ssp")
                package_system(folder, fmus, built[-1], "_native")
                report(built[-1])
    return built


def _build_native(face: Path, output: Path, version: str, platforms: Sequence[Platform]) -> Sequence[Problem]:
    """Build one FMU and return what went wrong, or nothing."""
    try:
        package_native(face, output, version, platforms)
    except TwipError as error:
        return error.problems
    return ()


def _chosen(names: Iterable[str] | None) -> dict[str, Path]:
    """Return the faces of the named blocks, or of all; an unknown name raises TwipError."""
    folders = block_folders(source_root())
    chosen = sorted(folders) if names is None else list(dict.fromkeys(names))
    unknown = [n for n in chosen if n not in folders]
    if unknown:
        raise TwipError(f"no block {', '.join(unknown)}; there are {', '.join(folders)}")
    return {n: folders[n] / f"{n}.py" for n in chosen}


def build_blocks(jobs: list[tuple[Path, Path]], report: Callable[[Path], None], version: str = "2.0") -> list[Path]:
    """Build the FMU of each (face, output) in FMI `version`.

    Each in a process of its own, as many at a time as there are processors.
    """
    for folder in {output.parent for _, output in jobs}:
        make_writable(folder)
    return _in_parallel(jobs, report, lambda face, output: _build_block(face, output, version))


def _in_parallel(
    jobs: list[tuple[Path, Path]], report: Callable[[Path], None], build: Callable[[Path, Path], Sequence[Problem]]
) -> list[Path]:
    """Let `build` make each output of its face, and raise what went wrong together."""
    with ThreadPoolExecutor(max_workers=min(len(jobs), os.cpu_count() or 1) or 1) as pool:
        problems: list[Problem] = []
        for (_, output), wrong in zip(jobs, pool.map(lambda job: build(*job), jobs), strict=True):
            problems += wrong
            if not wrong:
                report(output)
    if problems:
        raise TwipError(problems)
    return [output for _, output in jobs]


def _build_block(face: Path, output: Path, version: str) -> Sequence[Problem]:
    """Build one FMU and return what went wrong, or nothing."""
    path = os.pathsep.join([str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "twip.fmi.package", str(face.resolve()), str(output.resolve()), version]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if run.returncode == 0:
        return ()
    said = run.stderr.strip().splitlines()
    if run.returncode != REFUSED:
        end = (said or [""])[-1]
        return [Problem(f"the build ended with status {run.returncode}: {end}", subject=f"block {face.stem}")]
    return list(map(Problem, said))


def _copy_loose(source: Path, target: Path) -> None:
    """Copy the files of `ssp/` that belong to no system, in their folders."""
    systems = set(system_folders(source.parent).values())
    for path in sorted(source.rglob("*")):
        if path.suffix in LOOSE and not systems & set(path.parents):
            write_file(target / path.relative_to(source), path.read_bytes())
