"""README.md and docs/ against the code: every command runs, prints the page's text, and every link has a target."""

import inspect
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from PIL import Image

from docs.generate.markup import anchor
from examples import make_displays
from lutgen import LutgenError, __version__, read_measurements
from lutgen.bake.formats import format_names
from lutgen.criticism.first_session.model import ALLOWANCE
from lutgen.criticism.fit.heldout import STANDARD_ERRORS
from lutgen.criticism.fit.lack_of_fit import SIGNIFICANT, TOO_LARGE
from lutgen.criticism.noise.dark_offsets import ODDS
from lutgen.criticism.search.candidates import HALF, MOST_OF_IT, STRONG
from lutgen.criticism.search.explanation import UNCHANGED
from lutgen.criticism.search.stepwise import UNDOUBTED
from lutgen.criticism.verdict.black import LARGEST_ZERO_CD_M2
from lutgen.criticism.verdict.imitation import APART, DEPARTURE
from lutgen.criticism.verdict.weighing import SIGMAS
from lutgen.display import MODES, REFERENCES, SELECTIONS
from lutgen.readings.conditions import COLUMNS as CONDITION_COLUMNS
from lutgen.readings.formats import cgats
from tests.examples_folder import COMMANDS, ROOT, make_folder
from tests.pages import (
    DOCS,
    LEFT_OUT,
    LONG,
    NOT_RUN,
    PAGES,
    File,
    Shell,
    Step,
    all_commands,
    differences,
    items,
    pictures,
    prepare,
    renewed,
    run_page,
    same,
    shells,
    steps,
)
from tests.real_data import needs_sessions
from tests.virtual_display.campaign import csv_text

pytestmark = pytest.mark.texts

ALL = sorted({*PAGES, *DOCS.rglob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md"})
TEXTS = {page: page.read_text(encoding="utf-8") for page in ALL}

#: Largest size in bytes of a picture or a table in the repository.
SMALL = 150_000


def of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


# Text and commands of the pages


#: The tutorial runs the same commands as this page.
SUMMARY = DOCS / "guides/what-a-model-misses.md"
RUN = "test_a_page_says_what_its_commands_print_and_shows_what_they_draw"


@pytest.mark.slow(every=True)
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.rare(instead=RUN) if page == SUMMARY else ())
        for page in PAGES
        if items(TEXTS[page])
    ],
    ids=of,
)
def test_a_page_says_what_its_commands_print_and_shows_what_they_draw(page: Path, tmp_path: Path) -> None:
    text = TEXTS[page]
    prepare(tmp_path)
    printed = run_page(text, tmp_path)
    off = {step.command: differences(step.shown, lines) for step, lines in zip(steps(text), printed, strict=True)}
    assert not {command: lines for command, lines in off.items() if lines}
    again = renewed(text, printed)
    assert all(same(*lines) for lines in zip(again.splitlines(), text.splitlines(), strict=True))
    for shown, source in pictures(text).items():
        with Image.open(shown) as old, Image.open(tmp_path / source) as new:
            assert old.size == new.size, shown
    if missing := sorted(
        {name for each in shells(text) if not each.begins((*NOT_RUN, *LONG)) for name in each.missing}
    ):
        pytest.skip(f"not installed: {', '.join(missing)}; everything else in {of(page)} agrees")


#: First line of each ``sh`` block → the block and its page.
BLOCKS = {each.text.splitlines()[0]: (each, page) for page in PAGES for each in shells(TEXTS[page])}


def test_a_page_says_which_lines_of_a_shell_no_test_runs_or_only_before_a_release() -> None:
    assert {*NOT_RUN, *LONG} == {
        words for words in (*NOT_RUN, *LONG) if any(each.begins([words]) for each, _ in BLOCKS.values())
    }
    for each, page in BLOCKS.values():
        above = " ".join(TEXTS[page].partition(each.text)[0].split())[-300:]
        if each.begins(LONG):
            assert "--everything" in above, each.text
        elif each.begins(NOT_RUN) and not each.begins(["make "]):
            assert "no test runs" in above, each.text


@needs_sessions
@pytest.mark.slow
@pytest.mark.rare(instead="test_a_page_says_which_lines_of_a_shell_no_test_runs_or_only_before_a_release")
@pytest.mark.parametrize("line", [line for line, (each, _) in BLOCKS.items() if each.begins(LONG)])
def test_lines_of_a_shell_that_take_minutes_run_before_a_release(line: str, tmp_path: Path) -> None:
    BLOCKS[line][0].run(tmp_path)


def test_a_command_stands_in_one_page_once() -> None:
    commands = all_commands()
    assert len(commands) > 50
    assert {command for command in commands if commands.count(command) > 1} == set()


