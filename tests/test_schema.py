"""The JSON of compare, diagnose, refine and plan: the promised keys, strict JSON, and the published schemas."""

import json
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from lutgen.cli.outputs import write_json
from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.diagnose import VERDICTS, diagnose
from lutgen.criticism.plan import plan
from lutgen.criticism.refine import refine
from lutgen.history.causes import ON_THE_DISPLAY, causes
from lutgen.history.decay import LAWS
from lutgen.history.history import QUANTITIES
from lutgen.history.patches import GAMUTS
from lutgen.history.trend import STATUSES
from lutgen.history.verdicts import KINDS
from lutgen.names import BASELINES
from lutgen.readings import Measurements
from lutgen.readings.conditions import COLUMNS, CONDITIONS
from tests.altered import altered
from tests.campaigns import single, text_of
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.schemas import schemas, validator

pytestmark = pytest.mark.numbers

#: Data sets for every command.
SETS = ("leak", "healthy", "tips only", "one hour")


def readings(name: str, text: str = "") -> Measurements:
    table: Measurements = read(text or text_of(name), file=f"{name}.csv", sha256="0" * 64)
    return table


def once() -> Measurements:
    return readings("once", single(text_of("leak")))


def of(command: Callable[[Measurements], Any], name: str) -> dict[str, Any]:
    document: dict[str, Any] = command(readings(name)).as_json()
    return document


#: Output of the commands for several data sets, by command and data set.
OUTPUTS: dict[str, Callable[[], dict[str, Any]]] = {
    **{
        f"{command} {name}": partial(of, run, name)
        for command, run in (("compare", compare), ("diagnose", diagnose), ("plan", plan))
        for name in SETS
    },
    "compare edge": lambda: compare(readings("edge")).as_json(),
    "compare fading": lambda: compare(readings("fading"), baseline="first-hour").as_json(),
    "diagnose fading": lambda: diagnose(readings("fading"), baseline="first-hour").as_json(),
    "diagnose once": lambda: diagnose(once(), instrument="0.002,0.003").as_json(),
    "plan between": lambda: plan(once(), between=("crosstalk", "loading")).as_json(),
    "plan effect": lambda: plan(readings("leak"), effect="warm-up").as_json(),
    "refine leak": lambda: refine(readings("leak"), ["black-level"]).as_json("model.toml"),
    "refine auto": lambda: refine(readings("healthy"), auto=True).as_json(),
}


@cache
def output(name: str) -> dict[str, Any]:
    return OUTPUTS[name]()


def strict(name: str, capsys: pytest.CaptureFixture[str]) -> Any:
    """An output as ``--json -`` prints it, read by a reader that accepts no NaN."""
    write_json(output(name), "-")

    def refuse(word: str) -> None:
        pytest.fail(f"{name} holds {word}")

    return json.loads(capsys.readouterr().out, parse_constant=refuse)


def test_schemas_are_schemas_and_describe_what_they_hold() -> None:
    assert len(schemas()) >= 18
    for name, content in schemas().items():
        validator(name).check_schema(content)
        version = 2 if name in {"compare", "diagnose", "refine"} else 1
        assert content["$id"] == f"urn:lutgen:schema:{name}:{version}"


def test_schemas_name_what_the_library_has() -> None:
    assert schemas()["diagnose"]["properties"]["verdict"]["enum"] == list(VERDICTS)
    assert schemas()["compare"]["properties"]["baseline"]["enum"] == list(BASELINES)
    session = schemas()["explain"]["properties"]["sessions"]["items"]["properties"]
    assert session["verdict"]["enum"] == list(KINDS)
    assert session["display"]["enum"] == list(ON_THE_DISPLAY)
    gamut = schemas()["inspect"]["properties"]["sessions"]["items"]["properties"]["gamut"]
    nearest = next(each for each in gamut.get("anyOf", [gamut]) if "properties" in each)["properties"]["nearest"]
    assert nearest["enum"] == list(GAMUTS)
    limit = schemas()["trend"]["properties"]["limits"]["items"]["properties"]
    assert limit["quantity"]["enum"] == list(QUANTITIES)
    assert limit["status"]["enum"] == list(STATUSES)
    assert schemas()["trend"]["$defs"]["law"]["enum"] == [law.name for law in LAWS]


@pytest.mark.parametrize("key", ["causes", "certain"])
def test_a_verdict_on_sessions_may_name_every_cause(key: str) -> None:
    schema = schemas()["explain"]["properties"]["sessions"]["items"]["properties"][key]
    Draft202012Validator(schema).validate(list(causes()))


@pytest.mark.parametrize("name", ["compare leak", "plan leak"])
def test_conditions_are_called_as_the_library_calls_them(name: str) -> None:
    written = output(name)
    dimensions = {"hour", "level", "family", *(each.key for each in CONDITIONS)}
    assert {each["by"] for each in written.get("where", ())} <= dimensions
    columns = {"R", "G", "B", "note", *COLUMNS}
    assert {key for patch in written.get("patches", ()) for key in patch} <= columns
    assert written.get("where") or written["patches"]


@pytest.mark.parametrize("name", mostly_slow(OUTPUTS, *(name for name in OUTPUTS if name.endswith(" leak"))))
def test_what_is_written_is_as_its_schema_says(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    validator(name.partition(" ")[0]).validate(strict(name, capsys))


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [
        ("compare leak", ("noise", "source"), "guessed"),
        ("compare leak", ("data", "sha256"), "none"),
        ("compare leak", ("schema",), 1),
        ("compare leak", ("where", 0, "by"), 3),
        ("compare leak", ("noise", "relative"), 0.002),
        ("compare leak", ("noise", "correlation", 0, 1), 1.5),
        ("refine leak", ("schema",), 1),
        ("diagnose leak", ("verdict",), "maybe"),
        ("diagnose leak", ("error", "rms_sigma"), None),
        ("diagnose leak", ("ranking", 0, "explained"), 1.5),
        ("diagnose leak", ("visibility", 0, "visible"), None),
        ("refine leak", ("parameters", "black-level", "new", "stderr"), "small"),
        ("refine leak", ("steps", 0, "error", "delta_e_max"), -1.0),
        ("plan leak", ("patches", 0, "R"), 255),
        ("plan leak", ("patches", 0, "lux"), "40"),
    ],
)
def test_schemas_refuse_what_is_wrong(name: str, path: tuple[str | int, ...], value: object) -> None:
    with pytest.raises(ValidationError):
        validator(name.partition(" ")[0]).validate(altered(output(name), path, value))


def test_what_is_not_finite_is_null(capsys: pytest.CaptureFixture[str]) -> None:
    write_json({"a": [float("nan"), {"b": float("inf")}, (1.5, 2)]}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": [None, {"b": None}, [1.5, 2]]}
