"""CLF and CTF: their elements and the numbers of their arrays, read in one pass over the XML, and what readers ask.

CLF is SMPTE ST 2136-1, before that the Academy's S-2014-006; CTF is Autodesk's format with more operators.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from xml.parsers import expat

from lutgen.errors import LutgenError
from lutgen.lint.finding import CLF_IO, OCIO, OCIO_21, Finding, Linted, refused, wrong
from lutgen.lint.formats import Format, findings
from lutgen.lint.programs import MAX_BYTES
from lutgen.lint.programs.opencolorio import loading, refusal
from lutgen.lint.stream import BLOCK

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

#: The namespace of SMPTE ST 2136-1.
SMPTE = "smpte-ra.org/ns/2136-1"

#: Elements that are kept; more belong to no transform that anybody runs.
MAX_NODES = 1000


@dataclass(frozen=True)
class Node:
    """An operator: its name and attributes, its array's ``dim`` and the largest number in it, and where it is."""

    line: int
    name: str
    attributes: Mapping[str, str]
    dim: str = ""
    numbers: int = 0
    largest: float = 0.0


@dataclass(frozen=True)
class ClfScan:
    """A CLF as it stands: ``broken`` says why it is no XML, ``refusal`` why OpenColorIO does not read it."""

    path: Path
    bytes: int
    root: Mapping[str, str]
    nodes: tuple[Node, ...]
    broken: str
    broken_line: int
    refusal: str | None

    @property
    def of_smpte(self) -> bool:
        """Whether it is in SMPTE ST 2136-1's namespace, in which a file needs no id."""
        return SMPTE in self.root.get("xmlns", "")


def scan_clf(path: Path) -> ClfScan:
    """Read a CLF in one pass, then ask the installed OpenColorIO.

    Raises
    ------
    LutgenError
        The file cannot be read.

    """
    reader = _Reader()
    broken, line = "", 0
    try:
        with path.open("rb") as file:
            while chunk := file.read(BLOCK):
                reader.parser.Parse(chunk, False)  # noqa: FBT003 - expat takes no keyword
            reader.parser.Parse(b"", True)  # noqa: FBT003 - expat takes no keyword
    except OSError as error:
        message = f"{path}: cannot be read: {(error.strerror or str(error)).lower()}. Give the name of a LUT."
        raise LutgenError(message) from None
    except expat.ExpatError as error:
        broken, line = expat.ErrorString(error.code), error.lineno
    except (LookupError, ValueError) as error:
        broken, line = f"its encoding is none that XML readers know: {error}", 1
    except _EntityError:
        broken, line = "it declares entities, which can fill any memory", reader.parser.CurrentLineNumber
    size = path.stat().st_size
    asked = not broken and size <= MAX_BYTES
    return ClfScan(path, size, reader.root, tuple(reader.nodes), broken, line, refusal(path) if asked else None)


class _EntityError(Exception):
    """The document declares an entity."""


@dataclass
class _Reader:
    root: dict[str, str] = field(default_factory=dict)
    nodes: list[Node] = field(default_factory=list)
    depth: int = 0

    def __post_init__(self) -> None:
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.EntityDeclHandler = self._entity
        self.parser.buffer_text = True
        self._dim, self._tail, self._numbers, self._largest, self._in_array = "", "", 0, 0.0, False

    def _entity(self, *_: object) -> None:
        raise _EntityError

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth == 1:
            self.root = {"": name, **attributes}
        elif self.depth == 2 and len(self.nodes) < MAX_NODES:
            self.nodes.append(Node(self.parser.CurrentLineNumber, name, attributes))
        elif self.depth == 3 and name == "Array":
            self._dim, self._tail, self._numbers, self._largest = attributes.get("dim", ""), "", 0, 0.0
            self._in_array = True

    def _text(self, text: str) -> None:
        if self._in_array:
            # A number may be cut between two pieces of text.
            whole = self._tail + text
            cut = max(whole.rfind(" "), whole.rfind("\n"), whole.rfind("\t")) + 1
            self._tail = whole[cut:][:BLOCK]
            self._count(whole[:cut])

    def _count(self, text: str) -> None:
        for word in text.split():
            self._numbers += 1
            try:
                self._largest = max(self._largest, abs(float(word)))
            except ValueError:
                continue

    def _end(self, name: str) -> None:
        if self.depth == 3 and name == "Array" and self.nodes:
            self._count(self._tail)
            node = self.nodes[-1]
            self.nodes[-1] = Node(node.line, node.name, node.attributes, self._dim, self._numbers, self._largest)
            self._in_array = False
        self.depth -= 1


def loads(scan: ClfScan) -> Iterator[Finding]:
    """Whether the installed OpenColorIO, which reads this format strictly, reads the file at all."""
    if not scan.broken:
        without_id = scan.of_smpte and "id" not in scan.root
        yield from loading(scan.refusal, *([OCIO_21] if without_id else OCIO))


def clf_form(scan: ClfScan) -> Iterator[Finding]:
    """OpenColorIO refuses most faults with a clear sentence; scale faults it shows."""
    if scan.broken:
        fates = refused(*OCIO, CLF_IO, how="reads no broken XML")
        yield Finding(f"is no XML that can be read: {scan.broken}", "Export it again.", scan.broken_line, fates)
        return
    smpte = scan.of_smpte
    if smpte:
        fates = refused(CLF_IO, how="knows the Academy's namespace alone")
        yield Finding("is in SMPTE 2136's namespace", "Write version 3 without it.", 1, fates)
    if "id" not in scan.root:
        fates = refused(OCIO_21, CLF_IO, how="asks for an id") | ({} if smpte else refused(*OCIO, how="asks for an id"))
        yield Finding("has no id", "Give ProcessList an id.", 1, fates)
    for node in scan.nodes:
        if node.name == "LUT3D" and "interpolation" not in node.attributes:
            what = "does not say how its LUT3D is interpolated: readers choose"
            yield Finding(what, 'Write interpolation="tetrahedral".', node.line)
        depth = node.attributes.get("outBitDepth", "")
        if node.name.startswith("LUT") and depth.endswith("i") and 0 < node.largest <= 2:
            fates = wrong(*OCIO, CLF_IO, how="divides by the largest integer: almost black")
            yield Finding(
                f"says outBitDepth {depth}, and has values up to {node.largest:g}", "Write 32f.", node.line, fates
            )


RULES = (loads, clf_form)


def lint_clf(path: Path, _ask_readers: bool) -> Linted:
    """Lint one; raises LutgenError where it cannot be read."""
    scan = scan_clf(path)
    names = ", ".join(node.name for node in scan.nodes if node.dim or node.name == "Exponent") or "no operators"
    return Linted(path, "clf", (f"{names}, {scan.bytes} bytes",), tuple(findings(RULES, scan)))


FORMAT = Format((".clf", ".ctf"), lint_clf, RULES)