@pytest.mark.parametrize("page", PAGES, ids=of)
def test_a_command_stands_in_a_block_that_is_run(page: Path) -> None:
    fenced = re.findall(r"^```(\w*)[^\n]*\n(.*?)^```$", TEXTS[page], flags=re.DOTALL | re.MULTILINE)
    for language, body in fenced:
        assert language, body
        if language != "console":
            assert not re.findall(r"^(?:\$ )?lutgen .*", body, flags=re.MULTILINE)


@pytest.mark.parametrize("name", [*COMMANDS, *MODES, *SELECTIONS, *REFERENCES, *format_names()])
def test_a_guide_or_an_explanation_mentions_every_command_mode_and_format(name: str) -> None:
    by_hand = "".join(TEXTS[page] for page in PAGES)
    assert re.search(rf"(?<![\w-]){name}(?![\w-])", by_hand)


def test_readme_is_short() -> None:
    assert len(TEXTS[ROOT / "README.md"].splitlines()) <= 120


def test_the_tutorial_shows_every_command_of_criticism_with_its_output() -> None:
    tutorial = steps(TEXTS[DOCS / "tutorial.md"])
    commands = " ".join(step.command for step in tutorial)
    assert all(f"lutgen {name} " in commands for name in ("compare", "diagnose", "refine", "effects", "build", "check"))
    assert all(set(step.shown) - {LEFT_OUT, ""} for step in tutorial)


def test_the_tutorials_own_effect_is_that_of_the_file_and_takes_15_lines() -> None:
    (shown,) = [each.text for each in items(TEXTS[DOCS / "tutorial.md"]) if isinstance(each, File)]
    assert shown == (ROOT / "examples/viewing_gamma.py").read_text(encoding="utf-8")
    assert len(shown.splitlines()) <= 15


@pytest.mark.parametrize("name", make_displays.DISPLAYS)
def test_a_display_is_what_its_maker_makes_and_says_that_it_is_simulated(name: str) -> None:
    text = (ROOT / "examples" / name).read_text(encoding="utf-8")
    assert make_displays.same(text, csv_text(make_displays.DISPLAYS[name]))
    assert "SIMULATED" in text.partition("\n")[0]
    assert len(text) < SMALL


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("oiiotool") is None, reason="oiiotool is not installed (Debian: openimageio-tools)")
def test_the_default_configs_work_in_oiiotool_as_the_guide_says(tmp_path: Path) -> None:
    make_folder(tmp_path)
    (recipe,) = re.findall(r"^oiiotool .*", TEXTS[DOCS / "guides/viewers-and-formats.md"], flags=re.MULTILINE)
    for config in ("chroma/10000h/config.ocio", "config.ocio"):
        environment = os.environ | {
            "OCIO": str(ROOT / "configs/default" / config),
            "AGING_MODE": "chroma",
            "AGING_HOURS": "10000",
        }
        out = f"{config.replace('/', '-')}.png"
        command = [*recipe.split()[:-1], out]
        subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, timeout=60)
        assert (tmp_path / out).is_file()


def test_the_public_workflow_runs_the_commands_of_readme() -> None:
    (begin,) = re.findall(r"^```sh\n(.*?)^```$", TEXTS[ROOT / "README.md"], flags=re.DOTALL | re.MULTILINE)
    workflow = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")
    commands = re.findall(r"^make \w+", begin, flags=re.MULTILINE)
    assert commands == ["make demo", "make test"]
    assert re.findall(r"- run: (make .*)", workflow) == commands


def test_the_citation_names_this_version() -> None:
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_readme_names_every_extra_that_a_user_may_install() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for extra in set(project["optional-dependencies"]) - {"test", "docs"}:
        assert re.search(rf"`{extra}`|lutgen\[{extra}\]", TEXTS[ROOT / "README.md"]), extra


def test_the_index_links_every_page() -> None:
    index = DOCS / "index.md"
    linked = {(DOCS / target).resolve() for target in re.findall(r"\]\(([^)#]+\.md)", TEXTS[index])}
    of_one_effect = {page for page in (DOCS / "reference/effects").glob("*.md") if page.name != "index.md"}
    assert {*DOCS.rglob("*.md")} - {index} - of_one_effect == linked


def test_a_recipe_takes_ten_lines() -> None:
    sections = re.split(r"^## ", TEXTS[ROOT / "CONTRIBUTING.md"], flags=re.MULTILINE)
    recipes = [section.splitlines() for section in sections if section.startswith("Add ")]
    assert len(recipes) == 7
    for heading, *lines in recipes:
        assert sum(map(bool, lines)) <= 10, heading


