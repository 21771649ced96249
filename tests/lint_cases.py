"""Variants of ``.cube`` files in use: one small table in many dialects, valid or broken."""

from collections.abc import Callable

N = 4
SIZE = f"LUT_3D_SIZE {N}"


def curved(r: float, g: float, b: float) -> tuple[float, float, float]:
    return 0.9 * r**1.3 + 0.02, 0.8 * g**0.8 + 0.1, 0.5 * b + 0.3 * r


def rows(
    size: int = N,
    form: str = "%.6f %.6f %.6f",
    colour: Callable[[float, float, float], tuple[float, float, float]] = curved,
) -> list[str]:
    """Return the rows of a table, red fastest."""
    axis = [place / (size - 1) for place in range(size)]
    return [form % colour(r, g, b) for b in axis for g in axis for r in axis]


def lines(*each: str) -> bytes:
    return ("\n".join(each) + "\n").encode()


R = rows()
CURVES = [f"{x / 3:.6f} {x * 0.3:.6f} {x * x / 9:.6f}" for x in range(4)]
WIDE = ("DOMAIN_MIN -0.5 -0.5 -0.5", "DOMAIN_MAX 1.5 1.5 1.5")
MARK = b"\xef\xbb\xbf"
PLAIN = lines(SIZE, *R)

#: Every reader reads these files as they are meant.
GOOD: dict[str, bytes] = {
    "plain": PLAIN,
    "title": lines('TITLE "a b"', SIZE, *R),
    "title behind the size": lines(SIZE, 'TITLE "x"', *R),
    "comment before": lines("# x", SIZE, *R),
    "comment among rows": lines(SIZE, *R[:5], "# x", *R[5:]),
    "comment at the end": lines(SIZE, *R, "# end"),
    "empty lines": lines("", SIZE, "", *R[:9], "", *R[9:]),
    "domain 0..1": lines(SIZE, "DOMAIN_MIN 0 0 0", "DOMAIN_MAX 1 1 1", *R),
    "CRLF": PLAIN.replace(b"\n", b"\r\n"),
    "UTF-8 comment": "# ä\n".encode() + PLAIN,
    "tab in the header": lines(SIZE.replace(" ", "\t"), *R),
    "two spaces": lines(SIZE, *(row.replace(" ", "  ") for row in R)),
    "spaces at the ends": lines(f"{SIZE} ", *(f" {row} " for row in R)),
    "exponents": lines(SIZE, *rows(form="%.6e %.6e %.6e")),
    "smallest normal number": lines(SIZE, "1.2e-38 0.1 0.2", *R[1:]),
    "signs and bare points": lines(SIZE, "+0.5 .5 1.", *R[1:]),
    "size 2": lines("LUT_3D_SIZE 2", *rows(2)),
    "no line end at the end": PLAIN[:-1],
    "values beyond 0..1": lines(SIZE, *rows(colour=lambda r, g, b: (r * 1.5 - 0.2, g * 1.5 - 0.2, b * 1.5 - 0.2))),
    "input range 0..1 first": lines("LUT_3D_INPUT_RANGE 0 1", SIZE, *R),
}

