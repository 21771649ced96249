"""The result of a lint: findings, and what each reader does with the file.

A finding names the readers that it affects and what each of them does. Its level is computed from that, so that no rule
can call a file harmless that a reader refuses:

``error``    at least one reader takes the file and shows something else, or no reader takes it
``warning``  at least one reader refuses the file with a message
``note``     every reader shows what the author meant; the finding is only worth knowing
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

READS, REFUSES, WRONG = "reads", "refuses", "silently wrong"

#: Outcomes by weight: where findings differ for a reader, the last of these counts, since a refused file is not shown.
OUTCOMES = (READS, WRONG, REFUSES)

LEVELS = ("error", "warning", "note")

OCIO_21, OCIO_26 = "OpenColorIO 2.1", "OpenColorIO 2.6"
FFMPEG, PILLOW, COLOUR = "ffmpeg lut3d", "pillow_lut", "colour"
CLF_IO = "colour-clf-io"
BLENDER, NUKE, DJV = "Blender", "Nuke", "DJV"
LCMS_8, LCMS_16 = "LittleCMS, 8 bit", "LittleCMS, 16 bit"
ARGYLL, CHROMIUM = "Argyll", "Chromium"
HALDCLUT, OBS = "ffmpeg haldclut", "OBS Studio"

#: A program that checks configs; it shows no pictures.
OCIOCHECK = "ociocheck"

#: The readers of each kind of file. oiiotool, ociobakelut, Blender and Nuke read LUT files through OpenColorIO.
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
    "obs": (OBS, HALDCLUT),
}


class Fate(NamedTuple):
    """What one reader does with a file: one of ``OUTCOMES``, and how in a few words."""

    outcome: str
    how: str = ""


def refused(*readers: str, how: str = "") -> dict[str, Fate]:
    """Return the fate of readers that stop with an error."""
    return {reader: Fate(REFUSES, how) for reader in readers}


def wrong(*readers: str, how: str) -> dict[str, Fate]:
    """Return the fate of readers that give no error and show something else."""
    return {reader: Fate(WRONG, how) for reader in readers}


@dataclass(frozen=True)
class LintFinding:
    """One fact about a file that affects a reader, or that its author should know."""

    #: What the file has (the file is the subject of the sentence), and what to do about it.
    what: str
    remedy: str
    #: Line number of the first occurrence, from 1; 0 where no line can be named.
    line: int = 0
    #: What the affected readers do. Readers without an entry show what the author meant.
    fates: Mapping[str, Fate] = field(default_factory=dict)
    #: Whether the fault is in the numbers themselves. Readers show these as they are, so that asking installed readers
    #: cannot find the fault.
    in_the_file: bool = False
    #: Name of the rule, set by ``formats.findings``.
    rule: str = ""

    def level(self, readers: tuple[str, ...]) -> str:
        """Return ``error``, ``warning`` or ``note``, among the readers of such a file."""
        outcomes = {self.fates.get(reader, Fate(READS)).outcome for reader in readers}
        if WRONG in outcomes or outcomes == {REFUSES}:
            return "error"
        return "warning" if REFUSES in outcomes else "note"


class Trial(NamedTuple):
    """What an installed reader did with the file: one of ``OUTCOMES`` ("": not tried), and its message."""

    reader: str
    version: str
    outcome: str
    said: str


@dataclass(frozen=True)
class Linted:
    """What a lint found in one file."""

    path: Path
    #: A key of ``READERS``.
    kind: str
    #: Size, version and contents of the file, in words.
    facts: tuple[str, ...]
    #: In the order of the rules' names.
    findings: tuple[LintFinding, ...]
    #: What installed readers did, when they were asked.
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

    def fate(self, reader: str) -> tuple[Fate, LintFinding | None]:
        """Return what a reader does with the file, and the finding that says so, None where it shows what is meant."""
        return _worst(reader, self.findings)

    def disagreements(self) -> tuple[Trial, ...]:
        """The trials in which a reader did not do what the rules say."""
        return tuple(trial for trial in self.trials if trial.outcome and not self._foretold(trial))

    def _foretold(self, trial: Trial) -> bool:
        if trial.reader == OCIOCHECK:
            # ociocheck refuses less than the OpenColorIO that it is built with: it opens no LUT and shows no picture.
            library = OCIO_21 if trial.version.startswith("2.1.") else OCIO_26
            return trial.outcome == READS or self.fate(library)[0].outcome == REFUSES
        of_readers = [finding for finding in self.findings if not finding.in_the_file]
        return trial.outcome in {_worst(trial.reader, each)[0].outcome for each in (self.findings, of_readers)}

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


def _worst(reader: str, findings: Sequence[LintFinding]) -> tuple[Fate, LintFinding | None]:
    struck = [(finding.fates[reader], finding) for finding in findings if reader in finding.fates]
    return max(struck, key=lambda pair: OUTCOMES.index(pair[0].outcome)) if struck else (Fate(READS), None)