def test_the_steps_of_continuous_integration_are_commands() -> None:
    (block,) = re.findall(
        r"^```yaml\n(.*?)^```$", TEXTS[DOCS / "guides/continuous-integration.md"], re.DOTALL | re.MULTILINE
    )
    packages, install, check = (step["run"] for step in yaml.safe_load(block))
    setup = (ROOT / ".ci/setup").read_text(encoding="utf-8")
    assert all(package in setup for package in shlex.split(packages) if package.startswith("python3-"))
    assert "--system-site-packages" in install
    program, command, _ = shlex.split(check, comments=True)
    assert program.endswith("/lutgen")
    assert command in COMMANDS


#: Name of a number in noise-and-verdicts.md → the constant.
NUMBERS = {
    "difference in BIC": STRONG,
    "α": SIGNIFICANT,
    "α of the size": TOO_LARGE,
    "held out": STANDARD_ERRORS,
    "α of an undoubted effect": UNDOUBTED,
    "share": MOST_OF_IT,
    "half": HALF,
    "refuted": SIGMAS,
    "apart": APART,
    "unchanged": UNCHANGED,
    "departure": DEPARTURE,
    "odds of a leak": math.exp(ODDS),
    "zero": LARGEST_ZERO_CD_M2,
    "allowance": math.sqrt(ALLOWANCE),  # a standard deviation; the constant is a variance
}


def test_the_numbers_of_the_verdicts_are_those_of_the_code() -> None:
    text = TEXTS[DOCS / "explanation/noise-and-verdicts.md"].partition("| number | value |")[2].partition("\n\n")[0]
    stated = dict(re.findall(r"^\| ([^|]+?) \| ([0-9.]+)[^|]*\|", text, flags=re.MULTILINE))
    assert {name: float(value) for name, value in stated.items()} == pytest.approx(NUMBERS)


# The glossary

GLOSSARY = DOCS / "explanation/glossary.md"
MEANINGS = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", TEXTS[GLOSSARY], flags=re.MULTILINE)[2:]


@pytest.mark.parametrize("term", [term for term, _ in MEANINGS])
def test_a_word_of_the_glossary_is_used_elsewhere(term: str) -> None:
    others = " ".join(" ".join(text.split()) for page, text in TEXTS.items() if page != GLOSSARY)
    word = term.partition(" of a ")[0]
    assert re.search(rf"(?<!\w){re.escape(word)}", others, flags=re.IGNORECASE)


@pytest.mark.parametrize("code", sorted(set(re.findall(r"`([^`]+)`", "".join(says for _, says in MEANINGS)))))
def test_a_code_word_of_the_glossary_is_one_of_the_reference(code: str) -> None:
    reference = "".join(text for page, text in TEXTS.items() if page.is_relative_to(DOCS / "reference"))
    assert re.search(rf"(?<![\w-]){re.escape(code)}(?![\w-])", reference)


# The table of readings


def columns() -> dict[str, tuple[float, float, bool]]:
    """Column → smallest and largest value by the guide, and whether a blank cell is allowed."""
    rows = re.findall(r"^\| (`\w+`[^|]*) \| [^|]+ \| (\S+) to (\S+) \| ([^|]+) \|", GUIDE, flags=re.MULTILINE)
    return {
        name: (float(low), float(high), not blank.startswith("an error"))
        for names, low, high, blank in rows
        for name in re.findall(r"`(\w+)`", names)
    }


GUIDE = TEXTS[DOCS / "guides/your-display.md"]
HEAD = "hour,R,G,B,X,Y,Z"
TIPS = {"1,1,1": "95,100,109", "1,0,0": "41,21,2", "0,1,0": "36,72,12", "0,0,1": "18,7,95"}


def table_with(column: str, cell: str) -> str:
    """A small table whose last row has this cell, in an additional column if the column is optional."""
    rows = [f"0,{drive},{xyz}" for drive, xyz in TIPS.items()]
    last = dict(zip(HEAD.split(","), ["5", "0.5", "0.5", "0.5", "20", "21", "23"], strict=True))
    if column in last:
        last[column] = cell
        return "\n".join([HEAD, *rows, ",".join(last.values())]) + "\n"
    return "\n".join([f"{HEAD},{column}", *(f"{row}," for row in rows), f"{','.join(last.values())},{cell}"]) + "\n"


def reads(text: str, folder: Path) -> bool:
    (folder / "readings.csv").write_text(text)
    try:
        read_measurements(folder / "readings.csv")
    except LutgenError:
        return False
    return True


def test_the_guide_has_every_column() -> None:
    assert {*HEAD.split(","), *CONDITION_COLUMNS} <= set(columns())