#: The rule that reports the fault, and the file.
BAD: dict[str, tuple[str, bytes]] = {
    "title without quotes": ("cube-title", lines("TITLE a b", SIZE, *R)),
    "comment behind a row": ("trailing-comment", lines(SIZE, f"{R[0]} # c", *R[1:])),
    "empty comment behind a row": ("trailing-comment", lines(SIZE, f"{R[0]} #", *R[1:])),
    "comment behind the size": ("trailing-comment", lines(f"{SIZE} # c", *R)),
    "domain before the size": ("cube-domain", lines(*WIDE, SIZE, *R)),
    "domain behind the size": ("cube-domain", lines(SIZE, *WIDE, *R)),
    "maximum before the size": ("cube-domain", lines(WIDE[1], SIZE, *R)),
    "maximum behind the size": ("cube-domain", lines(SIZE, WIDE[1], *R)),
    "reversed domain": ("cube-domain", lines("DOMAIN_MIN 1 1 1", "DOMAIN_MAX 0 0 0", SIZE, *R)),
    "domain of one number": ("cube-domain", lines("DOMAIN_MIN 0", SIZE, *R)),
    "domain of one number behind the size": ("cube-domain", lines(SIZE, "DOMAIN_MIN 0", *R)),
    "domain of four numbers": ("cube-domain", lines(SIZE, "DOMAIN_MIN 0 0 0 0", *R)),
    "domain of letters": ("cube-domain", lines(SIZE, "DOMAIN_MAX a b c", *R)),
    "domain among rows": ("cube-keyword", lines(SIZE, *R[:5], "DOMAIN_MAX 1 1 1", *R[5:])),
    "domain at the end": ("cube-keyword", lines(SIZE, *R, "DOMAIN_MAX 1 1 1")),
    "title among rows": ("cube-keyword", lines(SIZE, *R[:5], 'TITLE "x"', *R[5:])),
    "input range": ("cube-input-range", lines(SIZE, "LUT_3D_INPUT_RANGE 0 1", *R)),
    "wide input range": ("cube-input-range", lines(SIZE, "LUT_3D_INPUT_RANGE -0.5 1.5", *R)),
    "wide input range first": ("cube-input-range", lines("LUT_3D_INPUT_RANGE -0.5 1.5", SIZE, *R)),
    "input range and title": ("cube-input-range", lines('TITLE "x"', SIZE, "LUT_3D_INPUT_RANGE 0 1", *R)),
    "input range of one number": ("cube-input-range", lines(SIZE, "LUT_3D_INPUT_RANGE 0", *R)),
    "reversed input range": ("cube-input-range", lines("LUT_3D_INPUT_RANGE 1 0", SIZE, *R)),
    "1D table": ("cube-shaper", lines("LUT_1D_SIZE 4", *CURVES)),
    "1D table too short": ("cube-rows", lines("LUT_1D_SIZE 5", *CURVES)),
    "1D table too long": ("cube-rows", lines("LUT_1D_SIZE 3", *CURVES)),
    "1D part": ("cube-shaper", lines("LUT_1D_SIZE 4", SIZE, *CURVES, *R)),
    "1D part with ranges": (
        "cube-shaper",
        lines("LUT_1D_SIZE 4", "LUT_1D_INPUT_RANGE 0 1", SIZE, "LUT_3D_INPUT_RANGE 0 1", *CURVES, *R),
    ),
    "1D part and title": ("cube-shaper", lines('TITLE "x"', "LUT_1D_SIZE 4", SIZE, *CURVES, *R)),
    "1D size behind the 3D size": ("cube-shaper", lines(SIZE, "LUT_1D_SIZE 4", *CURVES, *R)),
    "byte order mark on the size": ("byte-order-mark", MARK + PLAIN),
    "byte order mark on a title": ("byte-order-mark", MARK + lines('TITLE "x"', SIZE, *R)),
    "byte order mark on a comment": ("byte-order-mark", MARK + lines("# c", SIZE, *R)),
    "CR": ("line-ends", PLAIN.replace(b"\n", b"\r")),
    "Latin 1": ("encoding", b"# \xe4\n" + PLAIN),
    "tabs": ("tabs", lines(SIZE, *(row.replace(" ", "\t") for row in R))),
    "subnormal": ("subnormal", lines(SIZE, "1e-39 0.1 0.2", *R[1:])),
    "underflow": ("subnormal", lines(SIZE, "1e-60 0.1 0.2", *R[1:])),
    "underflow of doubles": ("subnormal", lines(SIZE, "0.061e-4621731 0.1 0.2", *R[1:])),
    "overflow": ("not-a-number", lines(SIZE, "1e60 0.1 0.2", *R[1:])),
    "NaN": ("not-a-number", lines(SIZE, *R[:21], "0.1 nan 0.2", *R[22:])),
    "infinity": ("not-a-number", lines(SIZE, "inf 0.1 0.2", *R[1:])),
    "decimal commas": ("comma", lines(SIZE, *(row.replace(".", ",") for row in R))),
    "one decimal comma": ("comma", lines(SIZE, *R[:21], R[21].replace(".", ","), *R[22:])),
    "commas between": ("comma", lines(SIZE, *(row.replace(" ", ", ") for row in R))),
    "a row too few": ("cube-rows", lines(SIZE, *R[:-1])),
    "a row too many": ("cube-rows", lines(SIZE, *R, "0.5 0.5 0.5")),
    "a row of two": ("cube-rows", lines(SIZE, *R[:10], "0.1 0.2", *R[11:])),
    "a row of four": ("cube-rows", lines(SIZE, *R[:10], f"{R[10]} 1.0", *R[11:])),
    "exponents of Fortran": ("cube-rows", lines(SIZE, *R[:5], "1.0D-1 0.2 0.3", *R[6:])),
    "NUL": ("cube-rows", lines(SIZE, *R[:5], "\0", *R[5:])),
    "text among rows": ("cube-keyword", lines(SIZE, *R[:5], "hello world foo", *R[5:])),
    "two sizes": ("cube-size", lines(SIZE, "LUT_3D_SIZE 5", *R)),
    "size at the end": ("cube-size", lines(*R, SIZE)),
    "no size": ("cube-size", lines(*R)),
    "size 4.0": ("cube-size", lines(f"{SIZE}.0", *R)),
    "size 0": ("cube-size", lines("LUT_3D_SIZE 0", *R)),
    "size -4": ("cube-size", lines("LUT_3D_SIZE -4", *R)),
    "size 1": ("cube-size", lines("LUT_3D_SIZE 1", "0.1 0.2 0.3")),
    "size 66": ("cube-size", lines("LUT_3D_SIZE 66", *rows(66))),
    "empty": ("cube-size", b""),
    "small letters": ("cube-keyword", lines(SIZE.lower(), *R)),
    "title in small letters": ("cube-keyword", lines('title "x"', SIZE, *R)),
    "domain in small letters": ("cube-keyword", lines(SIZE, "domain_min 0 0 0", *R)),
    "unknown word before": ("cube-keyword", lines("FOO 1", SIZE, *R)),
    "unknown word behind": ("cube-keyword", lines(SIZE, "FOO 1", *R)),
    "unknown word at the end": ("cube-keyword", lines(SIZE, *R, "FOO")),
    "video range": ("cube-keyword", lines(SIZE, "LUT_IN_VIDEO_RANGE", *R)),
    "integers": ("value-range", lines(SIZE, *("%d %d %d" % tuple(float(x) * 1023 for x in row.split()) for row in R))),  # noqa: UP031 - rounds down, as programs do
    "blue fastest": ("channel-order", lines(SIZE, *rows(colour=lambda r, g, b: curved(b, g, r)))),
    "one colour": ("unfinished", lines(SIZE, *["0.5 0.5 0.5"] * N**3)),
    "black end": ("unfinished", lines(SIZE, *R[:40], *["0 0 0"] * 24)),
}
