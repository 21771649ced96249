"""The commands that reproduce the page's results: to copy, and to make the files to download."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lutgen.errors import LutgenError
from lutgen.names import FORETELLING_BASELINES

#: Name of the model file in the commands.
MODEL = "my-display.toml"

#: Kinds of LUTs and tables.
KINDS = ("aged", "compensated")


@dataclass(frozen=True)
class WindowState:
    """The state of a window, as arguments of the command line."""

    #: Files of readings and of the image.
    data: str
    image: str
    #: A saved model, and the baseline; None where not given.
    model: str | None = None
    baseline: str | None = None
    #: The user's own effects: Python files, and formulas by name.
    files: tuple[str, ...] = ()
    expressions: tuple[tuple[str, str], ...] = ()
    #: Effects that are switched on.
    on: tuple[str, ...] = ()
    #: Files that were dropped on the page; commands show their names without folders.
    dropped: frozenset[str] = frozenset()
    #: Whether ``data`` is a campaign file that this window has written from dropped sessions and their hours.
    written: bool = False

    @property
    def texts(self) -> tuple[str, ...]:
        """The formulas as arguments of ``--add-expr``."""
        return tuple(f"{name}: {text}" for name, text in self.expressions)

    def shown(self, path: str) -> str:
        """Return the name of a file as the user knows it."""
        return Path(path).name if path in self.dropped else path


def refine_words(state: WindowState, *, keep: bool) -> list[str]:
    """Return the command that fits the model with the effects that are switched on."""
    formulas = dict(state.expressions)
    add = ",".join(name for name in state.on if name not in formulas)
    words = ["lutgen", "refine", *_data(state)]
    words += ["--add", add] if add else []
    for name in state.on:
        words += ["--add-expr", f"{name}: {formulas[name]}"] if name in formulas else []
    return [*words, *(["--keep"] if keep else []), "-o", MODEL]


def plan_words(state: WindowState, between: Sequence[str]) -> list[str]:
    """Return the command that plans measurements: to distinguish two effects, or for general coverage."""
    pair = ["--between", ",".join(between)] if between else []
    return ["lutgen", "plan", *_data(state), *_formulas(state), *pair, "-o", "next.csv"]


def build_words(model: Sequence[str], *options: str, to: str) -> list[str]:
    """Return the command that builds LUTs of a model."""
    return ["lutgen", "build", *model, *options, "-o", to]


def lut_options(mode: str, hours: float, form: str, kind: str) -> list[str]:
    """Return the options of build for one LUT."""
    direction = ["--direction", "compensate"] if kind == "compensated" else []
    return ["--hours", f"{hours:.12g}", "--mode", mode, "--format", form, *direction]


def commands(
    state: WindowState,
    *,
    last: float,
    keep: bool,
    mode: str,
    hours: float,
    kind: str = "aged",
    between: Sequence[str] = (),
) -> list[dict[str, str]]:
    """Return the commands that reproduce the page, each with its label; ``between``: effects to distinguish."""
    model = model_options(state)
    first = (
        ("The same model", refine_words(state, keep=keep))
        if state.on
        else ("Where the model fails", ["lutgen", "compare", *_data(state)])
    )
    listed = [
        first,
        ("Find what is missing", ["lutgen", "diagnose", *_data(state), *_formulas(state)]),
        ("What to measure next", plan_words(state, between)),
        ("All LUTs and configs", build_words(model, "--hours", f"0..{last:.12g}", to="aged")),
        ("This hour's LUT", build_words(model, *lut_options(mode, hours, "cube", kind), to="this-hour")),
        ("The report", report_words(state, model, to="report.html")),
    ]
    # A display that is known only at hour 0 does not age without effects.
    kept = listed[:3] if state.baseline in FORETELLING_BASELINES and not (state.on or state.model) else listed
    return [{"words": label, "command": shlex.join(words)} for label, words in kept]


def model_options(state: WindowState) -> list[str]:
    """Return the options of ``lutgen build`` that name the shown model."""
    if state.on:
        return ["--model", MODEL]
    if state.model:
        return ["--model", state.model]
    baseline = ["--baseline", state.baseline] if state.baseline else []
    return ["--display", state.shown(state.data), *baseline]


def report_words(state: WindowState, model: Sequence[str], *, to: str) -> list[str]:
    """Return the command that writes the report."""
    return ["lutgen", "report", state.shown(state.image), *model, "--data", state.shown(state.data), "-o", to]


def _formulas(state: WindowState) -> list[str]:
    """Return the options with one-line effects, for a command that may choose these effects."""
    return [word for text in state.texts for word in ("--add-expr", text)]


def _data(state: WindowState) -> list[str]:
    """Return DATA and the options of the model."""
    words = [state.shown(state.data)]
    for name, value in (("baseline", state.baseline), ("model", state.model)):
        words += [f"--{name}", value] if value else []
    for file in state.files:
        words += ["--effects", state.shown(file)]
    return words


def example_readings() -> Path:
    """Return the path of the simulated campaign; its first line states that it is simulated."""
    return _example("display-a.csv")


def tissue() -> Path:
    """Return the path of the picture of tissue: scikit-image's ``immunohistochemistry()``, 512 × 512."""
    return _example("tissue.jpg")


def _example(name: str) -> Path:
    """Return the path of an example in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "examples", package.parent / "examples"):
        if (folder / name).is_file():
            return folder / name
    raise LutgenError(f"the example {name} is missing here. Reinstall lutgen, or give DATA and --image.")
