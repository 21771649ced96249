"""The readings that an ICC profile carries: the CGATS text that it was made from.

ICC.1:2022, 9.2.14, gives ``targ`` for that; ArgyllCMS' colprof, and so DisplayCAL, put the whole .ti3 there, and again
into the private tags ``CIED`` and ``DevD``, which are other programs' for colours and drive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.icc_tags import tag_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.icc_tags import Tag

#: Tags that may hold readings, the standard's first.
TAGS = ("targ", "CIED", "DevD")

#: Columns without which a text is none of a display's readings: drive, and a colour.
_NEEDED = ((b"RGB_R",), (b"XYZ_X", b"XYY_X", b"LAB_L"))


def readings_in(data: bytes, file: str) -> tuple[str, bytes]:
    """Return the first tag of a profile that holds readings, and its text.

    Raises
    ------
    LutgenError
        No such tag, or the profile's table lies.

    """
    tags = tag_table(data, file)
    for name, text in _texts(data, tags):
        if all(any(column in text.upper() for column in columns) for columns in _NEEDED):
            return name, text
    message = (
        f"{file}: is an ICC profile without readings in its tags {', '.join(TAGS)} as text; they are in the .ti3 or "
        "CGATS file that it was made from."
    )
    raise LutgenError(message)


def _texts(data: bytes, tags: tuple[Tag, ...]) -> Iterator[tuple[str, bytes]]:
    for wanted in TAGS:
        for tag in tags:
            content = data[tag.start : tag.start + tag.size]
            if tag.name == wanted and content[:4] == b"text":
                yield wanted, content[8:].partition(b"\0")[0]
