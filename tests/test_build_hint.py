"""A command that is given the source of a system says how its FMUs come into it."""

from pathlib import Path

import pytest

from twip.cli import main

SOURCE = Path(__file__).parents[1] / "ssp" / "twip"


@pytest.mark.parametrize("command", ["run", "check", "parameters", "container"])
def test_the_source_of_a_system_is_to_be_built(command, capsys):
    assert main([command, str(SOURCE)]) == 1
    lines = capsys.readouterr().err.splitlines()
    missing = [line for line in lines if line.startswith("twip: FMU resources/")]
    assert len(missing) == 5
    hint = f"twip: {SOURCE} is the source of a system, without its FMUs: twip build packs both into ssp/twip.ssp"
    assert lines == [*missing, hint]


@pytest.mark.parametrize("text", ["<a", "<ssd/>"])
def test_any_other_folder_gets_no_such_hint(text, tmp_path, capsys):
    (tmp_path / "fmus").mkdir()
    folder = tmp_path / "ssp" / "robot"
    folder.mkdir(parents=True)
    (folder / "SystemStructure.ssd").write_text(text)
    assert main(["run", str(folder)]) == 1
    assert "twip build" not in capsys.readouterr().err
