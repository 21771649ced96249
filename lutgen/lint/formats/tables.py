"""``.spi3d``, ``.csp`` and ``.3dl``: header and rows, and what OpenColorIO and ffmpeg do with them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path

from lutgen.bindings import unclosed_metadata
from lutgen.cells import NON_FINITE, NUMBER
from lutgen.lint.finding import FFMPEG, OCIO, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.programs import MAX_BYTES, loading, refusal
from lutgen.lint.stream import MAX_KEPT, blocks, shown

_NAN = re.compile(rf"(?i)(?:^|\s){NON_FINITE}(?=\s|$)".encode())
_COMMA = re.compile(rb"\d,\d")

#: Suffix → pattern of a row. Rows of a .spi3d begin with three indices.
_ROW = {
    ".spi3d": re.compile(rb"\s*\d+\s+\d+\s+\d+\s+\S+\s+\S+\s+\S"),
    ".csp": re.compile(rb"\s*\S+\s+\S+\s+\S+\s*$"),
    ".3dl": re.compile(rb"\s*(\d+)\s+(\d+)\s+(\d+)\s*$"),
}
#: The beginning of the mesh line of a .3dl, which lists its input levels: two numbers.
_MESH = re.compile(rb"\s*\d+\s+\d")

#: The line with the table's size. OpenColorIO reads 2x as 2: letters after a number must not hide a huge size.
_SIZE = re.compile(rb"\s*(\d+)\s+(\d+)\s+(\d+)\S*\s*$")

#: Suffix → pattern of a line that holds only numbers.
_SOUND = {
    ".spi3d": re.compile(rf"\s*\d+\s+\d+\s+\d+(?:\s+{NUMBER}\s+{NUMBER}\s+{NUMBER})?\s*$".encode()),
    ".csp": re.compile(rf"(?:\s*{NUMBER}(?=\s|$))*\s*$".encode()),
    ".3dl": re.compile(rb"[\s\d]*$"),
}

#: Number of rows that ffmpeg reads from a .3dl: it reads only tables with 17 points along an axis.
FFMPEG_ROWS = 17**3

#: The largest numbers of .3dl files that OpenColorIO treats as 12-bit files.
TWELVE_BITS = range(2048, 4096)


@dataclass
class TableScan:
    """The result of a scan, which is filled line by line. Line numbers start at 1; 0 is no line."""

    path: Path
    #: Bytes of the file.
    length: int = 0
    #: The line that begins metadata without an end.
    unclosed: int = 0
    #: Whether a line ends in a single CR.
    single_cr: bool = False
    #: Points along each axis by the header; () without a header.
    size: tuple[int, ...] = ()
    #: Number of rows after the header.
    rows: int = 0
    #: The first line that is no comment, and the largest number of a .3dl's rows.
    head: str = ""
    largest: int = 0
    #: The first line with NaN or infinity, and the first line with a decimal comma.
    nan: int = 0
    comma: int = 0
    #: The first other line with surplus or malformed numbers, and its text.
    odd: int = 0
    sample: str = ""
    #: The reason why the installed OpenColorIO refuses the file; empty when it reads the file, None when not tried.
    refusal: str | None = None

    def __post_init__(self) -> None:
        self._csp = _CspLines()

    @property
    def suffix(self) -> str:
        """The suffix of the file's name, in lower case."""
        return self.path.suffix.lower()

    def take(self, place: int, line: bytes) -> None:
        """Read the next line."""
        words = line.strip()
        of_csp = self._csp.part(words) if self.suffix == ".csp" else ""
        if not words or of_csp == "words" or (words.startswith(b"#") and self.suffix != ".csp"):
            return
        first = not self.head
        if first:
            # Store at most 1000 characters of the first line.
            self.head = line[:1000].decode("ascii", errors="replace").strip()
        # The first line of three numbers is the size, except in a .3dl, which states no size.
        header = _SIZE.match(line) if not self.size and self.suffix != ".3dl" and of_csp in {"", "table"} else None
        row = None
        if header:
            self.size = tuple(int(word[:9]) for word in header.groups())
        elif (self.size or self.suffix == ".3dl") and (row := _ROW[self.suffix].match(line)):
            self.rows += 1
            self.largest = max(self.largest, 0, *(int(word[:9]) for word in row.groups()))
        # OpenColorIO skips the mesh line of a .3dl if one of its words is no integer.
        of_numbers = bool(header or row or of_csp or (first and self.suffix == ".3dl" and _MESH.match(line)))
        self._check(place, line, of_numbers=of_numbers)

    def _check(self, place: int, line: bytes, *, of_numbers: bool) -> None:
        if _SOUND[self.suffix].match(line):
            return
        if _NAN.search(line):
            self.nan = self.nan or place
        elif _COMMA.search(line):
            self.comma = self.comma or place
        elif of_numbers and not self.odd:
            self.odd, self.sample = place, shown(line)


class _CspLines:
    """A classifier of the lines of a ``.csp``: "words", "curves" (count, inputs, outputs, three times) or "table"."""

    def __init__(self) -> None:
        self._dimension, self._metadata, self._curves, self._lines = b"", False, 0, 0

    def part(self, words: bytes) -> str:
        """Return the class of the next line. ``words`` is the line without blanks around it."""
        words = words.upper()
        if words.startswith((b"BEGIN METADATA", b"END METADATA")):
            self._metadata = words.startswith(b"BEGIN")
            return "words"
        if self._metadata or not words:
            return "words"
        if not self._dimension:
            self._dimension = words if words in {b"1D", b"3D"} else b""
            return "words"
        if self._lines:
            self._lines -= 1
        elif self._curves < 3:
            self._curves += 1
            self._lines = 0 if words in {b"0", b"1"} else 2
        else:
            return "table" if self._dimension == b"3D" else "curves"
        return "curves"


