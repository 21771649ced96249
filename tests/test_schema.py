"""The JSON of compare, diagnose, refine and plan: the promised keys, strict, and as the published schemas say."""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING, Any

import pytest
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from referencing import Registry, Resource

from lutgen import LutgenError
from lutgen.cli.outputs import write_json
from lutgen.criticism.compare import compare
from lutgen.criticism.diagnose import VERDICTS, diagnose
from lutgen.criticism.plan import plan
from lutgen.criticism.refine import refine
from lutgen.criticism.schema import NAMES, schema
from lutgen.measurements import csv
from lutgen.names import BASELINES
from tests.altered import altered
from tests.campaigns import single, text_of

if TYPE_CHECKING:
    from lutgen.measurements import Measurements

pytestmark = pytest.mark.numbers

#: The keys that criticism.md promises.
PROMISED: dict[str, dict[str, Any]] = {
    "compare": {
        "schema": {}, "data": {"file": {}, "sha256": {}, "readings": {}, "hours": {}}, "baseline": {},
        "noise": {"relative": {}, "floor_cd_m2": {}, "session": {}, "source": {}},
        "error": {"delta_e_mean": {}, "delta_e_p95": {}, "delta_e_max": {}, "rms_sigma": {}},
        "floor": {"delta_e_mean": {}, "delta_e_p95": {}, "delta_e_max": {}, "rms_sigma": {}},
        "where": {"by": {}, "slice": {}, "n": {}, "delta_e_mean": {}, "rms_sigma": {}, "mean_residual_xyz": {}},
    },
    "diagnose": {
        "verdict": {}, "sentence": {}, "effects": {}, "rivals": {},
        "ranking": {"effect": {}, "delta_bic": {}, "rms_sigma": {}, "held_out_rms_sigma": {}, "explained": {},
                    "absorbed": {}, "parameters": {}},
        "visibility": {"effect": {}, "visible": {}, "smallest_detectable": {}, "unit": {}, "absorbed": {}},
    },
    "refine": {
        "before": {"rms_sigma": {}}, "steps": {"added": {}, "error": {"rms_sigma": {}}}, "after": {"rms_sigma": {}},
        "floor": {"rms_sigma": {}}, "parameters": {"black-level": {"new": {"value": {}, "stderr": {}, "unit": {},
                                                                          "at_bound": {}}}}, "model": {},
    },
    "plan": {"sentence": {}, "patches": {"R": {}, "G": {}, "B": {}}},
}  # fmt: skip


#: Data sets that every command is asked of.
SETS = ("leak", "healthy", "tips only", "one hour")


def readings(name: str, text: str = "") -> Measurements:
    found: Measurements = csv.read(text or text_of(name), file=f"{name}.csv", sha256="0" * 64)
    return found


@cache
def outputs() -> dict[str, dict[str, Any]]:
    """What the commands write for several data sets, by command and data set."""
    found: dict[str, dict[str, Any]] = {}
    once = readings("once", single(text_of("leak")))
    for name in SETS:
        found[f"compare {name}"] = compare(readings(name)).as_json()
        found[f"diagnose {name}"] = diagnose(readings(name)).as_json()
        found[f"plan {name}"] = plan(readings(name)).as_json()
    found["compare edge"] = compare(readings("edge")).as_json()
    found["compare fading"] = compare(readings("fading"), baseline="fresh").as_json()
    found["diagnose fading"] = diagnose(readings("fading"), baseline="fresh").as_json()
    found["diagnose once"] = diagnose(once, instrument="0.002,0.003").as_json()
    found["plan between"] = plan(once, between=("crosstalk", "loading")).as_json()
    found["plan effect"] = plan(readings("leak"), effect="warm-up").as_json()
    found["refine leak"] = refine(readings("leak"), ["black-level"]).as_json("model.toml")
    found["refine auto"] = refine(readings("healthy"), auto=True).as_json()
    return found


