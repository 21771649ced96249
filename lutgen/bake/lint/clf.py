"""Reading anybody's CLF or CTF: the elements and how many numbers their arrays hold, in one pass over the XML."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from xml.parsers import expat

from lutgen.bake.lint.stream import BLOCK
from lutgen.bake.lint.table import refusal
from lutgen.bake.lint.trial import MAX_BYTES
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

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
