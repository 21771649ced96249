"""reference/effects/: a page for each built-in effect, from its declaration, with the plot that lutgen draws of it."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from docs.generate.markup import inline, page, table
from lutgen.effects import STAGES, catalogue
from lutgen.errors import listed

if TYPE_CHECKING:
    from PIL import Image

    from lutgen.effects import Effect

#: Widths of a plot in pixels: the largest width with at most MOST bytes is taken. Then colours, and rounds of k-means.
WIDTHS, MOST = (1000, 900, 800, 700), 30_000
COLOURS, ROUNDS = 32, 3

#: Phrases that begin a new line in the text of an effect.
_POINTS = re.compile(r"^(?=Meaning of 0 and 1:|Valid |Sources?:|Assumption:)", re.MULTILINE)


#: Causes of aging, according to the paper's first section and for present displays, and of errors of measurement, and
#: the effects of each cause. An effect that only selects a matrix of the paper has no cause.
CAUSES = {
    "phosphors wear out": ("phosphor-wear", "backlight-decay"),
    "optical layers absorb more: short wavelengths most; all alike": ("yellowing", "backlight-decay"),
    "liquid crystal absorbs more": ("yellowing", "backlight-decay"),
    "liquid crystal responds less to its drive; in another shape; no longer closes":
        ("drive-loss", "eotf-drift", "black-level"),
    "contacts corrode, drive levels fall": ("drive-loss",),
    "dust and dirt take light; scatter that of the screen; scatter that of the room":
        ("backlight-decay", "veiling-glare", "ambient-reflection"),
    "the screen ages unevenly": ("edge-falloff",),
    "emitters of an OLED burn in, at first quickly": ("burn-in-decay", "channel-decay"),
    "local dimming, dynamic contrast": ("dynamic-contrast",),
    "the curve moves with the temperature": ("temperature-gamma",),
    "channels disturb one another": ("crosstalk",),
    "the drivers of one channel drift": ("channel-gamma",),
    "the colour of a primary depends on its level": ("primary-shift",),
    "the power of the light is limited": ("loading",),
    "a sensor holds white until the lamp has no reserve": ("stabilizer-headroom",),
    "a table of drive levels is too coarse": ("quantization",),
    "somebody calibrates the display again": ("recalibration",),
    "the display is cold after power-on; warmer than before": ("warm-up", "temperature"),
    "a meter's dark signal is added": ("meter-offset",),
    "a colorimeter's filters drift; match the observer less and less": ("meter-drift", "meter-mismatch"),
}  # fmt: skip


def pages() -> dict[str, str]:
    """Return path below docs/reference → text."""
    effects = catalogue().values()
    return {"effects/index.md": _index()} | {f"effects/{each.name}.md": _page(each) for each in effects}


def _index() -> str:
    rows = [
        (f"[{each.name}]({each.name}.md)", each.stage, inline(each.summary), _baselines(each), _needs(each))
        for each in catalogue().values()
    ]
    return page(
        "Effects",
        f"The {len(rows)} physical effects that lutgen knows, in the order in which light and signal meet them. Each "
        "page gives the equation, what 0 and 1 mean, where it holds, what its size rests on, and what it is confused "
        "with. Most sizes are assumptions and say so: a fit starts from them, and its bounds are wide.",
        table(("effect", "stage", "what happens", "seen with `--baseline`", "columns it needs"), rows),
        "Causes of aging and of measurement errors, and the effects that model them. Causes with the same effect on "
        "readings share one effect, because no reading could separate two.",
        table(("cause", "inside"), [(cause, _inside(names)) for cause, names in CAUSES.items()]),
        "A stage is where an effect acts, and on which signal:",
        table(("stage", "signal"), STAGES.items()),
        "Add one: [effects of your own](../../guides/your-own-effects.md).",
    )


def _inside(names: tuple[str, ...]) -> str:
    """Return links to effects; a name that is not in the catalogue raises KeyError."""
    return ", ".join(f"[{catalogue()[name].name}]({name}.md)" for name in names)


def _needs(effect: Effect) -> str:
    return ", ".join(f"`{name}`" for name in effect.needs) or "none"


def _page(effect: Effect) -> str:
    head, *points = _POINTS.split(effect.text.strip())
    summary, _, rest = head.partition("\n\n")
    facts = [
        f"Stage `{effect.stage}`: {STAGES[effect.stage]}.",
        f"Baselines that show it: {_baselines(effect)}.{_contained(effect)}",
        f"Columns of readings that it needs: {_needs(effect)}.",
        f"Source in short: {inline(effect.source) or 'none given'}.",
    ]
    parts = [
        inline(summary),
        inline(rest),
        "\n".join(f"- {inline(' '.join(point.split()))}" for point in points),
        f"![What {effect.name} does at its typical size]({effect.name}.png)",
        "\n".join(f"- {fact}" for fact in facts),
        _parameters(effect),
        _confused(effect),
        f"Drawn by `lutgen effects {effect.name} --plot {effect.name}.png`.",
    ]
    return page(effect.name, *parts)


def _baselines(effect: Effect) -> str:
    """Return the baselines under which readings can show an effect."""
    if effect.baseline == "first-hour":
        return "`first-hour` and `native-first-hour`"
    # Behind a display's own curves no matrix of the paper is selected.
    return "`colour-points` and `first-hour`" if effect.stage == "selection" else "every"


def _contained(effect: Effect) -> str:
    """Say which sizes at hour 0 a fit leaves to a display's own model of the first session; "" if it has none."""
    forms = (effect.forms, effect.since_first_session().forms)
    freed, later = ({name for form in each for name in form} for each in forms)
    if contained := [f"`{name}`" for name in effect.parameters if name in freed - later]:
        it = "them" if len(contained) > 1 else "it"
        does = f"leaves {listed(contained)} out: the first session's own model contains {it}"
    elif "new" in later:
        does = "frees `new` too: the first session's own model is that of readings at rest"
    else:
        return ""
    return f" With `native` and `native-first-hour` a fit {does}."


