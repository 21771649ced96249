"""ICC profiles with one fault each, and the result in each reader according to lint's rules."""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler
from lutgen.display import DisplayModel, default_display
from lutgen.lint.finding import ARGYLL, CHROMIUM, LCMS_8, READS, REFUSES, WRONG
from lutgen.readings import read_measurements


@cache
def profile_of(name: str, hours: float) -> bytes:
    """Return a profile of the default display; at hour 0 with the screen's white, because a separate claim covers other
    whites.
    """
    aged = DisplayModel(read_measurements(default_display()), selection="continuous").at("chroma-luma", hours)
    form = format_named(name)
    return form.write(form.bake(Sampler(), aged, 17)[0], Provenance("display", "display", ("lutgen: invented",)))


@dataclass(frozen=True)
class Case:
    """A fault: the profile, the code that makes the fault, the result in each reader, the rule that reports it."""

    form: str
    change: Callable[[bytes], bytes]
    outcomes: Mapping[str, str]
    rule: str

    @property
    def whole(self) -> bytes:
        return profile_of(self.form, 0)

    @property
    def data(self) -> bytes:
        return self.change(self.whole)


def put(data: bytes, place: int, value: bytes) -> bytes:
    return data[:place] + value + data[place + len(value) :]


def row_of(data: bytes, tag: bytes) -> int:
    count = int.from_bytes(data[128:132], "big")
    return next(132 + 12 * row for row in range(count) if data[132 + 12 * row :][:4] == tag)


def moved(data: bytes, tag: bytes, start: int) -> bytes:
    return put(data, row_of(data, tag) + 4, struct.pack(">I", start))


def without(data: bytes, tag: bytes) -> bytes:
    return put(data, row_of(data, tag), b"none")


def in_table(data: bytes, place: int, value: int) -> bytes:
    start = int.from_bytes(data[row_of(data, b"A2B0") + 4 :][:4], "big")
    return put(data, start + place, bytes([value]))


def number(value: int) -> bytes:
    return struct.pack(">I", value)


def unchanged(data: bytes) -> bytes:
    return data


#: The picture that is shown through each profile.
PIXELS = np.random.default_rng(41).integers(0, 256, (16, 16, 3), dtype=np.uint8)

_EVERYTHING = {LCMS_8: READS, ARGYLL: READS, CHROMIUM: READS}
_VERSION_4 = _EVERYTHING | {ARGYLL: REFUSES}
_NOTHING = {LCMS_8: REFUSES, ARGYLL: REFUSES, CHROMIUM: WRONG}