@pytest.mark.parametrize("column", [name for name in columns() if name not in "xy"])
def test_the_guides_ranges_and_blanks_are_those_of_the_reader(column: str, tmp_path: Path) -> None:
    low, high, may_be_blank = columns()[column]
    assert reads(table_with(column, repr(low)), tmp_path)
    assert reads(table_with(column, repr(high)), tmp_path)
    step = 1e-7 if column == "window" else (high - low) / 1000
    assert not reads(table_with(column, repr(low - step)), tmp_path)
    assert not reads(table_with(column, repr(high + step)), tmp_path)
    assert reads(table_with(column, ""), tmp_path) == may_be_blank


def test_the_guide_names_what_is_read_of_a_cgats_file() -> None:
    source = inspect.getsource(cgats)
    names = {*cgats._RGB, *cgats._CAL, *cgats._XYZ, *cgats._LAB, *cgats._NAMES, *cgats._XYY[0], *cgats._XYY[1]}
    names |= {*re.findall(r'keywords(?:\.get\(|\[)"([A-Z_0-9]+)"', source)}
    names |= {"ILLUMINANT", "ILLUMINATION_NAME", "WEIGHTING_FUNCTION", "WHITE_POINT"}
    table = re.search(r"^\| part \|.*?\n\n", TEXTS[DOCS / "guides/campaigns.md"], flags=re.MULTILINE | re.DOTALL)
    assert table
    assert names <= {*re.findall(r"\w+", table[0])}


# Links and the site


def targets(text: str) -> list[str]:
    without_code = re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    matches: list[str] = re.findall(r'\]\(([^)\s]+)\)|(?:src|href)="([^"]+)"', without_code)
    return [target for pair in matches for target in pair if target and "://" not in target]


def anchors(text: str) -> set[str]:
    return {anchor(title.replace("`", "")) for title in re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)}


@pytest.mark.parametrize("page", ALL, ids=of)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in targets(TEXTS[page]):
        path, _, place = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        if place:
            assert place in anchors(TEXTS[there]), target


def test_every_picture_is_small_and_shown() -> None:
    shown = "".join(TEXTS.values())
    for path in (DOCS / "images").iterdir():
        assert path.stat().st_size < SMALL, path
        assert f"images/{path.name}" in shown, path


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "tutorial/index.html").is_file()
    assert (tmp_path / "reference/effects/black-level/index.html").is_file()


# The runner

SHOWN = ("a 1.00", LEFT_OUT, "c 3.00")


@pytest.mark.parametrize(
    ("printed", "alike"),
    [
        (("a 1.00", "b 2.00", "c 3.00"), True),
        (("a  1.01", "c 2.99"), True),
        (("a 1.02", "b 2.00", "c 3.00"), False),
        (("a 1.00", "b 2.00", "d 3.00"), False),
        (("a 1.00", "c 3.00", "d 4.00"), False),
        (("b 2.00", "a 1.00", "c 3.00"), False),
    ],
)
def test_a_difference_is_seen_and_rounding_is_none(printed: tuple[str, ...], alike: bool) -> None:
    assert (differences(SHOWN, printed) == []) == alike


def test_a_renewed_page_has_new_numbers_and_the_same_gaps() -> None:
    text = "```console\n$ one\na 1.00\n…\nc 3.00\n$ two # silent\n```\n\n```sh\n$ three\n```\n"
    again = renewed(text, [("a 5.00", "b 6.00", "c 7.00"), ("x", "y")])
    assert again == "```console\n$ one\na 5.00\n…\nc 7.00\n$ two # silent\n```\n\n```sh\n$ three\n```\n"


def test_a_page_is_read_in_order() -> None:
    text = '```console\n$ one\na\n$ two\n```\n```toml title="a.toml"\nb\n```\n```python\nc\n```\n```sh\nd\n```\n'
    parts = items(text)
    assert parts[:2] == [Step("one", ("a",)), Step("two", ())]
    assert parts[2:] == [File("a.toml", "b\n"), File("", "c\n"), Shell("d\n")]


def test_lines_of_a_shell_are_run_if_their_programs_are_installed(tmp_path: Path) -> None:
    lines = Shell('export A=1\nB=2\npython -c "import lutgen"\ntrue > $A$B\n')
    assert lines.is_run
    lines.run(tmp_path)
    assert (tmp_path / "12").is_file()
    absent = Shell("true\nno-such-program a\n")
    assert (absent.missing, absent.is_run) == (["no-such-program"], False)
    with pytest.raises(AssertionError, match="no-such-program"):
        absent.run(tmp_path)
