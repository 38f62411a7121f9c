"""What tests of several layers share."""

import pytest

from twip.fmi.build import build_all


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """A folder with `fmus/*.fmu`, `ssp/*.ssp` and the loose parameter sets and inputs, built once."""
    folder = tmp_path_factory.mktemp("built")
    build_all(folder)
    return folder
