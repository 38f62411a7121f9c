"""What is wrong is data until it is printed, and no code reads a message back."""

import ast
import pickle
from pathlib import Path

import pytest

from twip.cosim.reading.problems import Place, Problem, Problems
from twip.errors import TwipError

SOURCES = sorted((Path(__file__).parents[1] / "src" / "twip").rglob("*.py"))
KINDS = {"TwipError", "ComponentError", "EndRequestedError", "ForeignLogError", "MetricError", "RefusedError"}


def test_a_problem_reads_subject_text_rule_place():
    problem = Problem("step = 'x'", Place("a.ssd", 3, "plant"), "must be a finite number", "--swap")
    assert str(problem) == "--swap: step = 'x' must be a finite number (component plant, a.ssd line 3)"
    assert str(Problem("no such file")) == "no such file"
    assert str(problem.about("--other")).startswith("--other: step")


def test_a_problem_is_one_printable_line():
    assert str(Problem("two\n  lines")) == "two lines"
    assert str(Problem("bell \a", Place("a\x1b.ssd"))) == "bell \\x07 (a\\x1b.ssd)"


def test_an_error_carries_its_problems_and_is_their_lines():
    error = TwipError([Problem("a", Place("f", 1)), "b", Problem("b")])
    assert error.problems == (Problem("a", Place("f", 1)), Problem("b"))
    assert str(error) == "a (f line 1)\nb"
    assert TwipError("one").problems == (Problem("one"),)
    assert TwipError(Problem("one")).problems == (Problem("one"),)
    assert str(TwipError(["a", "b"]).about("--keep")) == "--keep: a\n--keep: b"


def test_an_error_goes_to_another_process_as_data():
    error = TwipError([Problem("a", Place("f", 1), "must be b"), "c"]).about("x")
    there = pickle.loads(pickle.dumps(error))
    assert (there.problems, str(there)) == (error.problems, str(error))


def test_a_check_fails_when_a_problem_is_added_after_its_begin():
    problems = Problems()
    problems.add("old")
    outer = problems.checking()
    problems.warn("odd")
    assert not outer.failed
    inner = problems.checking()
    problems.add("old")  # known, and wrong here too
    assert inner.failed
    assert outer.failed
    assert not problems.checking().failed
    assert problems.lines == ["old"]


def test_the_problems_of_an_error_are_taken_over():
    problems = Problems()
    problems.add("0 is wrong", Place("f", 1), rule="must be 1")
    with problems.catch(Place("g")):
        raise TwipError(["a", Problem("b", Place("h"))])
    assert list(problems) == [
        Problem("0 is wrong", Place("f", 1), "must be 1"), Problem("a", Place("g")), Problem("b", Place("h")),
    ]  # fmt: skip
    with pytest.raises(TwipError) as error:
        problems.raise_any()
    assert error.value.problems == tuple(problems)


def test_what_is_no_mistake_of_the_user_is_not_taken_over():
    with pytest.raises(ValueError, match="bug"), Problems().catch():
        raise ValueError("bug")


def read_back(text: str) -> list[int]:
    """Return the lines where a module takes the text of our errors apart, or makes several problems one text."""
    found = []
    for handler in (n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.ExceptHandler)):
        kinds = {n.id for n in ast.walk(handler.type or handler) if isinstance(n, ast.Name)}
        for node in ast.walk(handler) if kinds & KINDS else ():
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Call):
                called, arguments = node.value.func, node.value.args
                ours = [a for a in arguments if isinstance(a, ast.Name) and a.id == handler.name]
                if ours and isinstance(called, ast.Name) and called.id == "str" and node.attr != "encode":
                    found.append(node.lineno)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
            joined = node.exc.args[0]
            if any(
                isinstance(n, ast.Constant) and isinstance(n.value, str) and "\n" in n.value for n in ast.walk(joined)
            ):
                found.append(node.lineno)
    return found


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.relative_to(SOURCES[0].parent).as_posix())
def test_no_code_reads_a_message_back(path):
    text = path.read_text(encoding="utf-8")
    assert not read_back(text)
    assert "len(problems.lines)" not in text
    assert "len(self.problems.lines)" not in text


def test_a_message_that_is_read_back_is_seen():
    assert read_back("try:\n    f()\nexcept TwipError as e:\n    g(str(e).splitlines())") == [4]
    assert read_back("try:\n    f()\nexcept OSError as e:\n    g(str(e).strip())") == []
    assert read_back("raise TwipError('\\n'.join(lines))") == [1]
    assert read_back("raise TwipError(f'{error}\\n{hint}')") == [1]
