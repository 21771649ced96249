"""The commands that do what the page shows: to be copied, and to make the files to download."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.names import FORETELLING_BASELINES

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Name of the model file in the commands.
MODEL = "my-display.toml"

#: Kinds of LUTs and of tables that are shown.
KINDS = ("aged", "compensated")


@dataclass(frozen=True)
class Asked:
    """What a window shows, as arguments of the command line."""

    #: Files of readings and of the image.
    data: str
    image: str
    #: A saved model, and the baseline; None where not given.
    model: str | None = None
    baseline: str | None = None
    #: Effects of the user's own: Python files, and formulas by name.
    files: tuple[str, ...] = ()
    expressions: tuple[tuple[str, str], ...] = ()
    #: Effects that are switched on.
    on: tuple[str, ...] = ()
    #: Files that the page has sent; commands show their names without folders.
    dropped: frozenset[str] = frozenset()
    #: Whether ``data`` is a campaign file that only this window has, made of dropped sessions and their hours.
    written: bool = False

    @property
    def texts(self) -> tuple[str, ...]:
        """The formulas as ``--add-expr`` takes them."""
        return tuple(f"{name}: {text}" for name, text in self.expressions)

    def shown(self, path: str) -> str:
        """Name a file as the user knows it."""
        return Path(path).name if path in self.dropped else path


def refine_words(asked: Asked, *, keep: bool) -> list[str]:
    """Return the command that makes the model of what is switched on."""
    formulas = dict(asked.expressions)
    add = ",".join(name for name in asked.on if name not in formulas)
    words = ["lutgen", "refine", *_data(asked)]
    words += ["--add", add] if add else []
    for name in asked.on:
        words += ["--add-expr", f"{name}: {formulas[name]}"] if name in formulas else []
    return [*words, *(["--keep"] if keep else []), "-o", MODEL]


def plan_words(asked: Asked, between: Sequence[str]) -> list[str]:
    """Return the command that lists what to measure next: to tell two effects apart, or for general coverage."""
    pair = ["--between", ",".join(between)] if between else []
    return ["lutgen", "plan", *_data(asked), *_formulas(asked), *pair, "-o", "next.csv"]


def build_words(model: Sequence[str], *options: str, to: str) -> list[str]:
    """Return the command that builds LUTs of a model."""
    return ["lutgen", "build", *model, *options, "-o", to]


def lut_options(mode: str, hours: float, form: str, kind: str) -> list[str]:
    """Return the options of build for one LUT."""
    direction = ["--direction", "compensate"] if kind == "compensated" else []
    return ["--hours", f"{hours:.12g}", "--mode", mode, "--format", form, *direction]


def commands(
    asked: Asked,
    *,
    last: float,
    keep: bool,
    mode: str,
    hours: float,
    kind: str = "aged",
    between: Sequence[str] = (),
) -> list[dict[str, str]]:
    """Return the commands that do what the page shows, each with its words; ``between``: effects to be told apart."""
    model = model_options(asked)
    first = (
        ("The same model", refine_words(asked, keep=keep))
        if asked.on
        else ("Where the model fails", ["lutgen", "compare", *_data(asked)])
    )
    listed = [
        first,
        ("Find what is missing", ["lutgen", "diagnose", *_data(asked), *_formulas(asked)]),
        ("What to measure next", plan_words(asked, between)),
        ("All LUTs and configs", build_words(model, "--hours", f"0..{last:g}", to="aged")),
        ("This hour's LUT", build_words(model, *lut_options(mode, hours, "cube", kind), to="this-hour")),
        ("The report", report_words(asked, model, to="report.html")),
    ]
    # A display that is known at hour 0 alone does not age without effects.
    kept = listed[:3] if asked.baseline in FORETELLING_BASELINES and not (asked.on or asked.model) else listed
    return [{"words": words, "command": shlex.join(command)} for words, command in kept]


def model_options(asked: Asked) -> list[str]:
    """Return how the model that is shown is named to build."""
    if asked.on:
        return ["--model", MODEL]
    if asked.model:
        return ["--model", asked.model]
    baseline = ["--baseline", asked.baseline] if asked.baseline else []
    return ["--display", asked.shown(asked.data), *baseline]


def report_words(asked: Asked, model: Sequence[str], *, to: str) -> list[str]:
    """Return the command that writes the report."""
    return ["lutgen", "report", asked.shown(asked.image), *model, "--data", asked.shown(asked.data), "-o", to]


def _formulas(asked: Asked) -> list[str]:
    """Effects of one line, for a command that may choose them."""
    return [word for text in asked.texts for word in ("--add-expr", text)]


def _data(asked: Asked) -> list[str]:
    """DATA and the options of the model."""
    words = [asked.shown(asked.data)]
    for name, value in (("baseline", asked.baseline), ("model", asked.model)):
        words += [f"--{name}", value] if value else []
    for file in asked.files:
        words += ["--effects", asked.shown(file)]
    return words


def example_readings() -> Path:
    """Path of the simulated campaign; its first line says that nobody measured it."""
    return _example("display-a.csv")


def tissue() -> Path:
    """Path of the picture of tissue: scikit-image's ``immunohistochemistry()``, 512 × 512."""
    return _example("tissue.jpg")


def _example(name: str) -> Path:
    """Find a file in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "examples", package.parent / "examples"):
        if (folder / name).is_file():
            return folder / name
    raise LutgenError(f"the example {name} is missing here. Reinstall lutgen, or give DATA and --image.")