CASES: dict[str, Case] = {
    "a table": Case("icc", unchanged, _VERSION_4, "profile-version"),
    "a table of version 2": Case("icc-v2", unchanged, _EVERYTHING | {CHROMIUM: WRONG}, "profile-table"),
    "a matrix": Case("icc-matrix", unchanged, _EVERYTHING, ""),
    "says more bytes": Case(
        "icc-matrix", lambda data: put(data, 0, number(len(data) + 100)), _EVERYTHING, "profile-size"
    ),
    "bytes behind the end": Case("icc-matrix", lambda data: data + bytes(101), _EVERYTHING, "profile-size"),
    "says fewer bytes": Case(
        "icc-matrix", lambda data: put(data, 0, number(len(data) - 100)), _NOTHING | {CHROMIUM: READS}, "profile-size"
    ),
    "a table cut off": Case("icc-v2", lambda data: data[:-1000], dict.fromkeys(_NOTHING, WRONG), "profile-tags"),
    "a matrix cut off": Case("icc-matrix", lambda data: data[:-1000], _NOTHING, "profile-parts"),
    "a table beyond the end": Case(
        "icc-v2", lambda data: moved(data, b"A2B0", 2**31), _NOTHING | {LCMS_8: WRONG}, "profile-tags"
    ),
    "a primary beyond the end": Case("icc-matrix", lambda data: moved(data, b"rXYZ", 2**31), _NOTHING, "profile-parts"),
    "a title beyond the end": Case(
        "icc-matrix", lambda data: moved(data, b"desc", 2**31), _NOTHING | {LCMS_8: READS}, "profile-tags"
    ),
    "no title": Case("icc-matrix", lambda data: without(data, b"desc"), _EVERYTHING, "profile-parts"),
    "no copyright": Case("icc-matrix", lambda data: without(data, b"cprt"), _EVERYTHING, "profile-parts"),
    "no red": Case("icc-matrix", lambda data: without(data, b"rXYZ"), _NOTHING, "profile-parts"),
    "no curve": Case("icc-matrix", lambda data: without(data, b"bTRC"), _NOTHING, "profile-parts"),
    "points that are not there": Case(
        "icc-v2",
        lambda data: in_table(data, 10, 255),
        {LCMS_8: REFUSES, ARGYLL: WRONG, CHROMIUM: WRONG},
        "profile-table",
    ),
    "a single point": Case("icc-v2", lambda data: in_table(data, 10, 1), _NOTHING, "profile-table"),
    "fewer points": Case(
        "icc-v2", lambda data: in_table(data, 10, 16), dict.fromkeys(_NOTHING, WRONG), "profile-table"
    ),
    "four inks": Case("icc-v2", lambda data: in_table(data, 8, 4), _NOTHING | {ARGYLL: WRONG}, "profile-table"),
    "version 4, cut off": Case("icc", lambda data: data[:-1000], _NOTHING | {LCMS_8: WRONG}, "profile-tags"),
    "version 4, a table beyond the end": Case(
        "icc", lambda data: moved(data, b"A2B0", 2**31), _NOTHING | {LCMS_8: WRONG}, "profile-tags"
    ),
    "version 4, points that are not there": Case(
        "icc", lambda data: in_table(data, 68, 255), _NOTHING, "profile-table"
    ),
    "version 4, a single point": Case("icc", lambda data: in_table(data, 70, 1), _NOTHING, "profile-table"),
    "version 4, four inks": Case("icc", lambda data: in_table(data, 8, 4), _NOTHING, "profile-table"),
    "version 4, numbers beyond the end": Case("icc", lambda data: in_table(data, 25, 255), _NOTHING, "profile-table"),
    "version 1": Case(
        "icc-matrix", lambda data: put(data, 8, b"\x01"), _EVERYTHING | {CHROMIUM: WRONG}, "profile-version"
    ),
    "version 4": Case(
        "icc-matrix", lambda data: put(data, 8, b"\x04"), _EVERYTHING | {ARGYLL: REFUSES}, "profile-version"
    ),
    "version 5": Case(
        "icc-matrix", lambda data: put(data, 8, b"\x05\x00"), _NOTHING | {LCMS_8: READS}, "profile-version"
    ),
    "version 5.4": Case("icc-matrix", lambda data: put(data, 8, b"\x05@"), _NOTHING, "profile-version"),
    "version 9": Case("icc-matrix", lambda data: put(data, 8, b"\t"), _NOTHING, "profile-version"),
    "a printer's": Case("icc-matrix", lambda data: put(data, 12, b"prtr"), _EVERYTHING, "profile-id"),
    "of no class": Case("icc-matrix", lambda data: put(data, 12, b"xxxx"), _NOTHING, "profile-header"),
    "named colours": Case(
        "icc-matrix", lambda data: put(data, 12, b"nmcl"), _NOTHING | {CHROMIUM: READS}, "profile-header"
    ),
    "for greys": Case("icc-matrix", lambda data: put(data, 16, b"GRAY"), _NOTHING | {ARGYLL: READS}, "profile-header"),
    "another ID": Case("icc-matrix", lambda data: put(data, 84, bytes([7] * 16)), _EVERYTHING, "profile-id"),
    "no ID": Case("icc-matrix", lambda data: put(data, 84, bytes(16)), _EVERYTHING, ""),
    "no signature": Case("icc-matrix", lambda data: put(data, 36, b"xxxx"), _NOTHING, "profile-header"),
    "101 tags": Case(
        "icc-matrix", lambda data: put(data, 128, number(101)), _NOTHING | {CHROMIUM: READS}, "profile-tags"
    ),
    "4 thousand million tags": Case(
        "icc-matrix", lambda data: put(data, 128, number(2**32 - 1)), _NOTHING, "profile-tags"
    ),
    "no tags": Case("icc-matrix", lambda data: put(data, 128, number(0)), _NOTHING, "profile-parts"),
    "a tag twice": Case(
        "icc-matrix",
        lambda data: put(data, row_of(data, b"cprt"), data[row_of(data, b"gXYZ") : row_of(data, b"gXYZ") + 12]),
        _NOTHING | {ARGYLL: READS, CHROMIUM: READS},
        "profile-tags",
    ),
    "a tag twice, elsewhere": Case(
        "icc-matrix",
        lambda data: put(
            data, row_of(data, b"cprt"), b"rXYZ" + data[row_of(data, b"gXYZ") + 4 : row_of(data, b"gXYZ") + 12]
        ),
        _NOTHING | {CHROMIUM: READS},
        "profile-tags",
    ),
    "tags across each other": Case(
        "icc-matrix",
        lambda data: moved(data, b"cprt", int.from_bytes(data[row_of(data, b"desc") + 4 :][:4], "big") + 4),
        _EVERYTHING,
        "profile-tags",
    ),
    "empty": Case("icc-matrix", lambda _: b"", _NOTHING, "profile-header"),
}
