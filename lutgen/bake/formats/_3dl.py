"""Autodesk's ``.3dl`` for Flame and Lustre: 12-bit integers, blue fastest, after a line of lattice places.

Readers guess the bit depth from the largest number in the file. A display whose brightest channel stays below half of
the code values would be shown twice as bright. lutgen therefore writes no file for such a display.
"""

import numpy as np

from lutgen.bake.formats import Format, Provenance
from lutgen.bake.lut import Lut, MatrixLut, Sampler, table_of
from lutgen.display import AgedDisplay
from lutgen.errors import LutgenError
from lutgen.numerals import in_percent

#: Largest number of the table, and of the line of places. With 1024 the places of 17, 33 and 65 points are integers in
#: equal steps, as three.js requires. OpenColorIO treats 1023 and 1024 alike, as 10 bit without a curve.
LARGEST, LARGEST_PLACE = 4095, 1024


def candidates(sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
    """Return the table indexed by code values, clipped to sRGB and quantised to 12 bit."""
    luts = sampler.candidates(aged, size, "code", clip=True, largest=LARGEST)
    brightest = table_of(luts[0]).max() * LARGEST
    if brightest <= LARGEST // 2:
        raise LutgenError(
            f"{aged.mode} at {aged.hours:g} h: a .3dl cannot hold a display whose brightest code value is "
            f"{in_percent(brightest / LARGEST)} of the viewer's, since readers guess its depth from the largest "
            f"number. Leave the format 3dl out, or that hour."
        )
    return luts


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    places = " ".join(str(round(place)) for place in np.linspace(0, LARGEST_PLACE, lut.size))
    values = np.rint(table_of(lut).transpose(2, 1, 0, 3).reshape(-1, 3) * LARGEST).astype(int)
    number = [b"%d" % value for value in range(LARGEST + 1)]
    rows = b"".join(b"%s %s %s\n" % (number[red], number[green], number[blue]) for red, green, blue in values.tolist())
    return b"".join((provenance.comments(), places.encode(), b"\n", rows))


FORMAT = Format(name="3dl", suffix=".3dl", unclipped=False, write=_write, candidates=candidates)
