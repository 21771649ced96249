"""Behaviour of all commands: help and its sections, usage errors, interrupts, closed pipes, text on a terminal."""

import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import pytest
from click import Context

from lutgen.cli import outputs
from lutgen.cli.command import Command, Section, group
from lutgen.cli.options import Choice
from lutgen.cli.outputs import wrapped
from tests.command import Done, here, in_process
from tests.examples_folder import COMMANDS, ROOT, make_folder
from tests.quick import mostly_slow

PROGRAM = [sys.executable, "-m", "lutgen"]
DISPLAY_A = ROOT / "examples/display-a.csv"

SECTIONS = {
    "Simulate": "build check apply show",
    "Find what the model misses": "compare diagnose refine plan effects explore",
    "Real displays": "inspect sessions trend",
    "Pictures": "lifetime cohort nuclei map sheet animate figure table report",
    "Reader study": "study",
    "Other people's files": "lint merge",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("examples"))


def test_help_lists_the_commands_by_section() -> None:
    sections = {section.value: " ".join(names) for section, names in group.sections(Context(group)).items()}
    assert sections == SECTIONS
    text = group.get_help(Context(group))
    headings = [line.removesuffix(":") for line in text.splitlines() if line.endswith(":") and line[0] != " "]
    assert headings == ["Options", *SECTIONS]


def test_every_command_of_the_top_level_names_its_section() -> None:
    for name in group.list_commands(Context(group)):
        command = group.get_command(Context(group), name)
        assert isinstance(command, Command)
        assert command.section is not Section.COMMANDS, name


def test_builds_help_says_first_what_most_users_need() -> None:
    first, _, rest = COMMANDS["build"].get_help(Context(COMMANDS["build"])).partition("\nAdvanced:")
    for option in ("--hours", "--mode", "--format", "--output", "--display", "--model"):
        assert option in first.partition("Options:")[2]
    for option in ("--cubesize", "--jobs", "--at", "--selection", "--reference", "--gpu"):
        assert f"\n  {option} " in rest
        assert f"\n  {option} " not in first


