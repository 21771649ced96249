"""docs/reference agrees with the code."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from docs.generate.__main__ import REFERENCE, generated, pages
from docs.generate.effects import CAUSES, MOST, plot
from docs.generate.markup import docstring
from lutgen.effects import catalogue

pytestmark = pytest.mark.texts

STALE = "docs/reference is stale: run make reference"

#: Permitted mean difference of a plot in codes of 255: another matplotlib changes edges, but not curves.
MEAN_DIFFERENCE = 1.0


def test_every_page_is_what_the_code_says_and_none_is_of_what_is_gone() -> None:
    texts = pages()
    assert generated() == set(texts), STALE
    for path, text in texts.items():
        assert (REFERENCE / path).read_text(encoding="utf-8") == text, f"{path}: {STALE}"


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue())
def test_an_effects_plot_is_what_lutgen_draws_and_small(name: str) -> None:
    path = REFERENCE / "effects" / f"{name}.png"
    assert path.stat().st_size <= MOST
    with Image.open(path) as kept, Image.open(BytesIO(plot(name))) as drawn:
        assert kept.size == drawn.size, STALE
        pixels = [np.asarray(image.convert("RGB"), dtype=np.float64) for image in (kept, drawn)]
    assert np.abs(pixels[0] - pixels[1]).mean() <= MEAN_DIFFERENCE, STALE


def test_every_effect_says_what_0_and_1_mean_where_it_holds_and_what_it_rests_on() -> None:
    for effect in catalogue().values():
        lines = effect.text.splitlines()
        assert any(line.startswith("Meaning of 0 and 1:") for line in lines), effect.name
        assert any(line.startswith("Valid ") for line in lines), effect.name
        assert any(line.startswith(("Source:", "Sources:", "Assumption:")) for line in lines), effect.name
        assumed = any(line.startswith("Assumption:") for line in lines)
        assert assumed or "assumption" not in effect.source, effect.name
        assert ".md" not in effect.text + effect.source, f"{effect.name} cites a page that the repository lacks"


def test_every_effect_but_the_choice_of_a_matrix_has_a_cause() -> None:
    physical = {name for name, effect in catalogue().items() if effect.stage != "selection"}
    assert {name for names in CAUSES.values() for name in names} == physical


def test_a_docstring_becomes_markdown() -> None:
    text = "Read ``x`` of :class:`~lutgen.Page`.\n\nParameters\n----------\nx, y\n    Numbers,\n    two.\nz\n    One.\n"
    assert docstring(text) == "Read `x` of `Page`.\n\n**Parameters**\n\n- `x, y`: Numbers, two.\n- `z`: One."
