"""Comparison of a file of a build with a newly written file: the numbers of a table, a whole config, a certificate.

Equal bytes need no further comparison. Differing texts are compared number by number, since another processor may round
the last digit differently. Binary files, and files of another version of lutgen, are compared at every lattice point.
"""

import re
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.bake.config import AgedConfig, config_text
from lutgen.bake.figures import SLACK
from lutgen.bake.formats import ocioz
from lutgen.bake.lut import Lut, MatrixLut
from lutgen.bake.readback import apply_lut
from lutgen.bake.spaces import lattice
from lutgen.bindings import is_utf8, ocio, ocio_errors
from lutgen.cells import NUMBER
from lutgen.errors import in_one_line

#: Tolerance of the numbers of a text, relative to the larger of 1 and the number: the last digit may be rounded
#: differently.
DIGIT_TOLERANCE = 2e-6

#: Tolerance of the fidelity figures in a comment, which have four decimals.
COMMENT_TOLERANCE = 2e-3

#: Tolerance of code values at a lattice point: the error of OpenColorIO's fast power function near black.
POINT_TOLERANCE = 3e-4

_WORD = re.compile(NUMBER.encode())

#: Points along an edge of the lattice on which a file without a table is compared.
_POINTS = 9


def differs_from(path: Path, data: bytes, expected: bytes, lut: Lut | MatrixLut, *, same_version: bool) -> str:
    """Describe how a LUT file differs from the newly written file ``expected``; "" when they agree.

    Raises LutgenError: the file cannot be read.
    """
    if data == expected:
        return ""
    if path.suffix == ocioz.FORMAT.suffix:
        return _archive_difference(data, expected)
    if same_version and b"\0" not in expected[:1000]:
        return _text_difference(data, expected)
    code = lattice(lut.size or _POINTS, lut.space if lut.size else "code")
    away = np.abs(np.clip(apply_lut(path, code), 0, 1) - np.clip(lut.apply(code), 0, 1)).max(axis=1)
    worst = int(np.argmax(away))
    if away[worst] <= POINT_TOLERANCE:
        return ""
    where = ", ".join(f"{value:.4g}" for value in code[worst])
    return f"is not what the model gives: at code values {where} it is {away[worst]:.2g} off"


def _archive_difference(data: bytes, expected: bytes) -> str:
    """Compare the files in two archives: the config as a whole, and the table number by number."""
    actual_files, expected_files = ocioz.files_of(data), ocioz.files_of(expected)
    if actual_files.keys() != expected_files.keys():
        return f"holds {', '.join(map(repr, actual_files))}, not {', '.join(expected_files)}"
    for name, text in expected_files.items():
        actual = actual_files[name]
        differs = _text_difference(actual, text) if name == ocioz.TABLE else _config_text_difference(actual, text)
        if actual != text and differs:
            return f"{name} in it {differs}"
    return ""


def _text_difference(data: bytes, expected: bytes) -> str:
    for line, (actual, own) in enumerate(zip_longest(data.splitlines(), expected.splitlines(), fillvalue=b""), 1):
        if actual != own and not _same_line(actual, own):
            texts = [text[:60].decode(errors="replace") for text in (actual, own)]
            return f"is not what lutgen writes: line {line} is {texts[0]!r}, not {texts[1]!r}"
    return ""


def _same_line(actual: bytes, expected: bytes) -> bool:
    if _WORD.sub(b"0", actual) != _WORD.sub(b"0", expected):
        return False
    near = COMMENT_TOLERANCE if b"dE2000" in expected else DIGIT_TOLERANCE
    pairs = zip(_WORD.findall(actual), _WORD.findall(expected), strict=True)
    return all(abs(float(a) - float(b)) <= near * max(1.0, abs(float(b))) for a, b in pairs)


def config_differs(config: Any, data: bytes, aged: AgedConfig) -> str:
    """Describe how a config, loaded from ``data``, differs from the newly generated config; "" when they agree.

    The installed OpenColorIO serialises both configs, so that the version that wrote the file does not matter.
    """
    text = config_text(aged)
    if data == text:
        return ""
    if not is_utf8(config):
        return "holds texts that are no UTF-8"
    return _config_difference(config, text)


def _config_text_difference(data: bytes, text: bytes) -> str:
    try:
        config = ocio().Config.CreateFromStream(data.decode())
    except ocio_errors() as error:
        return f"does not load: {in_one_line(error)}"
    return _config_difference(config, text)


def _config_difference(config: Any, text: bytes) -> str:
    """Serialise both configs with OpenColorIO, and describe the first difference of the texts; "" when none."""
    try:
        actual = str(config.serialize())
        expected = str(ocio().Config.CreateFromStream(text.decode()).serialize())
    except ocio_errors() as error:
        return f"cannot be serialised: {in_one_line(error)}"
    for line, own in zip_longest(actual.splitlines(), expected.splitlines(), fillvalue=""):
        if line != own:
            return f"is not what lutgen writes: {line.strip()[:80]!r}, not {own.strip()[:80]!r}"
    return ""


def certificate_differences(certified: Mapping[str, Any] | None, now: Mapping[str, Any]) -> list[str]:
    """Return the differences between a certificate and a new certificate, as sentences.

    :func:`lutgen.bake.fidelity.over_budget` reports figures that are worse than certified.
    """
    if not isinstance(certified, dict):
        return ["there is no certificate"]
    before, after = dict(_flat(certified)), dict(_flat(now))
    problems = [f"its certificate lacks {name}" for name in after if name not in before]
    problems += [f"its certificate has {name}, which no certificate has" for name in before if name not in after]
    for name, value in after.items():
        claimed = before.get(name, value)
        if not _agrees(claimed, value):
            problems.append(f"its certificate says {name} {claimed!r}, and it is {value!r}")
    return problems


def _flat(content: Mapping[str, Any], head: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the figures of a certificate. The name of a figure joins the keys that lead to it."""
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{head}{key} ")
        else:
            yield f"{head}{key}", value


def _agrees(certified: Any, now: Any) -> bool:
    if isinstance(certified, bool) or not isinstance(certified, int | float) or not isinstance(now, int | float):
        return bool(certified == now)
    # Integers are counts of colours. Rounding may move one colour in a thousand to another group.
    return abs(certified - now) <= max(SLACK, 1e-3 * abs(now) if isinstance(now, int) else 0.0)
