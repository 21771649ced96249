"""ICC profiles: header, tag table, heads of tables, LittleCMS' result for white, and what readers do with faults."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from lutgen.bake.littlecms import through_profile
from lutgen.bindings import LARGEST_LUT, littlecms
from lutgen.cells import first_doubled
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.icc_tags import HEADER, MOST_TAGS, SMALLEST_TAG, Tag, identifier, is_profile, tags_claimed
from lutgen.lint.finding import ARGYLL, CHROMIUM, LCMS_8, LCMS_16, Fate, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.stream import readable

#: Tags of a matrix with curves.
MATRIX = ("rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC")

#: Further tags that the standard requires (ICC.1:2001-04, 6.3). No reader needs them to show pictures.
REQUIRED = {"profile": ("desc", "cprt", "wtpt"), "link": ("desc", "cprt", "pseq")}

#: Classes that describe a device or a space, and other classes (ICC.1:2022, 7.2.7).
DEVICES, OTHERS = ("mntr", "scnr", "prtr", "spac"), ("link", "abst", "nmcl")

#: The fate of Chromium with every profile that it refuses.
IGNORED = wrong(CHROMIUM, how="ignores the profile and shows the picture unchanged")

#: Maximum number of padding bytes after a table.
PADDING = 3

#: A white within this distance of the screen's white counts as equal: one code of 255.
SAME = 1 / 255

#: Tags of tables from the device's colours. A device link has only the first.
TABLES = ("A2B0", "A2B1", "A2B2")

#: Type of an 8-bit or a 16-bit table → bytes before its curves (ICC.1:2022, 10.10 and 10.11), and bytes per number.
_HEADS = {b"mft1": (48, 1), b"mft2": (52, 2)}

#: The table type of version 4 (ICC.1:2022, 10.12), bytes of its head, and bytes of the head of its block of numbers.
_V4, _V4_HEAD, _V4_NUMBERS = b"mAB ", 32, 20


class TableHead(NamedTuple):
    """The head of a table of type mft1, mft2 or mAB.

    ``points`` is the smallest number of points along an edge. ``needs`` is the number of bytes that the tag needs.
    """

    tag: Tag
    kind: bytes
    inputs: int
    outputs: int
    points: int
    needs: int


@dataclass(frozen=True)
class ProfileScan:
    """The result of a scan of a profile."""

    #: Size of the file in bytes, and its first 128 bytes.
    length: int
    head: bytes
    #: Number of tags that the tag table states, and the tags that were read, at most ``MOST_TAGS``.
    count: int
    tags: tuple[Tag, ...]
    #: Heads of the tables of types mft1, mft2 and mAB that begin in the file.
    tables: tuple[TableHead, ...]
    #: Whether the MD5 in the header equals the MD5 of the profile; None when the header has no MD5.
    identifier: bool | None
    #: LittleCMS' code values on an sRGB screen for code 1, 1, 1, in floating point; None when LittleCMS fails.
    white: Array | None
    #: The reason why LittleCMS could not be used; empty when it was used.
    unasked: str = ""

    @property
    def size(self) -> int:
        """The size in bytes, as its header states it."""
        return int.from_bytes(self.head[:4], "big")

    @property
    def version(self) -> tuple[int, int]:
        """Its version, for example (2, 4)."""
        return (self.head[8], self.head[9] >> 4) if len(self.head) >= 10 else (0, 0)

    def word(self, start: int) -> str:
        """Return the four letters of the header from byte ``start`` on."""
        return self.head[start : start + 4].decode("latin-1")

    @property
    def link(self) -> bool:
        """Whether it is a device link."""
        return self.word(12) == "link"

    def has(self, *names: str) -> bool:
        """Whether the tag table has all these tags and each of them lies in the file."""
        return set(names) <= {tag.name for tag in self.tags if tag.start + tag.size <= self.length}


def scan_profile(path: Path) -> ProfileScan:
    """Scan a profile. Of a huge profile scan only the heads. Raises LutgenError: the profile cannot be read."""
    with readable(path, "a profile"), path.open("rb") as file:
        start = file.read(HEADER + 4 + 12 * MOST_TAGS)
        size = path.stat().st_size
        tags = tuple(tags_claimed(start))
        inside = [tag for tag in tags if tag.name in TABLES and tag.start < size]
        tables = tuple(head for tag in inside if (head := _table(tag, file)))
        whole = size <= LARGEST_LUT and is_profile(start)
        file.seek(0)
        data = file.read() if whole else b""
        sound = identifier(data) == data[84:100] if any(data[84:100]) else None
    count = int.from_bytes(start[HEADER : HEADER + 4], "big")
    white, unasked = _white(path) if whole and count <= MOST_TAGS else (None, "")
    return ProfileScan(size, start[:HEADER], count, tags, tables, sound, white, unasked)


def _table(tag: Tag, file: BinaryIO) -> TableHead | None:
    file.seek(tag.start)
    head = file.read(_HEADS[b"mft2"][0])
    kind = head[:4]
    if kind == _V4 and len(head) >= _V4_HEAD:
        return _table_v4(tag, head, file)
    if kind not in _HEADS or len(head) < _HEADS[kind][0]:
        return None
    start, width = _HEADS[kind]
    inputs, outputs, points = head[8:11]
    curves = [256, 256] if width == 1 else [int.from_bytes(head[place : place + 2], "big") for place in (48, 50)]
    numbers = inputs * curves[0] + points**inputs * outputs + outputs * curves[1]
    return TableHead(tag, kind, inputs, outputs, points, start + width * numbers)


def _table_v4(tag: Tag, head: bytes, file: BinaryIO) -> TableHead | None:
    """Return the head of a table of version 4; None when the tag holds only curves and a matrix."""
    inputs, outputs = head[8:10]
    place = int.from_bytes(head[24:28], "big")
    if not place:
        return None
    file.seek(tag.start + place)
    numbers = file.read(_V4_NUMBERS).ljust(_V4_NUMBERS, b"\0")
    points = numbers[: min(inputs, 16)]
    needs = place + _V4_NUMBERS + prod(points) * outputs * numbers[16]
    return TableHead(tag, _V4, inputs, outputs, min(points, default=0), needs)


def _white(path: Path) -> tuple[Array | None, str]:
    try:
        littlecms()
    except LutgenError as error:
        return None, str(error)
    try:
        white: Array = through_profile(path, np.ones((1, 3)))[0]
    except LutgenError:
        return None, ""
    return (white if np.isfinite(white).all() else None), ""


def profile_header(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find faults of the header. Browsers ignore a profile that they cannot use, without a message."""
    everyone = refused(LCMS_8, LCMS_16, ARGYLL, how="opens no such profile") | IGNORED
    if not is_profile(scan.head):
        fact = "is empty" if not scan.length else "is not an ICC profile: the signature acsp is missing"
        yield LintFinding(fact, "Export it again.", 0, everyone)
        return
    kind, space = scan.word(12), scan.word(16)
    if kind not in (*DEVICES, *OTHERS):
        yield LintFinding(f"is of class {kind!r}, which does not exist", "Export it as a display profile.", 0, everyone)
    elif kind in {"abst", "nmcl"}:
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert with it")
        yield LintFinding(f"is of class {kind!r}, which no picture has", "Export it as a display profile.", 0, fates)
    if space != "RGB ":
        fates = refused(LCMS_8, LCMS_16, how="does not take it for RGB pictures") | IGNORED
        yield LintFinding(f"is for colours of {space!r}, and displays are RGB", "Export it for RGB.", 0, fates)
    if not scan.link and scan.word(20) not in {"XYZ ", "Lab "}:
        fact = f"has the connection space {scan.word(20).strip()!r}, and only XYZ and Lab are allowed"
        yield LintFinding(fact, "Export it again.", 0, everyone)


