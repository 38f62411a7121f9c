"""Shared libraries from C: by Zig for every platform, or by the machine's own C compiler for this one."""

import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...errors import TwipError
from ...platform import PLATFORMS, TUPLE, Platform
from .universal import universal

TRIPLES = {"x86_64-windows": "x86_64-windows-gnu", "x86_64-darwin": "x86_64-macos", "aarch64-darwin": "aarch64-macos"}
"""Zig's names of platforms where they are not those of FMI 3.0."""

FLAGS = (
    "-std=c99", "-O2", "-g0", "-shared", "-nostdlib", "-ffreestanding", "-fno-builtin", "-fvisibility=hidden",
    "-ffp-contract=off", "-fno-math-errno", "-U__FP_FAST_FMA", "-fwrapv", "-fno-stack-protector",
    "-fno-asynchronous-unwind-tables",
    "-DTWIP_NO_LIBRARY", "-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)  # fmt: skip
"""No contraction, so that every platform rounds alike; no library, so that nothing is needed on the host."""

_LINK = {"so": ("-s", "-Wl,--build-id=none"), "dll": ("-s", "-lkernel32"), "dylib": ("-Wl,-s",)}
HOST_COMPILERS = ("cc", "gcc", "clang")


def libraries(
    name: str, sources: Mapping[str, bytes], version: str, platforms: Sequence[Platform] = PLATFORMS
) -> dict[str, bytes]:
    """Return path in the FMU → library `name` for the platforms that the compiler at hand serves.

    `sources` are .c and .h files by name. The same sources and compiler give the same bytes. Raises TwipError when
    there is no compiler, or when it refuses the sources.
    """
    zig = _zig()
    built: dict[tuple[str, str], list[bytes]] = {}
    for target in platforms if zig else [this_machine()]:
        triple = TRIPLES.get(target.fmi3, target.fmi3)
        command = [str(zig), "cc", "-target", triple] if zig else [_host_compiler(), "-fPIC"]
        folder = target.fmi2 if version == "2.0" else target.fmi3
        built.setdefault((folder, target.ending), []).append(_library(command, name, target, sources))
    return {
        f"binaries/{folder}/{name}.{ending}": parts[0] if len(parts) == 1 else universal(parts)
        for (folder, ending), parts in built.items()
    }


def this_machine() -> Platform:
    """Return the platform of this machine; one that FMUs are not built for raises TwipError."""
    for known in PLATFORMS:
        if known.fmi3 == TUPLE:
            return known
    raise TwipError(f"native FMUs are not built for {TUPLE}")


def _zig() -> Path | None:
    """Return the compiler of the package ziglang (the extra `native`), or None."""
    found = importlib.util.find_spec("ziglang")
    for folder in (found.submodule_search_locations or []) if found else []:
        for name in ("zig", "zig.exe"):
            if (Path(folder) / name).is_file():
                return Path(folder) / name
    return None


def _host_compiler() -> str:
    for name in HOST_COMPILERS:
        path = shutil.which(name)
        if path:
            return path
    raise TwipError(
        "native FMUs need a C compiler: pip install 'twip[native]' brings one for all platforms, "
        "cc on the path serves this machine alone"
    )


def _library(command: list[str], name: str, target: Platform, sources: Mapping[str, bytes]) -> bytes:
    """Return one library; all paths that the compiler sees are relative, for some formats keep them."""
    with tempfile.TemporaryDirectory(prefix="twip_native_") as folder:
        for file, content in sources.items():
            (Path(folder) / file).write_bytes(content)
        output = f"{name}.{target.ending}"
        files = sorted(f for f in sources if f.endswith(".c"))
        install = (f"-Wl,-install_name,@rpath/{output}",) if target.ending == "dylib" else ()
        line = [*command, *FLAGS, *_LINK[target.ending], *install, "-o", output, *files]
        run = subprocess.run(line, cwd=folder, env=_environment(), capture_output=True, text=True, check=False)
        if run.returncode != 0 or not (Path(folder) / output).is_file():
            said = next((s for s in run.stderr.splitlines() if "error" in s), run.stderr.strip()[:300])
            raise TwipError(f"{name}: the C compiler failed for {target.fmi3}: {said}")
        return (Path(folder) / output).read_bytes()


def _environment() -> dict[str, str]:
    """Return the compiler's environment; Zig keeps what it has compiled outside the source tree."""
    if os.environ.get("ZIG_GLOBAL_CACHE_DIR"):
        return {**os.environ, "ZIG_LOCAL_CACHE_DIR": os.environ["ZIG_GLOBAL_CACHE_DIR"], "LC_ALL": "C"}
    given, shared = os.environ.get("TWIP_CACHE"), os.environ.get("XDG_CACHE_HOME", "")
    root = Path(given) if given else (Path(shared) if os.path.isabs(shared) else Path.home() / ".cache") / "twip"
    cache = str(root.absolute() / "zig")
    return {**os.environ, "ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache, "LC_ALL": "C"}