def _parameters(effect: Effect) -> str:
    if not effect.parameters:
        return "It has no parameters."
    rows = [
        (
            f"`{name}`",
            f"{each.value:g}",
            f"{each.bounds[0]:g} to {each.bounds[1]:g}",
            each.unit,
            f"{effect.neutral[name]:g}" if name in effect.neutral else "–",
            each.meaning,
        )
        for name, each in effect.parameters.items()
    ]
    heads = ("parameter", "typical", "bounds", "unit", "does nothing at", "meaning")
    forms = [
        f"{number}. {', '.join(f'`{name}`' for name in form)}{' (refined)' if number > effect.refined else ''}"
        for number, form in enumerate(effect.forms, start=1)
    ]
    says = (
        "A fit frees one of these sets of parameters (a form), the simplest first. A refined form has the same physics "
        "and a freer formula:"
    )
    return "\n\n".join([table(heads, rows), says, "\n".join(forms)])


def _confused(effect: Effect) -> str:
    rows = [(f"[{name}]({name}.md)", separates) for name, separates in effect.confused_with.items()]
    return table(("looks like", "what separates them"), rows) if rows else "No other effect looks like it."


def plot(name: str) -> bytes:
    """Draw an effect as ``lutgen effects NAME --plot`` does, smaller and in fewer colours; return a PNG."""
    from click.testing import CliRunner
    from PIL import Image

    from lutgen.cli.command import group

    with TemporaryDirectory() as folder:
        path = Path(folder, "plot.png")
        done = CliRunner().invoke(group, ["effects", name, "--plot", str(path)], catch_exceptions=False)
        if done.exit_code:
            raise SystemExit(f"lutgen effects {name} --plot failed: {done.output}")
        with Image.open(path) as drawn:
            drawn.load()
    sizes = (_small(drawn.convert("RGB"), across) for across in WIDTHS)
    return next(each for each in sizes if len(each) <= MOST)


def _small(image: Image.Image, across: int) -> bytes:
    from PIL import Image

    smaller = image.resize((across, round(image.height * across / image.width)), Image.Resampling.LANCZOS)
    few = smaller.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, ROUNDS, dither=Image.Dither.NONE)
    stream = BytesIO()
    few.save(stream, "PNG", optimize=True)
    return stream.getvalue()
