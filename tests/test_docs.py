"""The README's commands and what it prints are those of the program."""

import inspect
import re
import shlex
from dataclasses import fields
from pathlib import Path

from twip.cli import COMMANDS, parser
from twip.cosim import Algorithm, Checkpoints, Inputs, Observer, Runtime, simulate

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def commands():
    """Return the words of every `twip …` line of the README and the documents, without its comment."""
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for line in path.read_text(encoding="utf-8").splitlines():
            if re.match(r"    twip [a-z]", line):
                yield path.name, shlex.split(line.split(" #")[0])[1:]


def test_every_command_of_the_documents_is_understood():
    found = list(commands())
    assert {words[0] for _, words in found} >= {"run", "parameters", "identify", "paper", "stability"}
    for _, words in found:
        assert words[0] in COMMANDS
        parser(words[0]).parse_args(words)  # exits with status 2 at an unknown option


def test_files_that_the_readme_names_exist():
    for target in re.findall(r"\]\(([\w./]+)\)", README):
        assert (ROOT / target).exists(), target
    for folder in re.findall(r"^\| `([\w/]+)/", README, re.MULTILINE):
        assert (ROOT / folder).is_dir(), folder
    for path in re.findall(r"ssp/(?:parameters|inputs|scenarios)/\w+\.\w+", README):
        assert (ROOT / path).is_file(), path


def test_files_that_the_documents_link_to_exist():
    for path in (ROOT / "docs").rglob("*.md"):
        for target in re.findall(r"\]\((?!https?:)([^)#\s]+)", path.read_text(encoding="utf-8")):
            assert (path.parent / target).exists(), f"{path.name}: {target}"


def test_the_python_examples_run(built, tmp_path, monkeypatch):
    (tmp_path / "ssp").symlink_to(built / "ssp")
    monkeypatch.chdir(tmp_path)
    for path in (ROOT / "README.md", ROOT / "docs" / "python.md"):
        code = "\n".join(
            re.findall(r"^```python\n(.*?)^```$", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
        )
        assert "simulate(" in code
        names: dict[str, object] = {}
        exec(compile(code, path.name, "exec"), names)
        assert names["result"].time in (2.0, 5.0)


def test_every_argument_of_a_run_and_every_field_of_its_groups_is_documented():
    arguments = set(inspect.signature(simulate).parameters) - {"system"}
    assert len(arguments) <= 9
    table = (ROOT / "docs" / "python.md").read_text(encoding="utf-8").partition("| argument | what |")[2]
    options = {f.name for group in (Algorithm, Checkpoints, Inputs, Observer, Runtime) for f in fields(group)}
    for name in arguments | options - {"places"}:
        assert re.search(rf"`{name}(=\w+\(…\))?`", table), name
