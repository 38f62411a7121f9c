"""The unpacked FMUs of a system, in folders that all its instances share."""

import pathlib
from collections.abc import Callable

from ..model.fmu import Fmu
from ..reading.archive import Workspace, unpack
from .fmu_cache import NotKeptError, abandon, keep


class UnpackedFmus:
    """Unpacks each FMU once, into a folder that is kept for later runs if possible, else into the workspace."""

    def __init__(self, workspace: Workspace):
        self._workspace = workspace
        self._folders: dict[pathlib.Path, pathlib.Path] = {}

    def folder(self, fmu: Fmu, tell: Callable[[str], None]) -> pathlib.Path:
        """Return the folder that holds the unpacked FMU; `tell` is told why it is not kept. Raises `TwipError`."""
        if fmu.path not in self._folders:
            try:
                folder = self._copied(fmu) if fmu.path.is_dir() else keep(fmu)
            except NotKeptError as reason:
                if str(reason):
                    tell(str(reason))
                folder = self._workspace.folder(fmu.model_identifier)
                unpack(fmu.path, folder, fmu.name)
            self._folders[fmu.path] = folder
        return self._folders[fmu.path]

    def _copied(self, fmu: Fmu) -> pathlib.Path:
        """Copy an FMU that is a folder."""
        folder = self._workspace.folder(fmu.model_identifier)
        for file in fmu.path.rglob("*"):
            if file.is_file():
                target = folder / file.relative_to(fmu.path)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(file.read_bytes())
        return folder

    def forget(self, folder: pathlib.Path) -> None:
        """Unpack an FMU anew next time: its library in `folder` has failed beyond repair."""
        abandon(folder)
        self._folders = {path: unpacked for path, unpacked in self._folders.items() if unpacked != folder}
