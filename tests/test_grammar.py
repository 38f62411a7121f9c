"""The grammar of every command: lists add up, and a mistake in the options is one line."""

import argparse
import shlex
from importlib import import_module

import pytest

from twip.cli import COMMANDS, main
from twip.commands.container import declare as container
from twip.commands.parts.experiment import declare_experiment, pairs, swaps
from twip.commands.sweep import declare as sweep
from twip.errors import TwipError


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_with_several_values_may_be_given_several_times(command):
    parser = argparse.ArgumentParser()
    import_module(f"twip.commands.{command}").declare(parser)
    lists = [action for action in parser._actions if action.option_strings and action.nargs in ("+", "*")]
    assert [action.option_strings[0] for action in lists if not isinstance(action, argparse._ExtendAction)] == []


@pytest.mark.parametrize(
    ("option", "first", "second"),
    [
        ("--start-values", ["a", "1"], ["b", "2"]),
        ("--parameters", ["x.ssv"], ["y.ssv", "z.ssv"]),
        ("--swap", ["c=d.fmu"], ["e=f.fmu"]),
        ("--swap-map", ["c=d.toml"], ["e=f.toml"]),
        ("--mid-step", [], ["a.b"]),
        ("--order", ["a"], ["b"]),
        ("--own-step", ["a=1"], ["b=2"]),
    ],
)
def test_values_of_an_option_given_twice_add_up(option, first, second):
    parser = argparse.ArgumentParser()
    declare_experiment(parser)
    for _ in range(2):  # the default is not the list that is added to
        found = parser.parse_args([option, *first, option, *second])
        assert getattr(found, option.removeprefix("--").replace("-", "_")) == [*first, *second]


@pytest.mark.parametrize("declare", [container, sweep])
def test_containers_and_sweeps_add_up_too(declare):
    parser = argparse.ArgumentParser()
    declare(parser)
    found = parser.parse_args(
        ["x.ssp", *shlex.split("--start-values a 1 --start-values b 2 --parameters x --parameters y")]
    )
    assert (found.start_values, found.parameters) == (["a", "1", "b", "2"], ["x", "y"])


def test_a_name_given_in_two_options_is_refused_as_in_one():
    parser = argparse.ArgumentParser()
    declare_experiment(parser)
    found = parser.parse_args(shlex.split("--start-values a 1 --start-values a 2 --swap c=d --swap c=e"))
    with pytest.raises(TwipError, match="--start-values: a is given more than once"):
        pairs(found.start_values)
    with pytest.raises(TwipError, match="--swap: c is given more than once"):
        swaps("--swap", found.swap)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("run x.ssp --stop-time 10s", "twip run: error: argument --stop-time: invalid float value: '10s'"),
        ("run x.ssp --coupling gauss", "twip run: error: argument --coupling: invalid choice: 'gauss'"),
        ("run", "twip run: error: the following arguments are required: ssp"),
        ("sweep x.ssp --jbos 3", "twip sweep: error: unrecognized arguments: --jbos 3"),
        ("rnu x.ssp", "twip: error: argument COMMAND: invalid choice: 'rnu'"),
        ("--quiet run x.ssp", "twip: error: unrecognized arguments: --quiet"),
        ("", "twip: error: the following arguments are required: COMMAND"),
    ],
)
def test_a_mistake_in_the_options_is_one_line(words, told, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words.split())
    assert ended.value.code == 2
    printed = capsys.readouterr()
    lines = printed.err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(told)
    assert lines[0].endswith(f"({told.partition(': error')[0]} --help explains the options)")
    assert printed.out == ""
