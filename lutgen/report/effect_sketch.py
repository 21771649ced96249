"""A first draft of the Python file of a new effect, for an error that no known effect explains."""

import re
from math import isfinite

import numpy as np

from lutgen.criticism.diagnose import Diagnosis
from lutgen.criticism.search.explanation import unexplained_fit
from lutgen.criticism.search.free_term import probe
from lutgen.criticism.verdict.words import changes, strongest
from lutgen.effects import STAGES
from lutgen.readings.conditions import CONDITIONS, Condition, Sketch

#: Suggested name of the file, and the name of the effect in it.
STUB_FILE, STUB_NAME = "my_effect.py", "my-effect"

_ADDED = Sketch("optics", (), "share of white's light that is added", "xyz + {size} * scene.white")
_CAPPED = Sketch("instrument", (), "cd/m² that the meter adds in the dark", "xyz + {size}")


def of_condition(condition: Condition) -> tuple[str, Sketch]:
    """Return pattern and draft for a condition without ``sketches``: light that follows the condition's value."""
    column = condition.columns[0]
    reach = abs(column.axis[1] - column.axis[0])
    values = {each.name: np.array([each.shown]) for each in condition.columns}
    names = {condition.cell, *condition.strange, *condition.signatures(values, values)}
    pattern = rf".*\b({'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))})\b"
    if isfinite(column.usual):
        factor = f"(scene.{column.name} - {column.usual:g}) / {reach:g}"
    else:
        factor = f"np.exp(-scene.{column.name} / {reach:g})"
    what = f"share of the light at the far end of the {condition.name}"
    return pattern, Sketch("optics", (column.name,), what, f"xyz * (1.0 + {{size}} * {factor})")


#: Pattern → draft for all names; the first pattern that matches is used.
FOLLOWS = {
    r"light added under": _CAPPED,
    r"light added (everywhere|to black)": _ADDED,
    **{
        pattern: sketch
        for condition in CONDITIONS
        for pattern, sketch in (condition.sketches or dict([of_condition(condition)])).items()
    },
    r".*(×|secondary|mixture)": Sketch(
        "mixing",
        (),
        "share of a channel's light that each other channel takes",
        "linear * (1.0 - {size} * (linear.sum(axis=-1, keepdims=True) - linear))",
    ),
    r".*(level|red|green|blue|grey)": Sketch("transfer", (), "change of the exponent", "linear ** (1.0 + {size})"),
    r"lens cap": _CAPPED,
    r"black": _ADDED,
    r"": Sketch("optics", (), "share of the light", "xyz * (1.0 + {size})"),
}

#: Pattern of the same name → the component of X, Y, Z, or the channel, on which the size acts.
_PARTS = {
    r"light.* in X$": "np.array([1.0, 0.0, 0.0])",
    r"light.* in Z$": "np.array([0.0, 0.0, 1.0])",
    r"light by red near": "np.array([1.0, 0.0, 0.0])",
    r"light by green near": "np.array([0.0, 1.0, 0.0])",
    r"light by blue near": "np.array([0.0, 0.0, 1.0])",
}


def sketch(diagnosis: Diagnosis) -> str:
    """Return the Python source of an effect that follows the model's residual."""
    follows = diagnosis.verdict.signatures or probe(diagnosis.explanation.base, diagnosis.error).names
    where, course = strongest(unexplained_fit(diagnosis.explanation))
    if follows:
        return sketched(follows[0], misfit=changes(follows))
    return sketched(f"{where}, {course}", misfit=f"it is largest in the readings called '{where}', {course}")


def sketched(name: str, *, misfit: str) -> str:
    """Return the source of a valid effect that follows the probe, or the readings, of this ``name``."""
    draft = next(each for pattern, each in FOLLOWS.items() if re.match(pattern, name))
    part = next((each for pattern, each in _PARTS.items() if re.match(pattern, name)), "")
    growing = "growing" in name
    size = " * ".join(["size", *(["scene.tau"] if growing else []), *([part] if part else [])])
    formula = draft.formula.format(size=size)
    signal = formula.partition(" ")[0]
    imports = "import numpy as np\n\n" if "np." in formula else ""
    needs = "    needs={},\n".format(str(draft.needs).replace("'", '"')) if draft.needs else ""
    return (
        f'"""What happens, in one sentence; then the mechanism and where it is described.\n\n'
        f"Misfit to be explained: {misfit}.\n"
        f'"""\n\n{imports}'
        f"from lutgen.effects import Parameter, effect\n\n\n"
        f"@effect(\n"
        f'    stage="{draft.stage}",  # {signal}: {STAGES[draft.stage]}\n'
        f'    neutral={{"size": 0.0}},\n'
        f"{needs}"
        f'    size=Parameter({draft.range}, "1", "{draft.meaning}{" at 18 000 h" if growing else ""}"),\n'
        f")\n"
        f"def {STUB_NAME.replace('-', '_')}({signal}, scene, *, size):\n"
        f"    return {formula}\n"
    )