def scan_table(path: Path) -> TableScan:
    """Scan a file, then try OpenColorIO, if it cannot fill the memory. Raises LutgenError: unreadable, or no text."""
    scan = TableScan(path)
    for block in blocks(path):
        scan.single_cr |= block.single_cr
        for place, line in enumerate(block.data.splitlines(), block.first):
            scan.take(place, line)
    scan.length, scan.unclosed = path.stat().st_size, unclosed_metadata(path)
    if max(scan.size, default=0) <= MAX_KEPT and scan.length <= MAX_BYTES and not scan.unclosed:
        scan.refusal = refusal(path)
    return scan


def loads(scan: TableScan) -> Iterator[LintFinding]:
    """Find out whether the installed OpenColorIO, which reads these formats strictly, reads the file."""
    if not scan.unclosed:
        yield from loading(scan.refusal, *OCIO)


def line_ends(scan: TableScan) -> Iterator[LintFinding]:
    """Find line ends of a single CR. All readers accept CRLF, but OpenColorIO and ffmpeg do not accept a single CR."""
    if scan.suffix == ".3dl" and scan.single_cr:
        fates = wrong(*OCIO, how="reads all numbers as one curve")
        fates |= refused(FFMPEG, how="reads the whole file as one line")
        yield LintFinding("has line ends of a single CR", "Save it with LF line ends.", 1, fates)


def table_metadata(scan: TableScan) -> Iterator[LintFinding]:
    """Find metadata without an end. OpenColorIO searches for END METADATA for ever, so it must not read such a file."""
    if scan.unclosed:
        fact, remedy = "opens its metadata and never closes them", "Write END METADATA after them."
        fates = refused(*OCIO, how="reads on without end and fills the memory")
        yield LintFinding(fact, remedy, scan.unclosed, fates)


def table_numbers(scan: TableScan) -> Iterator[LintFinding]:
    """Find malformed numbers. OpenColorIO reads NaN as 0, and other words up to the first character of no number."""
    if scan.nan:
        yield LintFinding("has NaN or infinity", "Compute these rows again.", scan.nan, wrong(*OCIO, how="reads 0"))
    if scan.comma:
        fates = wrong(*OCIO, how="reads up to the comma: 0,5 is 0")
        yield LintFinding("has decimal commas", "Write decimal points.", scan.comma, fates)
    if scan.odd:
        fact = f"has a line with surplus or malformed numbers: {scan.sample}"
        fates = wrong(*OCIO, how="reads each word up to the first letter that no number has: 0;75 is 0, 1/2 is 1")
        if scan.suffix == ".3dl":
            fates = wrong(*OCIO, how="ignores the line")
        yield LintFinding(fact, "Write numbers with a decimal point and blanks between them.", scan.odd, fates)
    if scan.size and scan.rows > prod(scan.size):
        fact = f"has {scan.rows} rows where its header asks for {prod(scan.size)}"
        fates = wrong(*OCIO, how="ignores the rest")
        yield LintFinding(fact, "It was edited by hand; export it again.", 0, fates)


def table_3dl(scan: TableScan) -> Iterator[LintFinding]:
    """Find .3dl files that ffmpeg misreads. Its lut3d skips the first line, reads 17³ rows and divides by 4096."""
    if scan.suffix != ".3dl":
        return
    mesh = len(scan.head.split()) > 3
    after_first_line = scan.rows - (not mesh and bool(scan.rows))
    remedy = "Make a .cube for ffmpeg of it: `ociobakelut --lut FILE --format iridas_cube OUT`."
    if scan.head.upper().startswith("3DMESH"):
        yield LintFinding("begins with 3DMESH", remedy, 0, refused(FFMPEG, how="reads its second line as a row"))
    elif after_first_line < FFMPEG_ROWS:
        fates = refused(FFMPEG, how=f"expects {FFMPEG_ROWS} rows after the first line")
        yield LintFinding(f"has {scan.rows} rows" + ("" if mesh else " and no mesh line"), remedy, 0, fates)
    elif after_first_line > FFMPEG_ROWS:
        fates = wrong(FFMPEG, how=f"reads the first {FFMPEG_ROWS} rows as a table of 17³")
        yield LintFinding(f"has {scan.rows} rows, and ffmpeg reads only tables of 17³", remedy, 0, fates)
    elif scan.largest not in TWELVE_BITS:
        fates = wrong(FFMPEG, how="reads its numbers as 12 bits")
        yield LintFinding(f"has numbers up to {scan.largest}, and ffmpeg divides by 4096", remedy, 0, fates)


RULES = (loads, line_ends, table_metadata, table_numbers, table_3dl)


def lint_table(path: Path, _ask_readers: bool) -> Linted:
    """Lint a table. Raises LutgenError when it cannot be read or is no text."""
    scan = scan_table(path)
    size = " × ".join(map(str, scan.size)) + f" points, {scan.rows} rows, " if scan.size else ""
    kind = "3dl" if scan.suffix == ".3dl" else "lut"
    return Linted(path, kind, (f"{size}{scan.length} bytes",), tuple(findings(RULES, scan)))


FORMAT = FileKind((".3dl", ".csp", ".spi3d"), lint_table, RULES)