def profile_size(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find a wrong size in the header. Readers accept a wrong size as long as they find all tags."""
    if scan.length > LARGEST_LUT:
        fact = f"has {scan.length >> 20} MiB, more than any profile"
        yield LintFinding(fact, "Is it the right file?")
    if is_profile(scan.head) and scan.size != scan.length:
        outside = [tag for tag in scan.tags if scan.size < tag.start + tag.size <= scan.length]
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="ignores tags after that size") if outside else {}
        fact = f"states a size of {scan.size} bytes, and has {scan.length}"
        yield LintFinding(fact, "Copy or export it again.", 0, fates)


def profile_version(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find unsupported versions. Every reader accepts version 2. Argyll accepts only version 2, Chromium 2 to 4."""
    if not is_profile(scan.head):
        return
    major, minor = scan.version
    fates: dict[str, Fate] = {}
    if major >= 4:
        fates |= refused(ARGYLL, how="reads version 2 only")
    if not 2 <= major <= 4:
        fates |= IGNORED
    # 5.0 is the newest version that LittleCMS opens.
    if scan.version > (5, 0):
        fates |= refused(LCMS_8, LCMS_16, how="does not know this version")
    if fates:
        yield LintFinding(f"is of version {major}.{minor}", "Export it as version 2 for these readers.", 0, fates)


def profile_id(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find a wrong ID (MD5). No reader checks the ID, but a wrong ID shows that the profile was changed."""
    if scan.identifier is False:
        yield LintFinding("has a wrong ID: the profile was changed after it was written", "Export it again.")


def profile_tags(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find faults of the tag table. The rule ``profile-parts`` reports the effect of tags outside the file."""
    if not is_profile(scan.head):
        return
    possible = max(0, scan.length - HEADER - 4) // 12
    most = min(MOST_TAGS, possible)
    if scan.count > most:
        fact = f"claims {scan.count} tags, and {most} are the most that a file of this size may have"
        ignored = IGNORED if scan.count > possible else {}
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="opens no such profile") | ignored
        yield LintFinding(fact, "It was cut off or damaged; export it again.", 0, fates)
        return  # the bytes after the real tags are no tag table
    outside = [tag for tag in scan.tags if tag.start + tag.size > scan.length or tag.size < SMALLEST_TAG]
    if outside:
        fact = f"has the tag {outside[0].name!r} outside the file"
        fates = _fates_outside(scan, outside) | IGNORED
        yield LintFinding(fact, "It was cut off or damaged; export it again.", 0, fates)
    names = [tag.name for tag in scan.tags]
    doubled = first_doubled(names)
    if doubled:
        fates = refused(LCMS_8, LCMS_16, how="opens no such profile")
        if len({tag for tag in scan.tags if tag.name == doubled}) > 1:
            fates |= refused(ARGYLL, how="opens no such profile")
        yield LintFinding(f"has the tag {doubled!r} twice", "Export it again.", 0, fates)
    across = _overlapping(scan.tags)
    if across:
        one, other = across
        fact = f"has the tags {one.name!r} and {other.name!r} sharing some bytes"
        yield LintFinding(fact, "It was edited by hand; export it again.")


def _fates_outside(scan: ProfileScan, outside: list[Tag]) -> dict[str, Fate]:
    """Return the fates for tags outside the file. LittleCMS skips them all, Argyll those that begin inside."""
    far = any(tag.start >= scan.length for tag in outside)
    readers = (LCMS_8, LCMS_16) if far else (LCMS_8, LCMS_16, ARGYLL)
    uses_matrix = any(tag.name == "A2B0" for tag in outside) and scan.has(*MATRIX)
    fates = wrong(*readers, how="uses the matrix without an error") if uses_matrix else {}
    return fates | (refused(ARGYLL, how="opens no such file") if far else {})


def _overlapping(tags: tuple[Tag, ...]) -> tuple[Tag, Tag] | None:
    """Return two tags that share some but not all of their bytes. Tags may share all bytes, as curves often do."""
    ordered = sorted({(tag.start, tag.size): tag for tag in tags}.values(), key=lambda tag: tag.start)
    return next(((one, other) for one, other in pairwise(ordered) if other.start < one.start + one.size), None)


def profile_parts(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find missing tags. A display profile needs a table or a matrix with curves. A device link needs a table."""
    if scan.word(12) not in (*DEVICES, "link"):
        return
    needed = "a table (A2B0)" if scan.link else f"a table (A2B0) or all of {', '.join(MATRIX)}"
    if not (scan.has("A2B0") or (not scan.link and scan.has(*MATRIX)) or scan.has("D2B0")):
        fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert with it") | IGNORED
        yield LintFinding(f"lacks {needed}", "Export it again.", 0, fates)
    missing = [name for name in REQUIRED["link" if scan.link else "profile"] if not scan.has(name)]
    if missing:
        yield LintFinding(f"lacks {', '.join(missing)}, which the standard requires", "Export it again.")


def profile_table(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find faults of tables. Every reader misreads a table of version 2 with more bytes than its head states."""
    for table in scan.tables:
        shape = f"{table.tag.name} states {table.points} points per edge for {table.inputs} colours"
        lacks = table.needs > table.tag.size
        if table.points < 2 or table.inputs != 3 or table.outputs != 3 or lacks:
            fact = f"{shape} to {table.outputs}"
            fact += f", which is {table.needs} bytes, and it has {table.tag.size}" if lacks else ""
            yield LintFinding(fact, "Export it again.", 0, _fates_unusable(scan, table))
        elif table.kind != _V4 and table.needs + PADDING < table.tag.size:
            fates = wrong(LCMS_8, LCMS_16, ARGYLL, CHROMIUM, how="reads the wrong numbers")
            fact = f"{shape}, which is {table.needs} bytes, and it has {table.tag.size}"
            yield LintFinding(fact, "Export it again.", 0, fates)
    if scan.tables and not scan.link and scan.word(20) == "XYZ ":
        fates = wrong(CHROMIUM, how="shows it half as bright")
        yield LintFinding("has a table of XYZ", "Export it with a table of L*a*b*.", 0, fates)
    if any(table.kind == b"mft2" for table in scan.tables) and not scan.link and scan.word(20) == "Lab ":
        fates = wrong(CHROMIUM, how="reads its numbers as those of version 4, a code or more off")
        remedy = "Export it as version 4 for browsers, with a table of type mAB."
        yield LintFinding("has a table of L*a*b* in the 16 bits of version 2", remedy, 0, fates)
    if scan.link:
        fact = "is a device link: viewers and browsers take profiles, not links"
        yield LintFinding(fact, "Use it to convert pictures.")


def _fates_unusable(scan: ProfileScan, table: TableHead) -> dict[str, Fate]:
    """Return the fates for an unusable table. Readers use a matrix instead; Argyll not for a table of one point."""
    fates = refused(LCMS_8, LCMS_16, ARGYLL, how="cannot convert with it")
    if table.points >= 2 and scan.has(*MATRIX):
        fates |= wrong(ARGYLL, how="uses the matrix without an error")
    return fates | wrong(CHROMIUM, how="uses the matrix, or shows the picture unchanged")


def profile_white(scan: ProfileScan) -> Iterator[LintFinding]:
    """Find a white other than the screen's. LittleCMS maps white to white when it resamples, if not absolute."""
    if scan.unasked:
        yield LintFinding(f"was not checked for its white: {scan.unasked}", "Install it to check.")
    if scan.white is None or np.abs(np.clip(scan.white, 0, 1) - 1).max() <= SAME:
        return
    shown = " ".join(f"{255 * value:.0f}" for value in np.clip(scan.white, 0, 1))
    table = scan.has("A2B0")
    fates = wrong(*([LCMS_8] if table else []), LCMS_16, how="shows code 255 as 255, except with the absolute intent")
    remedy = "Take a profile without a table for 8-bit pictures (icc-matrix), or the absolute intent"
    if not table:
        remedy = "Convert 16-bit pictures, and in Ghostscript all, by the absolute intent"
    remedy += " (vips --intent absolute, gs -dRenderIntent=3, tificc -t3)."
    yield LintFinding(f"shows pure white as {shown}, where the screen's is 255 255 255", remedy, 0, fates)


RULES = (
    profile_header, profile_size, profile_version, profile_id, profile_tags, profile_parts, profile_table,
    profile_white,
)  # fmt: skip


def lint_profile(path: Path, _ask_readers: bool) -> Linted:
    """Lint a profile. Raises LutgenError when it cannot be read."""
    scan = scan_profile(path)
    version = ".".join(map(str, scan.version))
    tables = "".join(f", {table.tag.name} of {table.points}³ points" for table in scan.tables)
    facts = (f"version {version}, class {scan.word(12)!r}, {len(scan.tags)} tags{tables}, {scan.length} bytes",)
    return Linted(path, "link" if scan.link else "profile", facts, tuple(findings(RULES, scan)))


FORMAT = FileKind((".icc", ".icm"), lint_profile, RULES)
