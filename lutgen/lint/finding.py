"""What a lint says: findings, and what each reader makes of them.

A finding names the readers that are affected and how; its level follows from that, so that no rule can call harmless
what some reader refuses:

``error``    some reader takes the file and shows something else, or none reads it
``warning``  some reader refuses the file, and says so
``note``     every reader does what is meant; something is odd, or asks for care
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

READS, REFUSES, WRONG = "reads", "refuses", "silently wrong"

#: From harmless to worst for one reader: what is refused is not shown wrongly.
OUTCOMES = (READS, WRONG, REFUSES)

LEVELS = ("error", "warning", "note")

OCIO_21, OCIO_26 = "OpenColorIO 2.1", "OpenColorIO 2.6"
FFMPEG, PILLOW, COLOUR = "ffmpeg lut3d", "pillow_lut", "colour"
CLF_IO = "colour-clf-io"
BLENDER, NUKE, DJV = "Blender", "Nuke", "DJV"
LCMS_8, LCMS_16 = "LittleCMS, 8 bit", "LittleCMS, 16 bit"
ARGYLL, CHROMIUM = "Argyll", "Chromium"
HALDCLUT = "ffmpeg haldclut"

#: What may be asked of a config, though nobody looks at pictures through it.
OCIOCHECK = "ociocheck"

#: Who reads which kind of file. oiiotool, ociobakelut, Blender and Nuke read LUT files through OpenColorIO.
OCIO = (OCIO_21, OCIO_26)
READERS: Mapping[str, tuple[str, ...]] = {
    "cube": (*OCIO, FFMPEG, PILLOW, COLOUR),
    "clf": (*OCIO, CLF_IO),
    "lut": OCIO,
    "3dl": (*OCIO, FFMPEG),
    "config": (*OCIO, BLENDER, NUKE, DJV),
    "archive": (OCIO_26,),
    "profile": (LCMS_8, LCMS_16, ARGYLL, CHROMIUM),
    "link": (LCMS_8, LCMS_16, ARGYLL),
    "hald": (HALDCLUT,),
}


class Fate(NamedTuple):
    """What becomes of a file in one reader: one of ``OUTCOMES``, and how."""

    outcome: str
    how: str = ""


def refused(*readers: str, how: str = "") -> dict[str, Fate]:
    """Say that these readers stop with an error."""
    return {reader: Fate(REFUSES, how) for reader in readers}


def wrong(*readers: str, how: str) -> dict[str, Fate]:
    """Say that these readers go on and show something else."""
    return {reader: Fate(WRONG, how) for reader in readers}


@dataclass(frozen=True)
class Finding:
    """One thing about one file.

    Attributes
    ----------
    what, remedy
        What is there, and what to do; sentences.
    line
        The first line that it is on, counted from 1; 0 where it is on none.
    fates
        The readers that do not do what is meant.
    in_the_file
        The table itself is not what was meant, and readers show it as it is: no trial can tell.
    rule
        The rule's name; filled in by whoever runs the rules.

    """

    what: str
    remedy: str
    line: int = 0
    fates: Mapping[str, Fate] = field(default_factory=dict)
    in_the_file: bool = False
    rule: str = ""

    def level(self, readers: tuple[str, ...]) -> str:
        """Return ``error``, ``warning`` or ``note``, among the readers of such a file."""
        outcomes = {self.fates.get(reader, Fate(READS)).outcome for reader in readers}
        if WRONG in outcomes or outcomes == {REFUSES}:
            return "error"
        return "warning" if REFUSES in outcomes else "note"


class Trial(NamedTuple):
    """What a reader that is installed here did.

    ``outcome`` is one of ``OUTCOMES``, or empty where it could not be tried; ``said`` its words or the difference.
    """

    reader: str
    version: str
    outcome: str
    said: str


@dataclass(frozen=True)
class Linted:
    """What a lint found in one file.

    Attributes
    ----------
    kind
        A key of ``READERS``.
    facts
        What was read of the file, in words.
    findings
        In the order of the rules.
    trials
        What installed readers did, when they were asked.

    """

    path: Path
    kind: str
    facts: tuple[str, ...]
    findings: tuple[Finding, ...]
    trials: tuple[Trial, ...] = ()

    @property
    def readers(self) -> tuple[str, ...]:
        """The readers of such a file."""
        return READERS[self.kind]

    @property
    def clean(self) -> bool:
        """Whether every reader does what is meant, as the rules say and as far as was tried."""
        return all(finding.level(self.readers) == "note" for finding in self.findings) and all(
            trial.outcome in {READS, ""} for trial in self.trials
        )

    def fate(self, reader: str) -> tuple[Fate, Finding | None]:
        """Return the worst that becomes of the file in a reader, and the finding that says so."""
        return _worst(reader, self.findings)

    def disagreements(self) -> tuple[Trial, ...]:
        """The trials in which a reader did not do what the rules say."""
        return tuple(trial for trial in self.trials if trial.outcome and not self._told(trial))

    def _told(self, trial: Trial) -> bool:
        if trial.reader == OCIOCHECK:
            # It stands for its OpenColorIO, and refuses less: it looks at no LUT and shows nothing.
            library = OCIO_21 if trial.version.startswith("2.1.") else OCIO_26
            return trial.outcome == READS or self.fate(library)[0].outcome == REFUSES
        of_readers = [finding for finding in self.findings if not finding.in_the_file]
        return trial.outcome in {_worst(trial.reader, told)[0].outcome for told in (self.findings, of_readers)}

    def as_json(self) -> dict[str, Any]:
        """Return the result for a program to read; see ``schema/lint.json``."""
        return {
            "file": str(self.path),
            "kind": self.kind,
            "clean": self.clean,
            "facts": list(self.facts),
            "readers": {reader: self._fate_as_json(reader) for reader in self.readers},
            "findings": [
                {
                    "rule": each.rule,
                    "level": each.level(self.readers),
                    "line": each.line or None,
                    "what": each.what,
                    "remedy": each.remedy,
                    "readers": {reader: fate._asdict() for reader, fate in each.fates.items()},
                }
                for each in self.findings
            ],
            "trials": [trial._asdict() for trial in self.trials],
        }

    def _fate_as_json(self, reader: str) -> dict[str, Any]:
        fate, finding = self.fate(reader)
        return {"outcome": fate.outcome, "how": fate.how, "rule": finding.rule if finding else None}


def _worst(reader: str, findings: Sequence[Finding]) -> tuple[Fate, Finding | None]:
    struck = [(finding.fates[reader], finding) for finding in findings if reader in finding.fates]
    return max(struck, key=lambda pair: OUTCOMES.index(pair[0].outcome)) if struck else (Fate(READS), None)
