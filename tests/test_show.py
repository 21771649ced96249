"""`lutgen show`: the numbers of display engineers, against oracles, and the drawn page."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import chdir
from typing import TYPE_CHECKING

import numpy as np
import pytest
from colour.temperature import xy_to_CCT_McCamy1992
from PIL import Image

from lutgen import DisplayModel, LutgenError, read_measurements, show
from lutgen.colorimetry import xy_to_uv
from lutgen.display import AppliedEffect, Estimate, default_display
from lutgen.display.aging import cct_and_duv, toward
from lutgen.display.tips import luminance_law
from lutgen.effects import catalogue
from lutgen.numerals import spaced
from lutgen.report.aging_plot import PAGE, plot_display
from lutgen.report.drawing import DPI
from tests.command import here
from tests.quick import mostly_slow

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.numbers

TIPS = np.array([[0.3127, 0.3290, 300.0], [0.64, 0.33, 64.0], [0.30, 0.60, 214.0], [0.15, 0.06, 22.0]])
DRIVES = ("1,1,1", "1,0,0", "0,1,0", "0,0,1")


def display(folder: Path, *later: np.ndarray, source: str = "measured by a test") -> DisplayModel:
    """A display that is new at hour 0 and has the tips ``later`` after every further 1000 h."""
    lines = [f"# source: {source}"] * bool(source) + ["hour,R,G,B,x,y,Y"]
    for hour, tips in enumerate((TIPS, *later)):
        lines += [f"{1000 * hour},{drive},{x},{y},{Y}" for drive, (x, y, Y) in zip(DRIVES, tips, strict=True)]
    path = folder / "display.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return DisplayModel(read_measurements(path))


def moved(*, x: float = 0.0, y: float = 0.0, white: float = 1.0, blue: float = 1.0) -> np.ndarray:
    """The new tips: white's chromaticity shifted, all luminances times ``white``, and blue's also times ``blue``."""
    tips = TIPS * (1.0, 1.0, white)
    tips[0, :2] += x, y
    tips[3, 2] *= blue
    return np.asarray(tips)


def lutgen(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    with chdir(cwd):
        return here("show", *arguments)


@pytest.mark.parametrize(
    ("white", "told"),
    [
        ((0.9, 0.8), ""),
        ((1.05, 0.9), ""),
        ((0.5, 0.7), "white rose from 150 cd/m² at 1000 h to 210 at 2000 h, which is not aging"),
        ((1.2, 0.8), "white rose from 300 cd/m² at 0 h to 360 at 1000 h, which is not aging"),
    ],
)
def test_white_that_became_much_brighter_did_not_only_age(
    white: tuple[float, float], told: str, tmp_path: Path
) -> None:
    display(tmp_path, *(moved(white=each) for each in white))
    done = lutgen("--display", "display.csv", cwd=tmp_path)
    assert done.returncode == 0
    assert (told in " ".join(done.stderr.split())) if told else ("rose" not in done.stderr)


def test_chromaticities_and_luminances_are_the_readings(model: DisplayModel) -> None:
    shown = show(model)
    rows = [line.split(",") for line in default_display().read_text().splitlines() if line[0].isdigit()]
    readings = np.array(rows, dtype=float)
    np.testing.assert_array_equal(shown.hours, readings[::4, 0])
    np.testing.assert_allclose(shown.xyY.reshape(-1, 3), readings[:, 4:], rtol=1e-12)
    red, green, blue, white = (readings[i::4, 6] for i in (1, 2, 3, 0))
    np.testing.assert_allclose(shown.non_additivity, (red + green + blue) / white - 1, atol=1e-12)
    np.testing.assert_allclose(shown.luminance[:, 3], blue / blue[0], rtol=1e-12)


# u', v' of D65 and A: CIE 15:2018, tables of illuminants; of the sRGB primaries: Rec. ITU-R BT.709 as often quoted.
@pytest.mark.parametrize(
    ("xy", "uv"),
    [
        ((0.31272, 0.32903), (0.1978, 0.4683)),
        ((0.44758, 0.40745), (0.2560, 0.5243)),
        ((0.64, 0.33), (0.4507, 0.5229)),
        ((0.30, 0.60), (0.1250, 0.5625)),
        ((0.15, 0.06), (0.1754, 0.1579)),
    ],
)
def test_uv_is_what_the_cie_prints(xy: tuple[float, float], uv: tuple[float, float]) -> None:
    np.testing.assert_allclose(xy_to_uv(xy), uv, atol=6e-5)


# CIE 15:2018: the correlated colour temperatures of its illuminants.
@pytest.mark.parametrize(
    ("xy", "kelvin"),
    [((0.44758, 0.40745), 2856), ((0.34567, 0.35851), 5001), ((0.31272, 0.32903), 6503), ((0.29903, 0.31488), 7504)],
)
def test_cct_is_that_of_the_cie_illuminants(xy: tuple[float, float], kelvin: float) -> None:
    cct, duv = cct_and_duv(xy_to_uv([xy]))
    assert abs(cct[0] - kelvin) < 4
    assert abs(duv[0]) < 0.004


def test_cct_agrees_with_mccamy(model: DisplayModel) -> None:
    shown = show(model)
    np.testing.assert_allclose(shown.cct, xy_to_CCT_McCamy1992(shown.xyY[:, 0, :2]), rtol=0.003)


def test_a_colour_far_from_the_planckian_locus_has_no_cct() -> None:
    assert np.isnan(cct_and_duv(xy_to_uv([(0.30, 0.60)]))).all()


def test_hours_between_readings_are_interpolated_and_told_against_hour_0(model: DisplayModel) -> None:
    whole, part = show(model), show(model, [500.0, 750.0, 1000.0])
    np.testing.assert_array_equal(whole.hours[1:3], (500, 1000))
    np.testing.assert_array_equal(part.shift[0], whole.shift[1])
    np.testing.assert_allclose(part.xyY[1], 0.5 * (part.xyY[0] + part.xyY[2]), rtol=1e-12)
    with pytest.raises(LutgenError, match="outside the measured span"):
        show(model, [20_000.0])


@pytest.mark.parametrize(
    ("way", "hue"),
    [
        ((0.01, 0.002), "red"),
        ((0.0, 0.01), "yellow"),
        ((-0.008, 0.01), "green"),
        ((-0.01, 0.0), "cyan"),
        ((0.0, -0.01), "blue"),
        ((0.008, -0.01), "magenta"),
        ((0.0005, 0.0005), ""),
    ],
)
def test_a_shift_is_named_by_the_hue_it_points_to(way: tuple[float, float], hue: str) -> None:
    assert toward(np.array(way)) == hue


@pytest.mark.parametrize(
    ("tips", "words", "others"),
    [
        (moved(x=0.03, y=0.04), ("0.0", "toward yellow", "6504 K → ", "held to 0.0 %"), ("blue", "fallen")),
        (moved(x=-0.02, y=-0.03, white=0.6), ("toward blue", "luminance has fallen to 60 %"), ("held", "against")),
        (moved(white=1.1), ("hardly moved", "luminance has risen to 110 %"), ("toward", "K →")),
        (moved(blue=0.7), ("hardly moved", "blue has lost 30 % against white", "held"), ("toward",)),
    ],
)
def test_the_sentence_says_what_is_wrong(
    tmp_path: Path, tips: np.ndarray, words: tuple[str, ...], others: tuple[str, ...]
) -> None:
    sentence = show(display(tmp_path, tips)).sentence()
    assert sentence.startswith("By 1\N{NO-BREAK SPACE}000 h white has ")
    assert sentence.endswith(".")
    assert all(word in sentence for word in words), sentence
    assert not any(word in sentence for word in others), sentence


def test_one_session_is_said_to_show_no_aging(tmp_path: Path) -> None:
    sentence = show(display(tmp_path)).sentence()
    assert sentence == "There is one session, at 0 h, so that no aging can be shown."
    # One hour of a display with several sessions is compared with hour 0.
    assert show(display(tmp_path, moved(blue=0.7)), [1000.0]).sentence().startswith("By 1")


def test_the_sentence_on_the_default_display(model: DisplayModel) -> None:
    sentence = show(model).sentence()
    assert "toward yellow" in sentence
    assert "luminance is held to" in sentence
    assert "blue has lost" in sentence


def test_a_reconstruction_says_so_and_a_silent_file_is_told_apart(tmp_path: Path, model: DisplayModel) -> None:
    assert "RECONSTRUCTED, not measured" in show(model).provenance
    assert "measured by a test" in show(display(tmp_path, TIPS)).provenance
    assert "does not say where they come from" in show(display(tmp_path, TIPS, source="")).provenance


def test_json_has_every_measured_hour_and_no_nan(tmp_path: Path, model: DisplayModel) -> None:
    done = lutgen("--json", cwd=tmp_path)
    content = json.loads(done.stdout, parse_constant=pytest.fail)
    assert content["schema"] == 1
    assert "RECONSTRUCTED" in content["display"]["metadata"]["source"]
    assert [row["hours"] for row in content["hours"]] == model.tips.hours.tolist()
    last, shown = content["hours"][-1], show(model)
    assert last["white"]["delta_uv"] == shown.shift[-1, 0]
    assert last["blue"]["relative_luminance"] == shown.luminance[-1, 3]
    assert last["cct_k"] == shown.cct[-1]


def test_json_names_the_hue_to_which_white_moves(model: DisplayModel) -> None:
    first, *_, last = show(model).as_json()["hours"]
    assert (first["direction"], last["direction"]) == (None, "yellow")


def test_json_of_a_white_without_cct_has_null(tmp_path: Path) -> None:
    tips = moved(x=-0.02, y=0.17)
    row = show(display(tmp_path, tips)).as_json()["hours"][-1]
    assert row["cct_k"] is None
    assert row["duv"] is None
    assert "K →" not in show(display(tmp_path, tips)).sentence()


def test_the_command_prints_sentence_source_and_about_eight_hours(tmp_path: Path, model: DisplayModel) -> None:
    done = lutgen(cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    sentence, source, *table = done.stdout.splitlines()
    assert sentence == show(model).sentence()
    assert source == show(model).provenance
    hours = [float(line.split()[0]) for line in table if line.strip()[:1].isdigit()]
    assert len(hours) == 8
    assert (hours[0], hours[-1]) == (0, 18000)
    assert set(hours) <= set(model.tips.hours)
    assert max(map(len, table)) <= 80
    assert not list(tmp_path.iterdir())


def test_the_command_prints_the_hours_asked_for(tmp_path: Path) -> None:
    done = lutgen("--hours", "0,562.5,10000", cwd=tmp_path)
    rows = [line.split()[0] for line in done.stdout.splitlines()[2:] if line.strip()[:1].isdigit()]
    assert rows == ["0", "562.5", "10000"]
    assert done.stdout.startswith("By 10\N{NO-BREAK SPACE}000 h ")


@pytest.fixture(scope="module")
def plain(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plot of the default display."""
    path = tmp_path_factory.mktemp("plain") / "plain.png"
    plot_display(model, path)
    return path


