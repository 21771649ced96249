"""Hostile JSON, TOML, names and tables end quickly in a sentence."""

import json
import time
from pathlib import Path

import pytest

from lutgen.display import default_display
from lutgen.documents import DEEPEST, deepest, from_json, from_toml
from lutgen.files import write_atomically
from tests.command import in_process

#: A name that file systems refuse.
LONG = "x" * 300

DEEP = {
    "lists": "x = " + "[" * 100_000 + "]" * 100_000,
    "tables": "x = " + "{a=" * 60_000 + "1" + "}" * 60_000,
    "a key": ".".join(["a"] * 100_000) + " = 1",
    "a quoted key": ".".join(['"a"'] * 50_000) + " = 1",
    "a head": "[" + " . ".join(["a"] * 60_000) + "]",
}


@pytest.mark.parametrize("what", DEEP)
def test_a_toml_that_is_nested_deep_is_refused_at_once(what: str) -> None:
    begun = time.process_time()
    with pytest.raises(ValueError, match="nested more than 50 deep"):
        from_toml(DEEP[what])
    assert time.process_time() - begun < 5


def test_depth_is_counted_outside_of_strings_and_comments() -> None:
    brackets = "[" * 3 * DEEPEST
    text = f'a = "{brackets}\\""  # {brackets}\nb = """\n{brackets}"" """\n'
    text += f"c = '{brackets}'\nd = '''{brackets}'''\n"
    assert deepest(text) == 0
    assert from_toml(text)["a"] == f'{brackets}"'
    assert deepest("a.b.c = [1.5, [2.5]]\n") == 2
    at_most = "[" * DEEPEST + "]" * DEEPEST
    assert from_toml(f"x = {at_most}")


@pytest.mark.parametrize("digits", ["1" * 5000, "-" + "1" * 400, str(2**63)])
def test_an_integer_beyond_64_bits_is_refused(digits: str) -> None:
    with pytest.raises(ValueError, match="beyond"):
        from_toml(f"x = [1, {{y = {digits}}}]")
    with pytest.raises(ValueError, match="beyond"):
        from_json(f'{{"x": [{digits}]}}')


@pytest.mark.parametrize("word", ["NaN", "-Infinity", "1e400"])
def test_json_without_a_finite_number_is_refused(word: str) -> None:
    with pytest.raises(ValueError, match=r"number of JSON|too large for a double"):
        from_json(f'{{"x": {word}}}')


def test_json_that_others_write_is_read() -> None:
    content = {"a": [1, -2.5, 1e300, 2**62, None, True, "ü"]}
    assert from_json(json.dumps(content)) == content


def bad_files(folder: Path) -> None:
    (folder / "big.toml").write_text("schema = " + "1" * 5000)
    (folder / "deep.toml").write_text("schema = 1\n" + DEEP["a key"])
    (folder / "cell.csv").write_text("hour,factor\n0,1\n" + "1" * 140_000 + ",0.5\n")
    (folder / "study").mkdir()
    (folder / "study/protocol.json").write_text('{"schema": 1, "seed": NaN, "sha256": ""}')


COMMANDS = (
    ("build", "--model", "big.toml", "--hours", "0", "-o", "b"),
    ("build", "--model", "deep.toml", "--hours", "0", "-o", "b"),
    ("trend", "big.toml"),
    ("trend", "deep.toml"),
    ("build", "--luminance", "cell.csv", "--hours", "0", "-o", "b"),
    ("study", "status", "study"),
    ("study", "run", "study", "--reader", "a", "--session", "1"),
    ("study", "analyse", "study"),
    ("build", "--hours", "0", "-o", LONG),
    ("check", LONG),
    ("apply", f"{LONG}.png", "--mode", "chroma", "--hours", "0", "-o", "y.png"),
    ("apply", "x.png", "--lut", f"{LONG}.cube", "-o", "y.png"),
    ("lint", f"{LONG}.cube"),
    ("lifetime", f"{LONG}.png"),
    ("map", f"{LONG}.png", "--mode", "chroma", "--hours", "0", "-o", "m.png"),
    ("nuclei", f"{LONG}.png"),
    ("compare", f"{LONG}.csv"),
    ("compare", str(default_display()), "--json", f"{LONG}.json"),
    ("inspect", f"{LONG}.ti3"),
    ("trend", f"{LONG}.toml"),
    ("report", f"{LONG}.png", "-o", "r.html"),
    ("cohort", f"{LONG}.png", "-o", "c"),
    ("study", "status", LONG),
    ("show", "--display", f"{LONG}.csv"),
    ("effects", "--effects", f"{LONG}.py"),
)


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda arguments: " ".join(arguments)[:40])
def test_a_bad_file_or_name_is_one_sentence(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    done = in_process(monkeypatch, capsys)(*arguments)
    assert done.code == 2
    assert done.err.startswith("lutgen: error: ")
    assert len(done.err.splitlines()) == 1
    assert len(list(tmp_path.iterdir())) == 4


def test_a_name_that_a_file_system_takes_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("ü" * 125 + ".json")
    write_atomically(path, b"{}")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
