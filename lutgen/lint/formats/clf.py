"""CLF and CTF: one pass over the XML reads the elements and the numbers of the arrays. Rules apply the readers' limits.

CLF is SMPTE ST 2136-1, formerly the Academy's S-2014-006. CTF is Autodesk's format with more operators.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.parsers import expat

from lutgen.cells import LONGEST, NON_FINITE, number
from lutgen.lint.finding import CLF_IO, OCIO, OCIO_21, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.programs import MAX_BYTES, loading, refusal
from lutgen.lint.stream import BLOCK, LARGEST, readable, shown

#: Elements that hold text instead of numbers.
WORDS = {"Description", "InputDescriptor", "OutputDescriptor", "Info"}

#: The beginning of a word that is meant as a number.
_NUMERAL = re.compile(rf"[-+]?\.?[0-9]|{NON_FINITE}$", re.IGNORECASE)

#: The namespace of SMPTE ST 2136-1.
SMPTE = "smpte-ra.org/ns/2136-1"

#: Maximum number of stored operators, so that a file of elements alone does not fill the memory.
MAX_NODES = 1000


@dataclass(frozen=True)
class Node:
    """An operator: line, name, attributes, ``dim`` of its array, largest finite number, and first ``odd`` word.

    An odd word is no finite decimal number of float32.
    """

    line: int
    name: str
    attributes: Mapping[str, str]
    dim: str = ""
    largest: float = 0.0
    odd: str = ""


@dataclass(frozen=True)
class ClfScan:
    """The result of a scan of a CLF."""

    bytes: int
    root: Mapping[str, str]
    nodes: tuple[Node, ...]
    #: The reason why the file is no XML, or empty, and its line.
    broken: str
    broken_line: int
    #: The reason why OpenColorIO refuses the file; empty when it reads the file, None when it was not tried.
    refusal: str | None

    @property
    def of_smpte(self) -> bool:
        """Whether the namespace is that of SMPTE ST 2136-1, which requires no id."""
        return SMPTE in self.root.get("xmlns", "")


def scan_clf(path: Path) -> ClfScan:
    """Scan a CLF in one pass, then try the installed OpenColorIO. Raises LutgenError: the file cannot be read."""
    reader = _ClfReader()
    broken, line = "", 0
    with readable(path, "a LUT"), path.open("rb") as file:
        try:
            while chunk := file.read(BLOCK):
                reader.parser.Parse(chunk, False)  # noqa: FBT003 - expat takes no keyword
            reader.parser.Parse(b"", True)  # noqa: FBT003 - expat takes no keyword
        except expat.ExpatError as error:
            broken, line = expat.ErrorString(error.code), error.lineno
        except (LookupError, ValueError) as error:
            broken, line = f"XML readers do not know its encoding: {error}", 1
        except _EntityError:
            broken, line = "it declares entities, which can fill any memory", reader.parser.CurrentLineNumber
    size = path.stat().st_size
    reason = refusal(path) if not broken and size <= MAX_BYTES else None
    return ClfScan(size, reader.root, tuple(reader.nodes), broken, line, reason)


class _EntityError(Exception):
    """The document declares an entity."""


class _ClfReader:
    def __init__(self) -> None:
        self.root: dict[str, str] = {}
        self.nodes: list[Node] = []
        self.depth = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.EntityDeclHandler = self._entity
        self.parser.buffer_text = True
        self._values: _Values | None = None

    def _entity(self, *_: object) -> None:
        raise _EntityError

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth == 1:
            self.root = {"": name, **attributes}
        elif self.depth == 2 and len(self.nodes) < MAX_NODES:
            self.nodes.append(Node(self.parser.CurrentLineNumber, name, attributes))
        elif self.depth > 2 and self.nodes and self.nodes[-1].name not in WORDS and name not in WORDS:
            self._flush()
            # Attributes hold parameters, but also names.
            words = [word for value in attributes.values() for word in value.split() if _NUMERAL.match(word)]
            self._note(0.0, next((shown(word.encode()) for word in words if not _finite(number(word))), ""))
            self._values = _Values(name == "Array", attributes.get("dim", ""), self.nodes[-1].attributes)

    def _text(self, text: str) -> None:
        if self._values:
            self._values.take(text)

    def _end(self, _name: str) -> None:
        self._flush()
        self.depth -= 1

    def _flush(self) -> None:
        if self._values:
            self._values.take(" ")
            node, values = self.nodes[-1], self._values
            if values.array:
                self.nodes[-1] = replace(node, dim=values.dim)
            self._note(values.largest if values.array else 0.0, values.odd)
            self._values = None

    def _note(self, largest: float, odd: str) -> None:
        node = self.nodes[-1]
        self.nodes[-1] = replace(node, largest=max(node.largest, largest), odd=node.odd or odd)


class _Values:
    """A reader of the numbers of an element. The text comes in pieces, which may end inside a number."""

    def __init__(self, array: bool, dim: str, attributes: Mapping[str, str]) -> None:
        self.array, self.dim = array, dim
        self.largest, self.odd = 0.0, ""
        self._count, self._tail = 0, ""
        #: A 1D table of all half floats also has rows for NaN and infinity. Their values may be NaN and infinity.
        self._halves = attributes.get("halfDomain", "").lower() == "true"
        self._colours = 3 if dim.split()[-1:] == ["3"] else 1
        #: Whether the numbers are bits of half floats. NaN and infinity are then integers.
        self._bits = attributes.get("rawHalfs", "").lower() == "true"

    def take(self, text: str) -> None:
        """Read the next piece."""
        text_so_far = self._tail + text
        cut = max(text_so_far.rfind(blank) for blank in " \t\r\n") + 1
        self._tail = text_so_far[cut:][: LONGEST + 1]
        words = text_so_far[:cut].split()
        for word in words:
            value = number(word, non_finite=True)
            if value is None:
                self.odd = self.odd or shown(word.encode())
            elif _finite(value) and not (self._bits and _non_finite_half(int(value))):
                self.largest = max(self.largest, abs(value))
            elif not (self._halves and _non_finite_half(self._count // self._colours)):
                self.odd = self.odd or word
            self._count += 1


def _finite(value: float | None) -> bool:
    """Whether ``value`` is a number within the range of float32."""
    return value is not None and abs(value) <= LARGEST


def _non_finite_half(bits: int) -> bool:
    """Whether ``bits`` are the half float NaN or infinity (IEEE 754, binary16)."""
    return bits & 0x7C00 == 0x7C00


def loads(scan: ClfScan) -> Iterator[LintFinding]:
    """Find out whether the installed OpenColorIO, which reads this format strictly, reads the file."""
    if not scan.broken:
        without_id = scan.of_smpte and "id" not in scan.root
        yield from loading(scan.refusal, *([OCIO_21] if without_id else OCIO))


def clf_form(scan: ClfScan) -> Iterator[LintFinding]:
    """Find faults of form. OpenColorIO refuses most of them with a clear message, but accepts a wrong scale."""
    if scan.broken:
        fates = refused(*OCIO, CLF_IO, how="stops at invalid XML")
        yield LintFinding(f"is not valid XML: {scan.broken}", "Export it again.", scan.broken_line, fates)
        return
    smpte = scan.of_smpte
    if smpte:
        fates = refused(CLF_IO, how="knows the Academy's namespace only")
        yield LintFinding("is in SMPTE 2136's namespace", "Write version 3 without it.", 1, fates)
    if "id" not in scan.root:
        fates = refused(OCIO_21, CLF_IO, how="requires an id") | ({} if smpte else refused(*OCIO, how="requires an id"))
        yield LintFinding("has no id", "Give ProcessList an id.", 1, fates)
    for node in scan.nodes:
        if node.name == "LUT3D" and "interpolation" not in node.attributes:
            fact = "states no interpolation for its LUT3D, so that each reader chooses one"
            yield LintFinding(fact, 'Write interpolation="tetrahedral".', node.line)
        if node.odd:
            fates = wrong(*OCIO, CLF_IO, how="computes with the value, or reads 0")
            if number(node.odd, non_finite=True) is None:
                # OpenColorIO skips commas and reads hexadecimal numbers. The rule `loads` reports its other refusals.
                hexadecimal = wrong(*OCIO, how="reads a hexadecimal number")
                fates = refused(CLF_IO, how="finds no number") | (hexadecimal if "0x" in node.odd.lower() else {})
            fact = f"has a value in its {node.name} that is no finite decimal number of float32: {node.odd}"
            yield LintFinding(fact, "Compute it again.", node.line, fates)
        depth = node.attributes.get("outBitDepth", "")
        if node.name.startswith("LUT") and depth.endswith("i") and 0 < node.largest <= 2:
            fates = wrong(*OCIO, CLF_IO, how="divides by the largest integer and shows almost black")
            fact = f"says outBitDepth {depth}, and has values up to {node.largest:g}"
            yield LintFinding(fact, "Write 32f.", node.line, fates)


RULES = (loads, clf_form)


def lint_clf(path: Path, _ask_readers: bool) -> Linted:
    """Lint a CLF or CTF. Raises LutgenError when it cannot be read."""
    scan = scan_clf(path)
    names = ", ".join(node.name for node in scan.nodes if node.dim or node.name == "Exponent") or "no operators"
    return Linted(path, "clf", (f"{names}, {scan.bytes} bytes",), tuple(findings(RULES, scan)))


FORMAT = FileKind((".clf", ".ctf"), lint_clf, RULES)
