"""The text of a config is OpenColorIO's own text, whatever config it was made from."""

from dataclasses import replace
from itertools import product

import pytest

from lutgen import DisplayModel, read_measurements
from lutgen.bake import config
from lutgen.bake.config import SIMULATION, AgedConfig, config_text
from lutgen.bake.plan import BuildPlan, display_to_bake
from lutgen.bake.provenance import config_of_all, config_of_display
from lutgen.display import MODES, default_display
from lutgen.names import DIRECTIONS, UNREACHABLE

HOURS = (0.0, 600.0, 9600.5, 18_000.0)


@pytest.mark.parametrize(("direction", "unreachable"), list(product(DIRECTIONS, UNREACHABLE)))
def test_every_display_has_the_words_that_opencolorio_gives_it(direction: str, unreachable: str) -> None:
    model, config._SERIALISED = DisplayModel(read_measurements(default_display())), {}
    for mode, hours, unclipped in product(MODES, HOURS, (False, True)):
        aged = display_to_bake(model, mode, hours, direction=direction, unreachable=unreachable)
        written = config_of_display(aged, "aged.cube", unclipped=unclipped)
        assert config_text(written) == config._serialised(written)
    assert len(config._SERIALISED) < len(MODES) * len(HOURS) * 2


@pytest.mark.parametrize(
    "description", ["plain words", "a: b", 'a "b"', "it's", "two\nlines", "ü", "12", "# 1", "[1]", ""]
)
def test_what_stands_in_quotes_or_on_lines_of_its_own_is_worded_too(description: str) -> None:
    for name, text in product(("a_1", "b_2", "aged"), (description, description.replace("1", "2"), "c: d 1")):
        written = AgedConfig(name, text, "aged.cube", {}, SIMULATION)
        assert config_text(written) == config._serialised(written)


def test_the_words_name_an_hour_as_its_folder_does() -> None:
    plan = BuildPlan(hours=(0.0, 10_234.75))
    common = config_of_all(plan, "aged.cube", unclipped=False)
    assert "AGING_HOURS (0 to 10234.75)" in common.description
    assert common.environment["AGING_HOURS"] == "10234.75"


def test_what_differs_otherwise_is_worded_by_itself() -> None:
    first = AgedConfig("a_1", "a: 1", "aged.cube")
    for other in (replace(first, lut="aged.clf"), replace(first, environment={"AGING_MODE": "chroma"})):
        assert config_text(first) != config_text(other)
        assert config_text(other) == config._serialised(other)