OUTPUTS = (
    *(f"{command} {name}" for command in ("compare", "diagnose", "plan") for name in SETS),
    "compare edge", "compare fading", "diagnose fading", "diagnose once", "plan between", "plan effect",
    "refine leak", "refine auto",
)  # fmt: skip


def strict(name: str, capsys: pytest.CaptureFixture[str]) -> Any:
    """An output as ``--json -`` prints it, read by a reader that knows no NaN."""
    write_json(outputs()[name], "-")

    def refuse(word: str) -> None:
        pytest.fail(f"{name} holds {word}")

    return json.loads(capsys.readouterr().out, parse_constant=refuse)


@cache
def validator(name: str) -> Draft202012Validator:
    known = Registry().with_resources((schema(each)["$id"], Resource.from_contents(schema(each))) for each in NAMES)
    return Draft202012Validator(schema(name), registry=known)


@pytest.mark.parametrize("name", NAMES)
def test_schemas_are_schemas_and_describe_what_they_hold(name: str) -> None:
    Draft202012Validator.check_schema(schema(name))
    assert schema(name)["$id"] == f"urn:lutgen:schema:{name}:1"


def test_an_unknown_schema_is_refused_by_name() -> None:
    with pytest.raises(
        LutgenError, match=r"unknown schema 'lifetime'\. Pick one of: compare, diagnose, plan, refine\."
    ):
        schema("lifetime")


def test_schemas_name_what_the_library_has() -> None:
    assert schema("diagnose")["properties"]["verdict"]["enum"] == list(VERDICTS)
    assert schema("compare")["properties"]["baseline"]["enum"] == list(BASELINES)


@pytest.mark.parametrize("name", OUTPUTS)
def test_what_is_written_is_as_its_schema_says(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    validator(name.partition(" ")[0]).validate(strict(name, capsys))


def missing(promised: dict[str, Any], content: Any) -> list[str]:
    """Keys that are promised and not there; of a list, in its first entry."""
    if isinstance(content, list):
        return missing(promised, content[0]) if content else []
    found = [key for key in promised if key not in content]
    return found + [
        name for key, inner in promised.items() if key not in found for name in missing(inner, content[key])
    ]


@pytest.mark.parametrize("name", OUTPUTS)
def test_the_promised_keys_are_there(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    command = name.partition(" ")[0]
    promised = PROMISED[command] | (PROMISED["compare"] if command == "diagnose" else {})
    if name == "refine auto":
        promised = promised | {"parameters": {}}
    assert missing(promised, strict(name, capsys)) == []


def test_the_reader_of_keys_sees_what_is_missing() -> None:
    assert missing({"a": {"b": {}}, "c": {}}, {"a": [{"x": 1}]}) == ["c", "b"]


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [
        ("compare leak", ("noise", "source"), "guessed"),
        ("compare leak", ("data", "sha256"), "none"),
        ("compare leak", ("schema",), 2),
        ("compare leak", ("where", 0, "by"), "weather"),
        ("diagnose leak", ("verdict",), "maybe"),
        ("diagnose leak", ("error", "rms_sigma"), None),
        ("diagnose leak", ("ranking", 0, "explained"), 1.5),
        ("diagnose leak", ("visibility", 0, "visible"), None),
        ("refine leak", ("parameters", "black-level", "new", "stderr"), "small"),
        ("refine leak", ("steps", 0, "error", "delta_e_max"), -1.0),
        ("plan leak", ("patches", 0, "R"), 255),
        ("plan leak", ("patches", 0, "lux"), 40.0),
    ],
)
def test_schemas_refuse_what_is_wrong(name: str, path: tuple[str | int, ...], value: object) -> None:
    with pytest.raises(ValidationError):
        validator(name.partition(" ")[0]).validate(altered(outputs()[name], path, value))


def test_what_is_not_finite_is_null(capsys: pytest.CaptureFixture[str]) -> None:
    write_json({"a": [float("nan"), {"b": float("inf")}, (1.5, 2)]}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": [None, {"b": None}, [1.5, 2]]}
