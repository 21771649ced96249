"""One-line effects: the grammar, refused formulas, and the derived properties of a formula."""

from __future__ import annotations

import pickle
from inspect import signature

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen.colorimetry import code_to_linear
from lutgen.effects import probe
from lutgen.effects.contract import check
from lutgen.effects.expression import parse
from lutgen.effects.formula import read_formula
from lutgen.errors import LutgenError
from tests.quick import draws

pytestmark = pytest.mark.numbers

BOUNDS = (-1.0, 1.0)


@pytest.mark.parametrize(
    ("text", "stage", "neutral", "needs"),
    [
        ("xyz + k*tau*white", "optics", {"k"}, ()),
        ("xyz*(1 - k*rho**2)", "optics", {"k"}, ("u", "v")),
        ("xyz + k*(ambient_lx/1000)*fresh_white", "optics", {"k"}, ("ambient_lx",)),
        ("xyz*(1 - a*exp(-warmup_min/m)); m=30[5,200]", "optics", {"a"}, ("warmup_min",)),
        ("xyz*(1 + c*(temperature_c - 25)); c=-0.003[-0.02,0.02]", "optics", {"c"}, ("temperature_c",)),
        ("xyz*(1 - x*mean_drive)", "optics", {"x"}, ("window", "surround")),
        ("xyz + k*hours/18000*min(r, g, b)*white", "optics", {"k"}, ()),
        ("linear**(1 + d*tau); d=0.05[-0.5,0.5]", "transfer", {"d"}, ()),
        ("linear*(1 - chi*(r + g + b - linear))", "transfer", {"chi"}, ()),
        ("linear + a*linear*(1-linear) + q*tau*linear*(1-linear)", "transfer", {"a", "q"}, ()),
        ("linear*(1 + k*sin(2*pi*code))", "transfer", {"k"}, ()),
        ("code*(1 - p*tau)", "drive", {"p"}, ()),
        ("drive - k*clip(drive, 0.2, 0.8)*tau + k*0.2*tau", "drive", {"k"}, ()),
        ("code + k*abs(code - 0.5)*sqrt(tau)", "drive", {"k"}, ()),
        ("xyz*(1 + k*log(1 + ambient_lx)*cos(u))", "optics", {"k"}, ("ambient_lx", "u")),
        # In a product with a sine the factor is the amplitude, although a frequency of 0 would also remove the effect.
        ("xyz*(1 + sin(w*tau)*k)", "optics", {"k"}, ()),
    ],
)
def test_good_expressions(text: str, stage: str, neutral: set[str], needs: tuple[str, ...]) -> None:
    effect = parse(text)
    assert (effect.stage, set(effect.neutral), effect.needs) == (stage, neutral, needs)
    assert set(effect.neutral.values()) == {0.0}
    assert effect.origin == text
    report = check(effect)
    assert report.passed, report.failure


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("xyz.real + k", r"`xyz.real` is not allowed"),
        ("xyz + k*__import__(tau)", "'__import__' is no function"),
        ("xyz + k*__class__", "'__class__' stands for no number"),
        ("xyz + _k", "'_k' stands for no number"),
        ("xyz + open(k)", "'open' is no function"),
        ("xyz + exp(k)(u)", r"is not allowed"),
        ("xyz + exp(*k)", r"is not allowed"),
        ("xyz + exp()", "exp takes 1 argument, not 0"),
        ("xyz + clip(k, 0)", "clip takes 3 arguments, not 2"),
        ("xyz + min(k)", "min takes 2 arguments, not 1"),
        ("xyz + exp", "'exp' stands for no number"),
        ("lambda x: x", "':' is not allowed"),
        ("(lambda x: x)(k)", "':' is not allowed"),
        ("[x for x in xyz]", r"'\[' is not allowed: the channels of linear light are r, g and b"),
        ("xyz + (k for k in xyz)", "is not allowed"),
        ("{k: 1}", "'{' is not allowed"),
        ("xyz[0] + k", r"'\[' is not allowed"),
        ("xyz + 'text'", '"\'" is not allowed'),
        ('xyz + "text"', "'\"' is not allowed"),
        ("xyz + k if u else xyz", "is not allowed"),
        ("xyz + (k and u)", "is not allowed"),
        ("xyz + (not k)", "is not allowed"),
        ("xyz + (k := 1)", "':' is not allowed"),
        ("xyz + k < 2", "'<' is not allowed"),
        ("xyz = xyz + k", "'=' is not allowed: values of parameters stand behind a semicolon"),
        ("xyz ^ k", r"'\^' is not allowed: a power is written \*\*"),
        ("xyz @ k", "'@' is not allowed"),
        ("xyz % k", "'%' is not allowed"),
        ("xyz // (1 + k)", "is not allowed"),
        ("xyz, k", "is not allowed"),
        ("xyz + (yield k)", "is not allowed"),
        ("xyz + k*1j", "is not allowed"),
        ("xyz + k*True", "is not allowed"),
        ("xyz + k*...", "is not allowed"),
        ("xyz + k*None", "is not allowed"),
        ("xyz + k # a comment", "'#' is not allowed"),
        ("xyz + k\\", "is not allowed"),
        ("xyz + κ", "'κ' is not allowed"),
        ("xyz + k*\0", "is not allowed"),
        ("xyz + * k", "is no formula"),
        ("xyz + (k", "is no formula"),
        ("xyz + k)", "is no formula"),
        ("", "is no formula"),
        ("   ", "is no formula"),
        ("xyz + k*9**9**9**9", r"a power of `9 \*\* 9 \*\* 9`"),
        ("xyz + k*2**1000", "a power of `1000`: numbers up to 20"),
        ("xyz + k*2**-1000", "a power of `-1000`"),
        ("xyz + k*1e999", "too large"),
        (f"xyz + k*1{'0' * 400}", "too large"),
        (f"xyz + {'-' * 60}k", "nested more than 40 deep"),
        (f"xyz + {'(' * 230}k{')' * 230}", "is no formula|refused|nested"),
        (f"xyz + {'k + ' * 2500}k", "expression of 10007 letters: 500 are allowed"),
        ("k*tau", "names no signal"),
        ("xyz + k*linear", "names both xyz and linear"),
        ("xyz", "is always xyz itself"),
        ("xyz + 0*k", "is always xyz itself"),
        ("xyz*m", "is not xyz itself when its parameters are 0"),
        ("white*k", "names no signal"),
        ("xyz + white", "is not xyz itself"),
        ("clip(xyz, 0, 1 + k)", "is not xyz itself"),
        ("xyz*(1 + k*log(ambient_lx))", "is not xyz itself"),
        ("xyz*(1 - k*warmup_min)", "warmup_min is infinite when warm"),
        ("xyz*(1 + k/rho)", "is not xyz itself"),
        # b is blue's linear light, not a parameter: the sentence states how the name was read.
        ("xyz + a*white + b*tau*white", "as quantities: white, b, tau; as parameters: a"),
        ("xyz + k*tua*white", "'tua' looks like 'tau'"),
        ("xyz + k*Tau*white", "'Tau' looks like 'tau'"),
        ("xyz + k*whte", "'whte' looks like 'white'"),
        ("xyz + k*ambient", "'ambient' looks like 'ambient_lx'"),
        ("XYZ + xyz*k", "'XYZ' looks like 'xyz'"),
        ("linear*(1 + k*R)", "'R' looks like 'r'"),
        (f"xyz + {' + '.join(f'k{i}*tau**{i}' for i in range(9))}", "has 9 parameters"),
        ("xyz + k*white; q=1", "'q' is none of its parameters, which are: k"),
        ("xyz + k*white; k", "`k` is no parameter's value"),
        ("xyz + k*white; k=x", "`k=x` is no parameter's value"),
        ("xyz + k*white; k=1[0]", "is no parameter's value"),
        ("xyz + k*white; k=1[0,0.5]", "the start between the bounds"),
        ("xyz + k*white; k=0[1,-1]", "the start between the bounds"),
        ("xyz + k*white; k=0[0,0]", "the start between the bounds"),
        ("xyz*(1 + k**p**2)", r"a power of `p \*\* 2`"),
        ("xyz + k*white; k=0.5[0.1,1]", "with 0 inside the bounds of k"),
        ("xyz + k*white; k=1e400", "too large"),
        ("My effect: xyz + k*white", "':' is not allowed: it stands behind a name"),
    ],
)
def test_bad_expressions(text: str, sentence: str) -> None:
    with pytest.raises(LutgenError, match=sentence) as caught:
        parse(text)
    assert len(str(caught.value)) < 700