@pytest.mark.parametrize("width", [24, 40, 61, 100])
@pytest.mark.parametrize("name", COMMANDS)
def test_help_wraps_at_words_at_any_width(name: str, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    command = COMMANDS[name]
    texts = {}
    for columns in (width, 1000):
        monkeypatch.setenv("COLUMNS", str(columns))
        texts[columns] = command.get_help(Context(command, info_name=name))
    assert "".join(texts[width].split()) == "".join(texts[1000].split())
    # Only a word that is longer than its column may be cut.
    short = {word for word in texts[1000].split() if len(word) <= width // 3}
    assert short <= set(texts[width].split())
    # Text after \b (examples, small tables) keeps its lines. Other text is not wider than the terminal.
    lines = {line.strip() for line in (command.help or "").splitlines()}
    wide = [line for line in texts[width].splitlines() if len(line) > width and line.strip() not in lines]
    assert all(line.startswith(("  -", "Usage:")) or len(line.split()) == 1 for line in wide), wide


@pytest.mark.parametrize(
    ("typed", "meant"), [("diagnos", "diagnose"), ("Build", "build"), ("lifetimes", "lifetime"), ("insepct", "inspect")]
)
def test_an_unknown_command_is_answered_with_the_most_similar_one(
    typed: str, meant: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)(typed)
    assert done.code == 2
    assert done.err.splitlines()[-1] == f"Error: No such command '{typed}'. Did you mean {meant}?"


def test_a_command_that_is_like_none_is_answered_with_all(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)("xyzzy")
    assert "Pick one of: build, check, apply, show, compare" in done.err


@pytest.mark.parametrize("name", COMMANDS)
def test_a_usage_error_shows_an_example_of_that_command(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)(*name.split(), "--no-such-option")
    assert done.code == 2
    assert f"\nExample: lutgen {name}" in done.err
    assert done.err.splitlines()[-1].startswith("Error: No such option '--no-such-option'.")
    assert not done.out


@pytest.mark.parametrize(("word", "why"), [("--hours", "requires an argument"), ("--force=3", "does not take a value")])
def test_an_option_with_a_value_too_few_or_too_many_shows_the_example_too(
    word: str, why: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)("build", word)
    assert done.code == 2
    assert "\nExample: lutgen build" in done.err
    assert done.err.rstrip().endswith(f"{why}.")


@pytest.mark.parametrize(
    ("arguments", "example", "message"),
    [
        (("build", "--mode", "foo"), "lutgen build --hours", "unknown mode 'foo'"),
        (("build", "--cubesize", "20"), "lutgen build", "unknown cube size '20'"),
        (("build", "--hours", "abc"), "lutgen build --hours", "--hours abc: 'abc' is not a number of hours"),
        (("build", "--format", "cube,cubb"), "lutgen build", "unknown format 'cubb'"),
        (("effects", "crostalk"), "lutgen effects", "unknown effect 'crostalk'"),
        (("plan", DISPLAY_A, "--between", "crosstalk,crosstalk"), "lutgen plan", "--between needs two different"),
        (
            ("lifetime", ROOT / "examples/tissue.jpg", "--tolerance", "x"),
            "lutgen lifetime",
            "--tolerance x: give numbers in a list",
        ),
    ],
)
def test_an_error_about_the_value_of_an_option_shows_an_example_too(
    arguments: tuple[object, ...],
    example: str,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    done = in_process(monkeypatch, capsys)(*arguments)
    assert done.code == 2
    error, shown = done.err.splitlines()
    assert error.startswith(f"lutgen: error: {message}")
    assert shown.startswith(f"Example: {example}")


def test_an_error_about_a_file_shows_no_example(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    done = in_process(monkeypatch, capsys)("compare", "gone.csv")
    assert (done.code, done.err.startswith("lutgen: error: gone.csv"), len(done.err.splitlines())) == (2, True, 1)


@pytest.mark.parametrize(
    ("arguments", "ending"),
    [
        (("diagnose", DISPLAY_A, "--baseline", "natve"), "Did you mean native?"),
        (("apply", "a.png", "--mode", "chroma_luma", "-o", "b.png"), "Did you mean chroma-luma?"),
        (("apply", "a.png", "--mode", "xyz", "-o", "b.png"), "'chroma-luma'."),
    ],
)
def test_a_value_that_is_no_choice_is_answered_with_the_most_similar_choice(
    arguments: tuple[object, ...], ending: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)(*arguments)
    assert done.code == 2
    assert done.err.rstrip().endswith(ending)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_choice_names_the_most_similar_one(name: str) -> None:
    for option in COMMANDS[name].params:
        assert isinstance(option.type, Choice) or not isinstance(option.type, click.Choice), option.name


@pytest.mark.parametrize("words", [(), ("study",), ("sessions",)])
def test_a_group_alone_prints_its_help(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    alone, asked = in_process(monkeypatch, capsys)(*words), in_process(monkeypatch, capsys)(*words, "--help")
    assert (alone.out + alone.err).strip() == asked.out.strip()
    assert asked.code == 0


def test_a_sentence_wraps_at_words_and_keeps_its_indent() -> None:
    text = "  The noise of a reading is that of the replicates of the table."
    assert wrapped(text, 30) == "  The noise of a reading is\n  that of the replicates of\n  the table."
    assert wrapped("x" * 50, 30) == "x" * 50
    command = "  lutgen refine examples/display-a.csv --add black-level"
    assert wrapped(command, 30) == command
    assert wrapped(f"The next one:{command}", 30) == f"The next one:\n{command}"


@pytest.mark.parametrize("width", range(8, 30))
def test_no_line_ends_inside_a_number(width: int) -> None:
    lines = wrapped("white by 18 000 h, black by 1 048 576 h, 5 at 3 times", width).split("\n")
    assert " ".join(lines) == "white by 18 000 h, black by 1 048 576 h, 5 at 3 times"
    assert not [line for line in lines if re.match(r"\d{3}\b", line)]


@pytest.mark.parametrize("width", range(8, 60))
def test_no_line_ends_before_a_unit(width: int) -> None:
    text = "white falls to 6.6 % by 18 000 h at 120 cd/m² and 25 °C, 3 σ from 10 % of 5 honest readings"
    lines = wrapped(text, width).split("\n")
    assert " ".join(lines) == text
    assert not [line for line in lines if re.match(r"(h|%|cd/m²|°C|σ)(?!\w)", line)]


@pytest.mark.parametrize(
    ("sentence", "command"),
    [
        ("An effect of your own can be tried: {}. It fits.", "lutgen refine --effects my_effect.py"),
        ("An effect of your own can be tried: {}.", "lutgen refine --effects my_effect.py"),
        ("40 answers. Analyse them: {}", "lutgen study analyse --answers out/answers.csv"),
        ("Give a folder that {} made, or leave it out.", "`lutgen build --hours 0,5`"),
        ("Something remains. See {}.", "lutgen diagnose --baseline native --verbose"),
    ],
)
@pytest.mark.parametrize("width", [20, 30, 40, 60, 80])
def test_no_line_ends_inside_a_command(sentence: str, command: str, width: int) -> None:
    text = sentence.format(command)
    lines = wrapped(text, width).split("\n")
    assert " ".join(lines) == text
    assert any(command in line for line in lines)
    assert all(len(line) <= max(width, len(command) + 1) for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize("width", [60, 80])
def test_a_terminal_gets_the_draft_of_an_effect_as_it_is_in_the_file(width: int, tmp_path: Path) -> None:
    stub = tmp_path / "stub.py"
    shown = "\n".join(line.rstrip() for line in on_terminal(width, "diagnose", str(ROOT / "examples/display-b.csv")))
    assert here("diagnose", ROOT / "examples/display-b.csv", "--stub", stub).returncode == 0
    assert stub.read_text().strip() in shown
    assert "lutgen refine --effects my_effect.py" in shown
    assert not re.search(r"\d\n(000|h|%)", shown)


@pytest.mark.parametrize("width", [33, 60])
def test_a_terminal_gets_sentences_that_wrap_at_words(width: int) -> None:
    command = ["apply", "absent.png", "--mode", "chroma", "--hours", "5", "--lut", "some.cube", "-o", "out.png"]
    piped = here(*command)
    lines = on_terminal(width, *command)
    assert " ".join(lines).split() == piped.stderr.split()
    assert len(lines) > 1
    assert all(len(line) <= width for line in lines)


def on_terminal(width: int, *arguments: str) -> list[str]:
    """Run a command on a terminal of this width; return the lines that it shows."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    process = subprocess.Popen([*PROGRAM, *arguments], stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    shown = b"".join(until_closed(ours))
    process.wait(timeout=60)
    return shown.decode().splitlines()


def until_closed(terminal: int) -> Iterator[bytes]:
    """Read a terminal until the last program has closed its end."""
    while True:
        try:
            part = os.read(terminal, 4096)
        except OSError:  # Linux reports so that no process holds the other end
            return
        yield part


def test_an_interrupted_build_says_what_it_keeps(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("lutgen.bake.build._write_common_config", interrupt)
    folder = str(tmp_path / "aged")
    options = ("--hours", "0,9000", "--mode", "chroma", "--cubesize", "17", "--jobs", "1", "-o", folder)
    done = in_process(monkeypatch, capsys)("build", *options)
    message = f"Interrupted. {folder} keeps the finished files; the same command continues with the others."
    assert (done.code, done.out, " ".join(done.err.split())[-len(message) :]) == (130, "", message)
    monkeypatch.undo()
    done = in_process(monkeypatch, capsys)("build", *options)
    assert done.code == 0
    assert "interrupted" in done.out


def test_readings_that_are_given_as_an_argument_are_told_their_option(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = in_process(monkeypatch, capsys)("build", "readings.csv")
    assert done.err.splitlines()[-1].endswith("(readings.csv). Give readings with --display.")
    done = in_process(monkeypatch, capsys)("sheet", "a.png", "b.png", "-o", "c.png")
    assert "--display" not in done.err.splitlines()[-1]


def handles_sigterm(pid: int) -> bool:
    """Whether a process has begun to run a command: from then on the process handles SIGINT and SIGTERM itself."""
    (caught,) = re.findall(r"SigCgt:\s*([0-9a-f]+)", Path(f"/proc/{pid}/status").read_text())
    return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)


#: Ctrl-C arrives during the import of a module.
INTERRUPTED_IMPORT = """
import importlib.abc, sys
class Interrupt(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            {error}
sys.meta_path.insert(0, Interrupt())
from lutgen.cli import main
sys.argv = ["lutgen", "apply", "a.png", "--mode", "chroma", "--hours", "1", "-o", "b.png"]
main()
"""


@pytest.mark.parametrize(
    ("module", "error"),
    [
        ("click", "raise KeyboardInterrupt"),
        # The error of libraries in C++.
        ("OpenImageIO", "raise ImportError('initialization failed') from KeyboardInterrupt()"),
        # While a dataclass is made: Python then ends by the signal, unless lutgen prevents this.
        ("click", "exec('raise KeyboardInterrupt')"),
        ("OpenImageIO", "exec('raise KeyboardInterrupt')"),
    ],
)
def test_an_interrupt_while_modules_load_ends_with_130_in_silence(
    module: str, error: str, folder: Path, tmp_path: Path
) -> None:
    program = INTERRUPTED_IMPORT.format(module=module, error=error).replace("a.png", "slide.png")
    # As a module, like `python -m lutgen`: Python ends code given by -c and a script differently.
    (tmp_path / "interrupted.py").write_text(program, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "interrupted"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr.strip()) == (130, "", "")


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux says which signals a process handles")
@pytest.mark.parametrize(
    "command",
    mostly_slow(
        [
            WORKERS := "build --hours 0..18000 --jobs 2 --force -o OUT/built",
            "build --hours 0..18000 --jobs 1 --force -o OUT/built",
            ALONE := "diagnose examples/display-a.csv",
            "cohort slides -o OUT/run",
        ],
        WORKERS,
        ALONE,
    ),
)
def test_an_interrupt_ends_with_130_and_without_a_traceback(command: str, folder: Path, tmp_path: Path) -> None:
    # A background process of a shell ignores Ctrl-C, and its children inherit this setting.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # The test interrupts all processes of the command, also the workers, as Ctrl-C does.
    started = subprocess.Popen(
        [*PROGRAM, *command.replace("OUT", str(tmp_path)).split()],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    output = next((Path(word.replace("OUT", str(tmp_path))) for word in command.split() if "OUT" in word), folder)
    while not (handles_sigterm(started.pid) and output.exists()):
        assert started.poll() is None, "the command was over before it was interrupted"
        time.sleep(0.01)
    os.killpg(started.pid, signal.SIGINT)
    out, err = started.communicate(timeout=60)
    assert started.returncode == 130
    assert "Traceback" not in err
    assert "Error" not in err
    assert not out


#: Commands, and the files that each command must write.
ASKED = {
    "nuclei slide.png --hours 0,10000 --csv OUT/n.csv --json OUT/n.json": {"n.csv", "n.json"},
    "lifetime slide.png --hours 0,10000 --csv OUT/l.csv --json OUT/l.json": {"l.csv", "l.json"},
    "compare examples/display-a.csv --json OUT/c.json": {"c.json"},
    "table 1 slide.png --csv OUT/t.csv --json OUT/t.json": {"t.csv", "t.json"},
    "inspect examples/session.ti3 --json OUT/i.json": {"i.json"},
    "trend examples/campaign/campaign.toml --json OUT/t.json": {"t.json"},
    "sessions explain examples/campaign/campaign.toml --json OUT/e.json": {"e.json"},
    "plan examples/display-a.csv --effect edge-falloff -o OUT/p.csv --json OUT/p.json": {"p.csv", "p.json"},
    "map slide.png --mode chroma --hours 10000 -o OUT/m.png --json OUT/m.json": {"m.png", "m.json"},
    "study power --per-condition 40 --json OUT/s.json": {"s.json"},
    "apply slide.png --mode chroma --hours 10000 -o OUT/a.png": {"a.png"},
    "lint theirs.cube --json OUT/l.json": {"l.json"},
}

#: The fastest commands.
QUICK = ("inspect examples/session.ti3 --json OUT/i.json", "lint theirs.cube --json OUT/l.json")


@pytest.mark.parametrize("command", mostly_slow(ASKED, *QUICK))
def test_a_closed_pipe_changes_nothing_but_the_words(command: str, folder: Path, tmp_path: Path) -> None:
    ours, theirs = os.pipe()
    os.close(ours)
    arguments = command.replace("OUT", str(tmp_path)).split()
    done = subprocess.run(
        [*PROGRAM, *arguments], cwd=folder, stdout=theirs, stderr=subprocess.PIPE, text=True, check=False, timeout=120
    )
    os.close(theirs)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == ASKED[command]
    assert all(path.stat().st_size for path in tmp_path.iterdir())


@pytest.mark.parametrize("closed", [">&-", ">&- 2>&-"])
def test_streams_that_were_closed_before_change_nothing_but_the_words(closed: str, tmp_path: Path) -> None:
    arguments = ("inspect", str(ROOT / "examples/session.ti3"), "--json", str(tmp_path / "i.json"))
    command = ["sh", "-c", f'"$@" {closed}', "sh", *PROGRAM, *arguments]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "i.json").stat().st_size


def test_files_are_written_before_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def page() -> Iterator[str]:
        yield " ".join(sorted(path.name for path in tmp_path.iterdir()))

    def plot(place: str) -> list[Path]:
        (tmp_path / "p.png").write_text(place)
        return [tmp_path / "p.png"]

    asked = outputs.Outputs(str(tmp_path / "j.json"), str(tmp_path / "c.csv"), str(tmp_path))
    asked.write(page(), dict, as_csv=lambda: "a", plot=plot)
    assert capsys.readouterr().out.splitlines()[0] == "c.csv j.json p.png"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="/dev/full is Linux's")  # noqa: PTH110
def test_a_full_disk_under_standard_output_is_one_sentence() -> None:
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [*PROGRAM, "effects"], stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60
        )
    assert done.returncode == 2
    assert done.stderr == "lutgen: error: no space left on device.\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("trend", "a.csv", "--json", "a.csv"), "a.csv: is an input of this command, and is never written to"),
        (("compare", "a.csv", "--json", "link.csv"), "link.csv: is an input of this command"),
        (("plan", "a.csv", "-o", "./a.csv"), "a.csv: is an input of this command, and is never written to. Choose an"),
        (("lifetime", "p.png", "--display", "a.csv", "--csv", "a.csv"), "a.csv: is an input of this command"),
        (("lifetime", "p.png", "--json", "p.png"), "p.png: is an input of this command"),
        (("nuclei", "p.png", "--labels", "p.png"), "Choose another name for --labels"),
        (("trend", "c.toml", "--json", "a.csv"), "a.csv: is an input of this command"),
        (("trend", "c.toml", "--json", "p.png"), "p.png: is an input of this command"),
        (
            ("trend", "a.csv", "--plot", "t.png", "--json", "./t.png"),
            "t.png: is given with --plot and with --json.",
        ),
        (("diagnose", "a.csv", "--json", "x.py", "--stub", "x.py"), "x.py: is given with --json and with --stub. Give"),
        (("diagnose", "a.csv", "--json", "x.py", "--stub", "d/../x.py"), "x.py: is given with --json and with --stub."),
        (("plan", "a.csv", "--json", "x.ti1", "--ti1", "x.ti1"), "x.ti1: is given with --json and with --ti1. Give"),
    ],
)
def test_an_output_is_neither_an_input_nor_another_output(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    for name in ("a.csv", "p.png"):
        (tmp_path / name).write_text("as before", encoding="utf-8")
    (tmp_path / "link.csv").symlink_to("a.csv")
    (tmp_path / "c.toml").write_text("[[sessions]]\nfile = \"a.\\u0063sv\"\n[[sessions]]\nfile = 'p.png'\n", "utf-8")
    done = run(*arguments, "--force")
    assert (done.code, done.out) == (2, "")
    assert message in " ".join(done.err.split())
    assert {path.name for path in tmp_path.iterdir()} == {"a.csv", "link.csv", "c.toml", "p.png"}
    assert {(tmp_path / name).read_text(encoding="utf-8") for name in ("a.csv", "p.png")} == {"as before"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("map", "p.png", "--mode", "chroma", "--json", "-o", "m.png"), "--json needs a value: FILE|-."),
        (("lifetime", "p.png", "--json", "--tolerance", "3"), "--json needs a value: FILE|-."),
        (("apply", "p.png", "--mode", "--hours", "3", "-o", "m.png"), "--mode needs a value: [stable|chroma"),
    ],
)
def test_an_option_is_no_value_of_another_option(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done]
) -> None:
    done = run(*arguments)
    assert done.code == 2
    assert message in " ".join(done.err.split())
