"""ICC device link from the source signal to the viewer's code values: the table of a .cube in 16 bit.

It is for programs that convert pictures (LittleCMS' ``jpgicc`` and ``tificc``, Argyll's ``cctiff``, ImageMagick, print
servers). Viewers need a profile instead: the format ``icc``.
"""

from lutgen.bake import icc_profile as icc
from lutgen.bake.formats import Format, Provenance, Reader
from lutgen.bake.littlecms import table_of_profile, through_profile
from lutgen.bake.lut import Lut, MatrixLut, table_of


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    tags = (
        (b"desc", icc.description(provenance.title)),
        (b"cprt", icc.text("none")),
        (b"targ", icc.text("\n".join(provenance.lines))),
        (b"pseq", icc.sequence("source signal, sRGB", "aged display, as an un-aged sRGB viewer shows it")),
        (b"A2B0", icc.table(table_of(lut))),
    )
    return icc.profile(device_class=b"link", pcs=b"RGB ", tags=tags)


FORMAT = Format(
    name="devicelink",
    suffix=".icc",
    unclipped=False,
    write=_write,
    largest=icc.LARGEST,
    reader=Reader(through_profile, table_of_profile),
    stem="aged-link",
)
