"""``.cube``: what OpenColorIO, ffmpeg, pillow_lut and colour do with each variant of the format.

The outcomes in the rules were measured with these readers. The tests measure them again with the installed readers.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lutgen.bake.fitted_nodes import HEADROOM
from lutgen.lint.cube_scan import CubeScan, Entry, scan_cube
from lutgen.lint.finding import COLOUR, FFMPEG, OCIO, OCIO_21, OCIO_26, PILLOW, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.programs import try_cube

EVERYONE = (*OCIO, FFMPEG, PILLOW, COLOUR)

#: The largest table that each reader accepts, in points along an axis.
LARGEST = {PILLOW: 65, **dict.fromkeys(OCIO, 129), FFMPEG: 256}

#: Keywords → the values that readers assume without them.
DOMAIN = {"DOMAIN_MIN": 0.0, "DOMAIN_MAX": 1.0}
RANGES = ("LUT_3D_INPUT_RANGE", "LUT_1D_INPUT_RANGE")

#: Keywords of Adobe's and Iridas' dialect. OpenColorIO refuses them together with keywords of DaVinci Resolve.
ADOBES = ("TITLE", *DOMAIN)
KNOWN = {*ADOBES, *RANGES, "LUT_3D_SIZE", "LUT_1D_SIZE"}
RANGE_FLAGS = {"LUT_IN_VIDEO_RANGE", "LUT_OUT_VIDEO_RANGE", "LUT_IN_FULL_RANGE", "LUT_OUT_FULL_RANGE"}

#: In a table stored blue fastest, red correlates more with the slowest index than with the fastest, by this margin.
MARGIN = 0.3

#: The smallest fall along the neutral axis that is not due to rounding: one 10-bit code.
FALL = 1 / 1023

#: Tables of 0..1 stay below this value, even with colours outside the gamut. A table that reaches it holds integers.
INTEGERS = 16.0

#: Black and white of video's narrow range, 64 and 940 of 1023, and the tolerance for both.
NARROW, NEAR = (64 / 1023, 940 / 1023), 0.004

#: Three words that begin like numbers.
_NUMBERS = re.compile(r"(?:[-+]?\.?[0-9]\S*\s*){3}$")
_CUT = "It was cut off or edited by hand; export it again."
_OWN_LINE = "Give the comment a line of its own, before LUT_3D_SIZE."


def byte_order_mark(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a byte order mark. It becomes part of the first word. If that is LUT_3D_SIZE, no reader finds the size."""
    if scan.marked:
        fates = refused(COLOUR, how="cannot read the marked line")
        if scan.size_line == 1:
            fates |= refused(FFMPEG, PILLOW, *OCIO, how="the mark hides LUT_3D_SIZE")
        yield LintFinding("starts with a UTF-8 byte order mark", "Save it as ASCII, without the mark.", 1, fates)