TOKENS = (
    *"+-*/().,;:= []",
    "**",
    "xyz",
    "linear",
    "code",
    "k",
    "p",
    "tau",
    "white",
    "r",
    "exp",
    "min",
    "clip",
    "0",
    "1e9",
)


@draws(400)
@given(st.one_of(st.lists(st.sampled_from(TOKENS), max_size=24).map("".join), st.text(max_size=40)))
def test_whatever_is_written_is_read_or_refused_in_a_sentence(text: str) -> None:
    try:
        effect = parse(text)
    except LutgenError as error:
        assert str(error)  # noqa: PT017 - most texts are refused, some are good
    else:
        assert effect.neutral


def test_names_values_and_bounds() -> None:
    effect = parse("my-leak: xyz + k*tau**p*white + q*white ; k = 0.002 [0, 0.05]; p=1[0.3,3]; q=-.5e-2")
    assert effect.name == "my-leak"
    parameters = {name: (each.value, each.bounds) for name, each in effect.parameters.items()}
    assert parameters == {"k": (0.002, (0.0, 0.05)), "p": (1.0, (0.3, 3.0)), "q": (-0.005, BOUNDS)}
    assert effect.neutral == {"k": 0.0, "q": 0.0}
    assert effect.forms == (("k", "q"), ("k", "p", "q"))
    assert effect.summary == "xyz + k*tau**p*white + q*white"