def test_the_plot_is_a_page_with_the_same_bytes_on_every_run_and_no_date(
    plain: Path, tmp_path: Path, model: DisplayModel
) -> None:
    plot_display(model, tmp_path / "again.png")
    assert plain.read_bytes() == (tmp_path / "again.png").read_bytes()
    with Image.open(plain) as page:
        assert page.size == (PAGE[0] * DPI, PAGE[1] * DPI)
        assert set(page.info) <= {"dpi"}
        edges = np.asarray(page.convert("L"), dtype=int)
    for edge in (edges[:3], edges[-3:], edges[:, :3], edges[:, -3:]):
        assert edge.min() == 255, "nothing is cut off"


@pytest.mark.parametrize("law", mostly_slow(["paper", "measured", "table"], "table"))
@pytest.mark.parametrize("place", mostly_slow(["still", "dim", "far"], "far"))
def test_any_display_can_be_plotted(tmp_path: Path, law: str, place: str) -> None:
    tips = {"still": TIPS, "dim": moved(x=-0.06, y=-0.05, white=0.3), "far": moved(x=0.1)}[place]
    (tmp_path / "law.csv").write_text("hour,factor\n0,1\n500,0.9\n40000,0.5\n")
    history = display(tmp_path, tips, source="a long story " * 60)
    chosen = luminance_law(str(tmp_path / "law.csv") if law == "table" else law)
    plot_display(DisplayModel(history.measurements, reference="absolute", luminance=chosen), tmp_path / "page.png")
    assert (tmp_path / "page.png").read_bytes().startswith(b"\x89PNG")