def cube_title(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a TITLE without quotes. pillow_lut raises an IndexError without the quotes."""
    for entry in scan.named("TITLE"):
        if '"' not in "".join(entry.words):
            fates = refused(PILLOW, how="ends with an IndexError")
            yield LintFinding(f"has a TITLE without quotes: {entry.text}", 'Write TITLE "…".', entry.line, fates)


def cube_size(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a LUT_3D_SIZE that is missing, malformed, repeated, after the rows, or too large for a reader."""
    sizes = scan.named("LUT_3D_SIZE")
    if not sizes and not scan.named("LUT_1D_SIZE"):
        fact = "is empty" if not scan.length else "has no LUT_3D_SIZE"
        fates = refused(*EVERYONE, how="finds no size")
        yield LintFinding(fact, "Export it again; no reader knows its size.", 0, fates)
    for entry in sizes[:1]:
        yield from _size(scan, entry)
    for entry in sizes[1:]:
        fates = refused(*EVERYONE, how="reads two sizes")
        yield LintFinding(f"states its size twice: {entry.text}", "Leave one.", entry.line, fates)


def _size(scan: CubeScan, entry: Entry) -> Iterator[LintFinding]:
    word = entry.words[0] if entry.words else ""
    if entry.rows_before:
        fates = refused(FFMPEG, PILLOW, how="finds no rows after the size")
        yield LintFinding("states its size after its rows", "Put LUT_3D_SIZE before them.", entry.line, fates)
    if scan.size < 1:
        fates = refused(*EVERYONE, how="makes no table of that size")
        yield LintFinding(f"has a size that no table has: {entry.text}", "Export it again.", entry.line, fates)
    elif scan.size == 1:
        fates = refused(OCIO_26, FFMPEG, PILLOW, how="expects 2 or more")
        yield LintFinding("has a table of a single colour: size 1", "Export it again.", entry.line, fates)
    elif not re.fullmatch(r"[0-9]+", word):
        fates = refused(PILLOW, COLOUR, how="expects a whole number")
        yield LintFinding(f"has a size that is no whole number: {entry.text}", f"Write {scan.size}.", entry.line, fates)
    too_large = [refused(reader, how=f"takes {most} at most") for reader, most in LARGEST.items() if scan.size > most]
    if too_large:
        fates = {reader: fate for each in too_large for reader, fate in each.items()}
        yield LintFinding(f"has {scan.size} points per axis", "Resample it to 65 or 33.", entry.line, fates)


def cube_domain(scan: CubeScan) -> Iterator[LintFinding]:
    """Find malformed domains and domains other than 0..1: pillow_lut ignores them, and ffmpeg uses them in part."""
    for entry in scan.named(*DOMAIN):
        after_size = 0 < scan.size_line < entry.line
        if entry.domain is None:
            yield _malformed(entry, after_size=after_size)
        elif any(value != DOMAIN[entry.keyword.upper()] for value in entry.domain):
            yield _narrowed(entry, after_size=after_size)
    low, high = scan.domain
    if (low >= high).any():
        line, fates = scan.named(*DOMAIN)[0].line, wrong(*EVERYONE, how="shows meaningless colours")
        yield LintFinding("has a domain that ends before it begins", "Export it again.", line, fates)


def _malformed(entry: Entry, *, after_size: bool) -> LintFinding:
    fates = refused(COLOUR, how="expects three numbers")
    if after_size:
        fates |= refused(*OCIO, how="expects three numbers")
        if entry._replace(words=entry.words[:3]).domain is None:
            fates |= refused(FFMPEG, how="expects three numbers")
    fact = f"has a {entry.keyword} that is not three numbers: {entry.text}"
    return LintFinding(fact, "Leave it out, or write three.", entry.line, fates)


def _narrowed(entry: Entry, *, after_size: bool) -> LintFinding:
    fates = wrong(PILLOW, how="ignores it and takes 0..1 as the domain")
    if not after_size:
        fates |= wrong(FFMPEG, how="ignores the line before LUT_3D_SIZE")
    elif entry.keyword.upper() == "DOMAIN_MIN":
        fates |= wrong(FFMPEG, how="does not subtract the minimum")
    remedy = "Resample it to 0..1 and leave DOMAIN out (`ociobakelut --format iridas_cube` writes none)."
    return LintFinding(f"has a domain that is not 0..1: {entry.text}", remedy, entry.line, fates)


def cube_input_range(scan: CubeScan) -> Iterator[LintFinding]:
    """Find DaVinci Resolve's keywords for a domain. OpenColorIO refuses them together with TITLE or DOMAIN."""
    mixed = scan.named(*ADOBES)
    for entry in scan.named(*RANGES):
        ends = entry.numbers(2)
        fates = refused(*OCIO, COLOUR, how="expects two numbers") if ends is None else {}
        if ends and not ends[0] < ends[1]:
            fates |= wrong(*EVERYONE, how="shows meaningless colours")
        elif ends and ends != (0.0, 1.0):
            fates |= wrong(PILLOW, how="ignores it and takes 0..1 as the range")
            fates |= wrong(FFMPEG, how="ignores the line before LUT_3D_SIZE")
        if 0 < scan.size_line < entry.line:
            fates |= refused(FFMPEG, how="reads it as a row")
        if mixed:
            fates |= refused(*OCIO, how=f"does not take it together with {mixed[0].keyword}")
        fact = f"states its input range as DaVinci Resolve does: {entry.text}"
        yield LintFinding(fact, "Leave it out where it says 0 1; else resample to 0..1.", entry.line, fates)


def cube_shaper(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a 1D part, alone or before the 3D table. ffmpeg's lut3d reads its rows as the first rows of the table."""
    for entry in scan.named("LUT_1D_SIZE")[:1]:
        fates = refused(PILLOW, how="reads no 1D tables")
        if not scan.size_line:
            fates |= refused(FFMPEG, how="finds no LUT_3D_SIZE")
            remedy = "Apply it with ffmpeg's lut1d, or bake it into a 3D table."
            yield LintFinding(f"is a 1D table: {entry.text}", remedy, entry.line, fates)
            continue
        if entry.line > scan.size_line:
            fates |= refused(FFMPEG, how="reads LUT_1D_SIZE as a row")
            fates |= wrong(COLOUR, how="reads the 1D part's rows as the last of the table")
        else:
            fates |= wrong(FFMPEG, how="reads the 1D part's rows as the first of the table")
        bake = "Bake"
        if scan.named(*ADOBES):
            fates |= refused(*OCIO, how="takes a 1D part only without TITLE and DOMAIN")
            bake = "Delete its TITLE and DOMAIN; export it again if DOMAIN is not 0..1. Then bake"
        remedy = f"{bake} both into one 3D table: `ociobakelut --lut FILE --format iridas_cube --cubesize 65 OUT`."
        fact = f"has a 1D part before its 3D table: {entry.text}"
        if scan.shaper_is_identity:
            fact = f"has an identity as its 1D part: {entry.text}"
            remedy = (
                f"Delete LUT_1D_SIZE, LUT_1D_INPUT_RANGE and the 1D part's {scan.size_1d} rows: with them darktable "
                "and OBS show the picture unchanged, three.js shifts the table's rows."
            )
        yield LintFinding(fact, remedy, entry.line, fates)


def cube_keyword(scan: CubeScan) -> Iterator[LintFinding]:
    """Find unknown, lower-case and late keywords. Most readers skip unknown words, but only before the size."""
    unknown = [entry for entry in scan.entries if entry.keyword.upper() not in KNOWN]
    small = [entry for entry in scan.entries if entry.keyword != entry.keyword.upper() and entry not in unknown]
    late = [entry for entry in scan.named(*KNOWN) if entry.rows_before and 0 < scan.size_line < entry.line]
    if unknown:
        yield _unknown(scan, unknown[0])
    if small:
        how = "knows keywords in capitals only"
        fates = refused(COLOUR, how=how)
        if any(entry.keyword.upper() == "LUT_3D_SIZE" for entry in small):
            fates |= refused(FFMPEG, PILLOW, how=how)
        elif any(0 < scan.size_line < entry.line for entry in small):
            fates |= refused(FFMPEG, how=how)
        fact = f"writes a keyword in small letters: {small[0].text}"
        yield LintFinding(fact, "Write capitals.", small[0].line, fates)
    if late:
        fates = refused(OCIO_26, PILLOW, how="reads it as a row")
        yield LintFinding(f"has a keyword among its rows: {late[0].text}", "Put it before them.", late[0].line, fates)


def _unknown(scan: CubeScan, entry: Entry) -> LintFinding:
    how = "reads it as a row"
    fates = refused(COLOUR, how="knows no such word")
    if 0 < scan.size_line < entry.line:
        fates |= refused(*OCIO, how=how)
        if entry.rows_before < scan.size**3:
            fates |= refused(FFMPEG, how=how)
    if entry.rows_before:
        fates |= refused(PILLOW, how=how)
    flag = entry.keyword.upper() in RANGE_FLAGS
    fact = "states a video or full range, which no reader uses" if flag else "has a word that is no keyword"
    remedy = "Leave it out" + (", and convert to full range." if flag else ".")
    return LintFinding(f"{fact}: {entry.text[:60]}", remedy, entry.line, fates)


def encoding(scan: CubeScan) -> Iterator[LintFinding]:
    """Find text that is not UTF-8. Readers in Python decode comments and titles. Other readers accept any bytes."""
    if odd := scan.oddities.get("not UTF-8"):
        fates = refused(PILLOW, COLOUR, how="cannot decode it")
        yield LintFinding("has text that is not UTF-8", "Write comments and TITLE in ASCII.", odd.line, fates)


def line_ends(scan: CubeScan) -> Iterator[LintFinding]:
    """Find line ends of a single CR. All readers accept CRLF, but OpenColorIO and ffmpeg do not accept a single CR."""
    if scan.single_cr:
        fates = refused(*OCIO, FFMPEG, how="reads the whole file as one line")
        yield LintFinding("has line ends of a single CR", "Save it with LF line ends.", 1, fates)


def tabs(scan: CubeScan) -> Iterator[LintFinding]:
    """Find tabs between numbers. pillow_lut splits rows at spaces only."""
    if odd := scan.oddities.get("tab"):
        fates = refused(PILLOW, how="splits rows at spaces only")
        yield LintFinding("has tabs between numbers", "Write spaces.", odd.line, fates)


def trailing_comment(scan: CubeScan) -> Iterator[LintFinding]:
    """Find comments at the end of a line. After three numbers only ffmpeg ignores them; in the header colour too."""
    if odd := scan.oddities.get("comment"):
        fates = refused(*OCIO, PILLOW, COLOUR, how="expects three numbers and nothing else")
        yield LintFinding(f"has a comment after a row: {odd.sample}", _OWN_LINE, odd.line, fates)
    for entry in scan.named("LUT_3D_SIZE", "LUT_1D_SIZE"):
        if any(word.startswith("#") for word in entry.words):
            fates = refused(*OCIO, PILLOW, how="expects a size and nothing else")
            yield LintFinding(f"has a comment in its header: {entry.text}", _OWN_LINE, entry.line, fates)


def comma(scan: CubeScan) -> Iterator[LintFinding]:
    """Find commas. OpenColorIO reads a number up to a decimal comma, and skips a comma after a number."""
    others = refused(FFMPEG, PILLOW, COLOUR, how="finds no number")
    if odd := scan.oddities.get("decimal comma"):
        fates = wrong(*OCIO, how="reads up to the comma: 0,5 is 0") | others
        yield LintFinding(f"has decimal commas: {odd.sample}", "Write decimal points.", odd.line, fates)
    if odd := scan.oddities.get("comma"):
        yield LintFinding(f"has commas between numbers: {odd.sample}", "Put spaces between them.", odd.line, others)


def cube_rows(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a wrong number of rows, and rows that are not three numbers. Only ffmpeg ignores surplus rows."""
    strict = refused(*OCIO, PILLOW, COLOUR, how="finds the wrong number of rows")
    rows, expected = scan.table.rows, scan.size**3
    if expected and rows != expected:
        surplus = wrong(FFMPEG, how=f"reads the first {expected} rows")
        fates = refused(FFMPEG, how="finds too few rows") if rows < expected else surplus
        fact = f"has {rows} rows where LUT_3D_SIZE {scan.size} asks for {expected}"
        yield LintFinding(fact, _CUT, scan.size_line, strict | fates)
    yield from _curve_rows(scan)
    if odd := scan.oddities.get("columns"):
        few = len(odd.sample.split()) < 3
        surplus = wrong(FFMPEG, how="ignores what follows three numbers")
        fates = strict | (refused(FFMPEG, how="finds too few numbers") if few else surplus)
        yield LintFinding(f"has rows of other than three numbers: {odd.sample}", _CUT, odd.line, fates)
    if odd := scan.oddities.get("text"):
        fates = refused(*EVERYONE, how="finds no number")
        if _NUMBERS.match(odd.sample):
            fates |= wrong(*OCIO, how="reads each word up to the first letter that no number has: 1.0D-2 is 1")
        yield LintFinding(f"has a row that is not numbers: {odd.sample}", _CUT, odd.line, fates)
    if odd := scan.oddities.get("NUL"):
        fates = refused(OCIO_21, PILLOW, COLOUR, how="finds no number")
        fates |= wrong(OCIO_26, FFMPEG, how="reads the line as empty")
        yield LintFinding("has NUL bytes, so it is no text", _CUT, odd.line, fates)


def _curve_rows(scan: CubeScan) -> Iterator[LintFinding]:
    rows = scan.shaper_rows + scan.table.rows
    if scan.size_line or not scan.size_1d or rows == scan.size_1d:
        return
    how = "uses the rows that are there"
    few = refused(*OCIO, how="finds the wrong number of rows")
    fates = wrong(COLOUR, how=how) | (few if rows < scan.size_1d else wrong(*OCIO, how=how))
    line = scan.named("LUT_1D_SIZE")[0].line
    yield LintFinding(f"has {rows} rows where LUT_1D_SIZE asks for {scan.size_1d}", _CUT, line, fates)


def not_a_number(scan: CubeScan) -> Iterator[LintFinding]:
    """Find NaN (0 in OpenColorIO and ffmpeg), infinity, and numbers from 3.4e38 on (only OpenColorIO refuses them)."""
    anew, extremes = "Compute these rows again.", "shows the largest or the smallest value there"
    if odd := scan.oddities.get("nan"):
        fates = wrong(*OCIO, FFMPEG, PILLOW, how="shows black or noise there") | wrong(COLOUR, how="gives NaN")
        yield LintFinding(f"has NaN in {odd.rows}: {odd.sample}", anew, odd.line, fates)
    if odd := scan.oddities.get("infinite"):
        fates = wrong(*EVERYONE, how=extremes)
        yield LintFinding(f"has infinity in {odd.rows}: {odd.sample}", anew, odd.line, fates)
    if odd := scan.oddities.get("overflow"):
        fates = refused(*OCIO, how="float32 cannot hold it") | wrong(FFMPEG, PILLOW, COLOUR, how=extremes)
        fact = f"has numbers beyond float32 in {odd.rows}: {odd.sample}"
        yield LintFinding(fact, "Scale to 0..1.", odd.line, fates)


def subnormal(scan: CubeScan) -> Iterator[LintFinding]:
    """Find subnormal numbers. Programs that compute curves write them near black. OpenColorIO cannot read them."""
    if odd := scan.oddities.get("subnormal"):
        fates = refused(*OCIO, how="does not read a number this small")
        fact = f"has numbers below 1.2e-38: {odd.sample}"
        yield LintFinding(fact, "Write them as 0; seven decimals do.", odd.line, fates)


def channel_order(scan: CubeScan) -> Iterator[LintFinding]:
    """Find tables stored blue fastest, as in CLF and .3dl. With such a ``.cube`` every reader swaps red and blue."""
    correlation = scan.table.correlation
    red, blue = correlation[0, 2] - correlation[0, 0], correlation[2, 0] - correlation[2, 2]
    if red > MARGIN and blue > MARGIN:
        fact = (
            "looks written blue fastest: red follows the slowest index "
            f"(correlation {correlation[0, 2]:.2f}, with the fastest {correlation[0, 0]:.2f}), blue the fastest"
        )
        fates = wrong(*EVERYONE, how="swaps red and blue")
        yield LintFinding(fact, "Reorder the rows so that red changes fastest.", 0, fates, in_the_file=True)


def grey_axis(scan: CubeScan) -> Iterator[LintFinding]:
    """Find a falling grey axis. It is a note: some authors intend it, and every reader shows it as stored."""
    falls = -np.diff(scan.table.greys, axis=0)
    if not len(falls) or falls.max() < FALL:
        return
    where, channel = np.unravel_index(int(np.argmax(falls)), falls.shape)
    name = ("red", "green", "blue")[int(channel)]
    fact = f"has greys whose {name} falls by {falls.max():.4g} between points {where} and {where + 1}"
    yield LintFinding(fact, "Check a grey ramp through the LUT.")


def unfinished(scan: CubeScan) -> Iterator[LintFinding]:
    """Find tables of one colour, and tables with black last rows: the program that wrote the file stopped early."""
    table = scan.table
    if scan.size < 2 or table.rows < scan.size**3:
        return
    if (table.low == table.high).all():
        fact = f"has the same colour in every row: {' '.join(f'{value:g}' for value in table.low)}"
        yield LintFinding(fact, "Export it again.", 0, wrong(*EVERYONE, how="shows one colour"), in_the_file=True)
    elif table.black_tail > 1:
        fact = f"ends in {table.black_tail} rows of 0 0 0, where white and its neighbours should be"
        yield LintFinding(fact, "Export it again.", 0, wrong(*EVERYONE, how="shows white as black"), in_the_file=True)


def value_range(scan: CubeScan) -> Iterator[LintFinding]:
    """Find integers, narrow-range tables, and values outside 0..1, which readers clip in integer pictures only."""
    table = scan.table
    low, high = float(table.low.min()), float(table.high.max())
    if high >= INTEGERS and "overflow" not in scan.oddities and "infinite" not in scan.oddities:
        fact = f"has values up to {high:g}: integers, not 0..1"
        fates = wrong(*EVERYONE, how="shows almost everything as white")
        yield LintFinding(fact, "Divide by the largest code.", 0, fates, in_the_file=True)
    elif low < 0 or high > HEADROOM:
        fact = f"has values from {low:g} to {high:g}; readers clip them where they write integers"
        yield LintFinding(fact, "Keep float pictures.")
    greys = table.greys
    if 2 <= len(greys) == scan.size and all(abs(greys[end] - NARROW[end]).max() < NEAR for end in (0, -1)):
        fact = f"puts black at {greys[0].mean():.4f} and white at {greys[-1].mean():.4f}: video's narrow range"
        yield LintFinding(fact, "Use it only where the picture is meant to stay in narrow range.")


RULES = (
    byte_order_mark, cube_title, cube_size, cube_domain, cube_input_range, cube_shaper, cube_keyword, encoding,
    line_ends, tabs, trailing_comment, comma, cube_rows, not_a_number, subnormal, channel_order, grey_axis, unfinished,
    value_range,
)  # fmt: skip


def lint_cube(path: Path, ask_readers: bool) -> Linted:
    """Lint a ``.cube``. Raises LutgenError when it cannot be read or is no text."""
    scan = scan_cube(path, keep=ask_readers)
    trials = tuple(try_cube(scan)) if ask_readers else ()
    part = f", a 1D part of {scan.size_1d}" if scan.size_1d else ""
    facts = (f"{scan.size}³ points{part}, {scan.table.rows} rows, {scan.length} bytes",)
    return Linted(path, "cube", facts, tuple(findings(RULES, scan)), trials)


FORMAT = FileKind((".cube",), lint_cube, RULES)
