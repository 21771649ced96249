"""The colours of a certificate: the share of the largest error that they find."""

import pytest

from lutgen import DisplayModel, read_measurements
from lutgen.bake import fidelity
from lutgen.bake.fidelity import CERTIFIED, Counts, Judge, certificate_colours
from lutgen.bake.lut import Sampler
from lutgen.bake.readback import TableKind
from lutgen.display import default_display
from tests.quick import mostly_slow

pytestmark = pytest.mark.numbers

#: Ten times as many colours, half of them where tables have the largest errors.
MANY = Counts(150_000, 0, 0, 0, 150_000)


@pytest.mark.parametrize("hours", mostly_slow([6_000.0, 18_000.0], 18_000.0))
@pytest.mark.parametrize("mode", mostly_slow(["chroma", "chroma-luma"], "chroma"))
def test_seven_tenths_of_the_largest_smooth_error_are_found(
    mode: str, hours: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    aged = DisplayModel(read_measurements(default_display())).at(mode, hours)
    lut, kind = Sampler().lut(aged, 33, "code", clip=True), TableKind("code", 33, clipped=True)
    few, many = Judge(), Judge()
    certified = few.compare(few.shown(lut), aged, kind)
    many.code = certificate_colours(MANY)
    monkeypatch.setattr(fidelity, "CERTIFIED", MANY)
    exact = many.compare(many.shown(lut), aged, kind)
    assert exact.smooth.colours > 2 * sum(CERTIFIED)
    assert certified.smooth.max >= 0.7 * exact.smooth.max