def test_parameters_that_nobody_gives_start_small_and_shapes_span_two_decades() -> None:
    effect = parse("xyz + k*tau**p*white")
    assert {name: (each.value, each.bounds) for name, each in effect.parameters.items()} == {
        "k": (0.01, BOUNDS),
        "p": (1.0, (0.1, 10.0)),
    }


def test_names_are_the_same_on_every_run_and_tell_formulas_apart() -> None:
    assert parse("xyz + k*tau*white").name == parse(" xyz  + k * tau*white").name == "xyz-k-tau-white"
    assert parse("linear**(1 + my_d)").name == "linear-myd"


def test_the_origin_says_it_all() -> None:
    effect = parse(" leak:  xyz + k*tau*white;k=0.002[0,0.05] ")
    assert parse(effect.origin) == effect


def test_formulas_compute_what_python_would() -> None:
    reading = probe.readings("optics")
    xyz, scene = reading.signal, reading.scene
    red, green, blue = np.moveaxis(code_to_linear(scene.code), -1, 0)[..., np.newaxis]
    k, p = 0.3, 1.7
    cases = {
        "xyz + k*tau**p*white - -k/2": xyz + k * scene.tau**p * scene.white + k / 2,
        "xyz*(1 - k**2*p/4*max(r, g, b))": xyz * (1 - k**2 * p / 4 * np.maximum(np.maximum(red, green), blue)),
        "2**-k*xyz + p*0": 2**-k * xyz,
        "-k**2*xyz + p": -(k**2) * xyz + p,
        "xyz - k - p": xyz - k - p,
        "xyz/k/p": xyz / k / p,
        "k**-p + xyz": k**-p + xyz,
        "xyz + clip(code, k, .5) + p": xyz + np.clip(scene.code, k, 0.5) + p,
    }
    for text, expected in cases.items():
        np.testing.assert_allclose(read_formula(text)(xyz, scene, k=k, p=p), expected, rtol=1e-13, err_msg=text)


def test_channels_of_a_linear_formula_are_the_signals() -> None:
    reading = probe.readings("transfer")
    darker = reading.signal / 2
    result = read_formula("linear + r")(darker, reading.scene)
    np.testing.assert_allclose(result, darker + darker[:, :1])


def test_expressions_go_to_worker_processes() -> None:
    effect = parse("leak: xyz + k*tau**p*white; k=0.002[0,0.05]")
    again = pickle.loads(pickle.dumps(effect))  # noqa: S301 - our own bytes
    assert again == effect
    assert hash(again.function) == hash(effect.function)
    assert list(signature(effect.function).parameters) == ["signal", "scene", "k", "p"]


def test_a_division_by_zero_is_the_contracts_to_tell() -> None:
    failure = check(parse("xyz/(1 - k)")).failure
    assert failure is not None
    assert failure.clause == "finite"
    assert "with k = 1. Narrow the bounds" in failure.sentence
    assert check(parse("xyz/(1 - k); k=0.01[-0.5,0.5]")).passed
