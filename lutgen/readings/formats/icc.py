"""The readings inside an ICC profile: the CGATS text from which the profile was made.

ICC.1:2022, 9.2.14, defines the tag ``targ`` for this text. ArgyllCMS' colprof, and so DisplayCAL, write the whole .ti3
into ``targ``, and again into the private tags ``CIED`` and ``DevD``, in which other programs store colours and drive.
"""

from collections.abc import Iterator
from dataclasses import replace

from lutgen.errors import LutgenError
from lutgen.icc_tags import Tag, is_profile, tag_table
from lutgen.readings.formats import cgats
from lutgen.readings.formats._source import FileText, decoded
from lutgen.readings.session import Session

NAME = "ICC profile with readings"
SUFFIXES = (".icc", ".icm")

#: Tags that may hold readings; the standard's tag first.
TAGS = ("targ", "CIED", "DevD")

#: Groups of columns; readings of a display have at least one column of each group: drive and colour.
_NEEDED = ((b"RGB_R",), (b"XYZ_X", b"XYY_X", b"LAB_L"))


def claims(source: FileText) -> bool:
    """Whether the file is an ICC profile, with or without readings."""
    return is_profile(source.data)


def read(source: FileText) -> Session:
    """Read the session in a profile. Raises LutgenError: no tag holds valid readings, or the table is wrong."""
    tag, text = _readings_in(source.data, source.file)
    session = cgats.read(FileText(decoded(text, source.file), f"{source.file}, tag {tag}", source.sha256))
    remark = f"Read from the tag {tag} of an ICC profile: the readings that it was made from."
    return replace(session, file=source.file, remarks=(remark, *session.remarks))


def _readings_in(data: bytes, file: str) -> tuple[str, bytes]:
    """Return the name and the text of the first tag of a profile with readings."""
    tags = tag_table(data, file)
    for name, text in _texts(data, tags):
        if all(any(column in text.upper() for column in columns) for columns in _NEEDED):
            return name, text
    raise LutgenError(
        f"{file}: is an ICC profile without readings in its tags {', '.join(TAGS)} as text; they are in the .ti3 or "
        "CGATS file that it was made from."
    )


def _texts(data: bytes, tags: tuple[Tag, ...]) -> Iterator[tuple[str, bytes]]:
    for name in TAGS:
        for tag in tags:
            content = data[tag.start : tag.start + tag.size]
            if tag.name == name and content[:4] == b"text":
                yield name, content[8:].partition(b"\0")[0]