def test_a_users_own_matplotlib_style_changes_nothing(plain: Path, tmp_path: Path, model: DisplayModel) -> None:
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 20, "figure.facecolor": "black", "lines.linewidth": 9}):
        plot_display(model, tmp_path / "styled.png")
    assert plain.read_bytes() == (tmp_path / "styled.png").read_bytes()


@pytest.mark.slow
def test_an_existing_plot_is_replaced_only_by_force(tmp_path: Path) -> None:
    path = tmp_path / "page.png"
    path.write_text("mine")
    done = lutgen("--plot", "page.png", cwd=tmp_path)
    assert (done.returncode, path.read_text()) == (2, "mine")
    assert "exists already. Add --force" in done.stderr
    done = lutgen("--plot", "page.png", "--force", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes().startswith(b"\x89PNG")
    assert done.stdout.splitlines()[-1] == "page.png"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--plot", "page.svg"), "ends in .png"),
        (("--plot", "folder.png"), "is a folder"),
        (("--hours", "0,20000"), "outside the measured span"),
        (("--display", "absent.csv"), "cannot read the readings"),
        (("--plot", "blocked/page.png"), "cannot write"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(tmp_path: Path, arguments: tuple[str, ...], sentence: str) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "blocked").write_text("a file")
    done = lutgen(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"folder.png", "blocked"}


def test_help_ends_in_an_example_and_does_not_import_numpy(tmp_path: Path) -> None:
    done = lutgen("--help", cwd=tmp_path)
    assert "\n    lutgen show --plot display.png\n" in done.stdout
    script = "import sys, lutgen.cli.commands.show; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=False).returncode == 0


@pytest.mark.parametrize(
    ("hours", "text"), [(0.0, "0"), (562.5, "562.5"), (18000.0, "18 000"), (1234567.0, "1 234 567")]
)
def test_hours_are_spaced_in_thousands(hours: float, text: str) -> None:
    assert spaced(hours).replace("\N{NO-BREAK SPACE}", " ") == text


def test_of_an_effect_the_fitted_parameters_are_told_and_those_that_are_not_at_rest() -> None:
    leak = catalogue()["black-level"]
    values = leak.rest() | {"new": 0.002, "tint_x": 0.1}
    estimates = {name: Estimate(value) for name, value in values.items()}
    estimates["grown"] = Estimate(0.0, 0.001, at_bound=True)
    model = DisplayModel(
        read_measurements(default_display()),
        effects=(AppliedEffect(leak, estimates, free=("grown",)), AppliedEffect.of(catalogue()["drive-loss"], {})),
    )
    loss, leaks = show(model, [0.0]).effects_in_words()
    assert loss == "drive-loss: on"
    assert [part.split()[0] for part in leaks.removeprefix("black-level: ").split(", ")] == ["new", "grown", "tint_x"]
    assert leaks.count("(at its bound)") == 1
    assert "(at its bound)" in leaks.split(", ")[1]
