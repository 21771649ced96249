"""Pictures on a screen: each pixel shows what the display shows at its place, and nothing else changes."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image, ImageOps
from skimage.io import imread, imsave

from lutgen import DisplayModel, LutgenError, apply_to_image, read_measurements
from lutgen.bindings import oiio
from lutgen.colorimetry import CHUNK, delta_e_2000
from lutgen.display import AppliedEffect, Conditions, default_display, save_model
from lutgen.display.on_screen import SIDE, MeasuredUniformity, OnScreen, seen_at
from lutgen.effects import catalogue
from lutgen.pictures.difference import shown_lab
from lutgen.pictures.difference_map import check_placed, difference_map
from lutgen.pictures.frame import Frame, aged_series
from lutgen.pictures.images import turned
from lutgen.readings.session import Session
from lutgen.report import difference_map as report_map
from tests.command import here
from tests.native_displays import BLACK, GREYS, MIXTURES, RAMPS, TIPS, Panel
from tests.native_displays import session as panel_session
from tests.quick import mostly_slow

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

AGE = ("chroma-luma", 10_000.0)
FALLOFF = {"new": 0.1, "grown": 0.4, "slope_u": 0.3, "tint_z": 0.5}
QUARTER = OnScreen(0.5, 0.0, 0.5, 0.25)


@pytest.fixture(scope="module")
def model() -> DisplayModel:
    """The default display with a light fall-off towards its edges, in a lit room."""
    effects = [AppliedEffect.of(catalogue()["edge-falloff"], FALLOFF)]
    effects.append(AppliedEffect.of(catalogue()["ambient-reflection"], {"reflectance": 0.02}))
    at = Conditions(ambient_lx=50.0)
    return DisplayModel(read_measurements(default_display()), effects=tuple(effects), conditions=at)


@pytest.fixture
def picture(tmp_path: Path) -> tuple[Path, Any]:
    """A 16-bit picture, so that rounding hides no error."""
    pixels = np.random.default_rng(3).integers(0, 65536, (5, 7, 3)).astype(np.uint16)
    imsave(tmp_path / "a.tif", pixels, check_contrast=False)
    return tmp_path / "a.tif", pixels / 65535.0


def seen_from(model: DisplayModel, u: float, v: float) -> DisplayModel:
    """The model at one place of the screen."""
    where: dict[str, Any] = {"u": u, "v": v}
    return replace(model, conditions=replace(model.conditions, **where))


def one_by_one(code: Array, model: DisplayModel, screen: OnScreen, age: tuple[str, float] = AGE) -> Array:
    """Code values of each pixel, by a model with the place of that single pixel."""
    rows, columns = code.shape[:2]
    seen = np.empty_like(code)
    for row in range(rows):
        for column in range(columns):
            u = screen.left + screen.width * (column + 0.5) / columns
            v = screen.top + screen.height * (row + 0.5) / rows
            there = seen_from(model, u, v)
            seen[row, column] = there.at(*age).code_to_code(code[row, column])
    return seen


@pytest.mark.parametrize("screen", [OnScreen(), QUARTER])
def test_each_pixel_is_what_the_display_shows_at_its_place(
    model: DisplayModel, picture: tuple[Path, Any], screen: OnScreen, tmp_path: Path
) -> None:
    file, code = picture
    apply_to_image(file, tmp_path / "b.tif", model.at(*AGE), on_screen=screen)
    written = imread(tmp_path / "b.tif") / 65535.0
    assert np.abs(written - one_by_one(code, model, screen)).max() < 0.6 / 65535.0


def test_without_a_place_the_whole_picture_is_seen_in_the_middle(
    model: DisplayModel, picture: tuple[Path, Any], tmp_path: Path
) -> None:
    file, code = picture
    apply_to_image(file, tmp_path / "b.tif", model.at(*AGE))
    written = imread(tmp_path / "b.tif") / 65535.0
    assert np.abs(written - model.at(*AGE).code_to_code(code)).max() < 0.6 / 65535.0
    assert np.abs(written - one_by_one(code, model, OnScreen())).max() > 0.05


def test_a_picture_of_many_blocks_is_seamless_and_eight_bits_are_not_looked_up(
    model: DisplayModel, tmp_path: Path
) -> None:
    """Grey decreases monotonically from the middle of each row to its right end, over all blocks."""
    wide = 300
    imsave(tmp_path / "a.png", np.full((2 * CHUNK // wide, wide, 3), 180, np.uint8), check_contrast=False)
    plain = replace(model, effects=(AppliedEffect.of(catalogue()["edge-falloff"], {"new": 0.5}),))
    apply_to_image(tmp_path / "a.png", tmp_path / "b.png", plain.at("chroma", 0.0), on_screen=OnScreen())
    levels = imread(tmp_path / "b.png")[..., 1].astype(int)
    assert (np.diff(levels[:, wide // 2 :], axis=1) <= 0).all()
    assert (np.diff(levels[len(levels) // 2 :], axis=0) <= 0).all()
    assert levels[len(levels) // 2, wide // 2] == 180
    assert (levels == levels[::-1, ::-1]).all()


@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_picture_lies_on_the_screen_as_viewers_turn_it(orientation: int) -> None:
    stored = QUARTER.places(0, 15, (3, 5), orientation).reshape(3, 5, 2)
    upright = turned(stored, orientation)
    high, wide = upright.shape[:2]
    assert upright == pytest.approx(QUARTER.places(0, 15, (high, wide)).reshape(high, wide, 2))


def test_places_are_the_middles_of_pixels_row_by_row() -> None:
    assert OnScreen().places(1, 3, (2, 2)).tolist() == [[0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]


# Measured tables ------------------------------------------------------------------------------------------------------

GRID = np.array([(u, v) for v in (1 / 6, 0.5, 5 / 6) for u in (1 / 6, 0.5, 5 / 6)])
RATIO = np.array([0.80, 0.95, 0.86, 0.93, 1.0, 0.97, 0.78, 0.92, 0.84])


def session(places: Array = GRID, ratio: Array = RATIO, grey: float = 1.0) -> Session:
    """Readings of one grey at places, where blue falls twice as fast, and of an even darker grey."""
    count = len(places)
    xyz = 200.0 * np.stack([ratio, ratio, ratio**2], axis=1)
    even = np.full((count, 3), 20.0)
    drive = np.repeat(np.array([[grey], [0.4]]), count, axis=0) * np.ones(3)
    return Session(
        drive=drive,
        xyz=np.vstack([xyz, even]),
        absolute=True,
        names=("",) * 2 * count,
        lines=np.arange(2, 2 + 2 * count),
        form="test",
        conditions=dict(zip(("u", "v"), np.vstack([places, places]).T, strict=True)),
        file="table.csv",
        sha256="ab",
    )


def dimmed(table: MeasuredUniformity, places: Array) -> Array:
    model = OnScreen(uniformity=table).aged(DisplayModel(read_measurements(default_display())))
    white = np.ones((1, 3))
    middle = model.at("chroma", 0.0).code_to_xyz(white)
    there = [replace(model, conditions=Conditions(u=u, v=v)).at("chroma", 0.0) for u, v in places]
    return np.array([each.code_to_xyz(white)[0] for each in there]) / middle


def test_a_table_is_met_at_its_places_and_holds_beyond_the_outermost() -> None:
    table = MeasuredUniformity.of(session())
    wanted = np.stack([RATIO, RATIO, RATIO**2], axis=1)
    assert dimmed(table, GRID) == pytest.approx(wanted, rel=1e-6)  # the grid's places are nodes
    assert dimmed(table, np.array([[0.0, 0.0], [1.0, 1.0]])) == pytest.approx(wanted[[0, -1]], rel=1e-6)


def test_places_of_any_pattern_are_met_within_the_table_that_pixels_are_looked_up_in() -> None:
    places = np.array([[0.1, 0.12], [0.9, 0.1], [0.13, 0.9], [0.88, 0.85], [0.5, 0.5], [0.31, 0.72]])
    ratio = np.array([0.8, 0.85, 0.75, 0.9, 1.0, 0.96])
    luminance = dimmed(MeasuredUniformity.of(session(places, ratio)), places)[:, 1]
    assert luminance == pytest.approx(ratio, abs=0.05 / SIDE)


def test_the_place_of_the_picture_is_told() -> None:
    (told,) = OnScreen(0.25, 0.5, 0.5, 0.125).sentences()
    assert "lies from 25 % to 75 % of the screen's width and from 50 % to 62 % of its height" in told
    assert "fills the screen" in OnScreen().sentences()[0]


def test_the_brightest_grey_is_taken_and_the_table_is_said() -> None:
    table = MeasuredUniformity.of(session(grey=0.75))
    assert table.grey == 0.75
    assert table.sentence() == (
        "table.csv: grey 0.75 at 9 places has 78 to 100 % of its luminance in the middle. The table applies at every "
        "hour; the un-aged display is assumed to be uniform."
    )


AROUND = np.array([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9], [0.2, 0.5]])


@pytest.mark.parametrize(
    ("readings", "says"),
    [
        (session(GRID[:4], RATIO[:4]), "no grey was read at 5 places"),
        (session(AROUND, RATIO[:5]), "nearest to the middle of the screen is u = 0.2, v = 0.5"),
        (session(ratio=np.where(RATIO < 0.79, 0.0, RATIO)), "has no light"),
        (replace(session(), conditions={}), "state no positions"),
    ],
)
def test_tables_that_say_too_little_are_refused(readings: Session, says: str) -> None:
    with pytest.raises(LutgenError, match=says):
        MeasuredUniformity.of(readings)


def test_places_on_one_line_are_refused() -> None:
    line = np.array([(u, 0.5) for u in (0.1, 0.3, 0.5, 0.7, 0.9)])
    with pytest.raises(LutgenError, match="all places lie on one line"):
        dimmed(MeasuredUniformity.of(session(line, RATIO[:5])), line)


# Other results that depend on places ----------------------------------------------------------------------------------


def literal(code: Array, model: DisplayModel, screen: OnScreen, age: tuple[str, float] = AGE) -> Array:
    """ΔE2000 of each pixel between the un-aged and the aged display, both with the place of that single pixel."""
    delta_e = np.empty(code.shape[:2])
    for row, column in np.ndindex(*delta_e.shape):
        u = screen.left + screen.width * (column + 0.5) / code.shape[1]
        v = screen.top + screen.height * (row + 0.5) / code.shape[0]
        there = seen_from(model, u, v)
        labs = [shown_lab(there.at(*each).code_to_xyz(code[row, column][None])) for each in (("stable", 0.0), age)]
        delta_e[row, column] = delta_e_2000(*labs)[0]
    return delta_e


def test_a_map_and_its_statistics_are_those_of_each_pixel_at_its_place(
    model: DisplayModel, picture: tuple[Path, Any], tmp_path: Path
) -> None:
    file, code = picture
    wanted = literal(code, model, QUARTER)
    difference = difference_map(file, model, *AGE, floats=[tmp_path / "m.exr"], on_screen=QUARTER)
    assert difference.shown == pytest.approx(wanted, abs=1e-4)
    assert (difference.mean, difference.largest) == pytest.approx((wanted.mean(), wanted.max()), abs=1e-4)
    image = oiio().ImageInput.open(str(tmp_path / "m.exr"))
    assert image.read_image()[..., 0] == pytest.approx(wanted, abs=1e-4)
    image.close()
    assert difference.as_json()["on_screen"] == {
        "left": 0.5,
        "top": 0.0,
        "width": 0.5,
        "height": 0.25,
        "uniformity": None,
    }


def test_pixels_of_alpha_0_lie_on_no_screen(model: DisplayModel, tmp_path: Path) -> None:
    pixels = np.full((2, 3, 4), 200, np.uint8)
    pixels[0, 1:, 3] = 0
    Image.fromarray(pixels).save(tmp_path / "a.png")
    difference = difference_map(tmp_path / "a.png", model, *AGE, on_screen=OnScreen())
    wanted = literal(pixels[..., :3] / 255.0, model, OnScreen())
    wanted[0, 1:] = np.nan
    assert difference.shown == pytest.approx(wanted, abs=1e-4, nan_ok=True)
    assert difference.mean == pytest.approx(np.nanmean(wanted), abs=1e-4)


def test_the_picture_of_a_map_says_where_it_lies_and_the_table(model: DisplayModel, tmp_path: Path) -> None:
    imsave(tmp_path / "a.png", np.full((4, 4, 3), 128, np.uint8), check_contrast=False)
    screen = replace(QUARTER, uniformity=MeasuredUniformity.of(session()))
    plain, placed = (difference_map(tmp_path / "a.png", model, *AGE, on_screen=each) for each in (None, screen))
    with pytest.MonkeyPatch.context() as patch:
        feet: list[str] = []
        whole = vars(report_map)["picture"]

        def noting(*arguments: Any, foot: str, **options: Any) -> Any:
            feet.append(foot)
            return whole(*arguments, foot=foot, **options)

        patch.setattr(report_map, "picture", noting)
        report_map.plot_map(plain, tmp_path / "plain.png")
        report_map.plot_figure_6([placed, placed], tmp_path / "placed.png")
    assert "of the screen" not in feet[0]
    assert " ".join(screen.sentences()) in feet[1]


def test_a_sheet_shows_each_pixel_at_its_place_and_its_mean(model: DisplayModel, tmp_path: Path) -> None:
    pixels = np.random.default_rng(4).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    imsave(tmp_path / "a.png", pixels, check_contrast=False)
    series = aged_series(tmp_path / "a.png", model, [AGE[0]], [AGE[1]], on_screen=QUARTER)
    assert series.seen(*AGE) == pytest.approx(np.rint(255 * one_by_one(pixels / 255.0, model, QUARTER)), abs=0)
    assert series.curves[AGE[0]].mean[1] == pytest.approx(literal(pixels / 255.0, model, QUARTER).mean())


@pytest.mark.parametrize("orientation", [2, 6])
@pytest.mark.parametrize("screen", [None, QUARTER])
def test_a_sheet_and_a_map_of_a_turned_file_are_those_of_the_upright_file(
    screen: OnScreen | None, orientation: int, model: DisplayModel, tmp_path: Path
) -> None:
    image = Image.fromarray(np.random.default_rng(4).integers(0, 256, (4, 6, 3)).astype(np.uint8))
    exif = Image.Exif()
    exif[0x0112] = orientation
    image.save(tmp_path / "turned.tif", exif=exif)
    ImageOps.exif_transpose(Image.open(tmp_path / "turned.tif")).save(tmp_path / "upright.tif")
    files = tmp_path / "turned.tif", tmp_path / "upright.tif"
    of_turned, of_upright = (aged_series(file, model, [AGE[0]], [AGE[1]], on_screen=screen) for file in files)
    assert (of_turned.seen(*AGE) == of_upright.seen(*AGE)).all()
    assert of_turned.frame.whole
    assert of_turned.curves[AGE[0]].mean == pytest.approx(of_upright.curves[AGE[0]].mean)
    maps = [difference_map(file, model, *AGE, on_screen=screen).shown for file in files]
    assert maps[0] == pytest.approx(maps[1])


def test_beside_a_table_the_un_aged_display_is_even(tmp_path: Path) -> None:
    """With a table, the map at hour 0 shows only the unevenness."""
    imsave(tmp_path / "a.png", np.full((3, 3, 3), 160, np.uint8), check_contrast=False)
    screen = OnScreen(uniformity=MeasuredUniformity.of(session()))
    model = screen.aged(DisplayModel(read_measurements(default_display())))
    shown = difference_map(tmp_path / "a.png", model, "chroma", 0.0, on_screen=screen).shown
    assert shown[1, 1] == pytest.approx(0.0, abs=1e-6)
    assert shown[0, 0] > 3.0
    frame = Frame.of(np.full((3, 3, 3), 160, np.uint8), np.ones((3, 3), np.bool_), 3, 3, screen)
    assert (frame.shown(screen.unaged(model)) == 160).all()


def test_what_falls_off_on_the_first_day_shows_on_a_display_with_a_model_of_its_own() -> None:
    """The first session was read in the middle: the display's own model knows nothing of the corners."""
    readings = panel_session(Panel(), [*TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES])
    fall = (AppliedEffect.of(catalogue()["edge-falloff"], {"new": 0.2}),)
    model = DisplayModel(readings, baseline="native", reference="absolute", effects=fall)
    code = np.array([[0.2, 0.5, 0.7]])
    middle = model.at("chroma", 0.0)
    corner = seen_at(middle, np.array([[0.0, 1.0]]))
    assert corner.code_to_xyz(code) == pytest.approx(0.8 * middle.code_to_xyz(code))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda _model: OnScreen(0.5, 0.0, 0.6, 1.0), "does not lie on the screen"),
        (lambda _model: OnScreen(0.0, 0.0, 0.0, 1.0), "does not lie on the screen"),
        (lambda _model: OnScreen.parse("0,0,1"), "--place 0,0,1: give left, top, width and height"),
        (lambda model: OnScreen().aged(replace(model, effects=())), "nothing in this model depends on the place"),
        (lambda model: OnScreen().aged(replace(model, conditions=Conditions(u=0.1))), "--at u gives one position"),
        (
            lambda model: OnScreen(uniformity=MeasuredUniformity.of(session())).aged(model),
            "edge-falloff of the model and the uniformity table .* count twice",
        ),
        (lambda _model: check_placed("a.tif", 10_000, 10_000), "10000 × 10000 pixels are more than the 33,177,600"),
    ],
)
def test_what_has_no_place_is_refused(model: DisplayModel, make: Any, says: str) -> None:
    with pytest.raises(LutgenError, match=says):
        make(model)


@pytest.fixture(scope="module")
def files(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A picture, a model that depends on places, and a table of uniformity."""
    folder = tmp_path_factory.mktemp("on-screen")
    imsave(folder / "a.png", np.random.default_rng(5).integers(0, 256, (20, 30, 3)).astype(np.uint8))
    save_model(model, folder / "model.toml")
    white = [(*place, 1.0, 1.0, 1.0, *(200.0 * share,) * 3) for place, share in zip(GRID, RATIO, strict=True)]
    np.savetxt(folder / "table.csv", white, delimiter=",", header="u,v,R,G,B,X,Y,Z", comments="")
    return folder


@pytest.mark.parametrize(
    "command",
    mostly_slow(
        [
            APPLIED := "apply a.png --mode chroma --hours 9000 -o b.png",
            DRAWN := "sheet a.png --hours 0,9000 -o s.png",
            "map a.png --mode chroma --hours 9000 -o m.png",
            "figure 2 a.png -o f2.png",
            "figure 6 a.png -o f6.png",
            "report a.png --hours 0,9000 -o r.html",
        ],
        APPLIED,
        DRAWN,
    ),
)
def test_every_command_that_draws_shows_places(files: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.chdir(files)
    words = command.split()
    for where in (["--model", "model.toml", "--place", "0,0,0.5,0.5"], ["--uniformity", "table.csv"]):
        plain = here(*words, *where[:2] if "--model" in where else (), "--force")
        assert plain.returncode == 0, plain.stderr
        even = (files / words[-1]).read_bytes()
        placed = here(*words, *where, "--force")
        assert placed.returncode == 0, placed.stderr
        assert (files / words[-1]).read_bytes() != even
        assert "No LUT carries what depends on the place" in placed.stdout + (files / words[-1]).read_text("latin1")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("apply a.png --lut x.cube --on-screen -o c.png", "does not know where on the screen"),
        ("apply a.png --build x --mode chroma --hours 1 --place 0,0,1,1 -o c.png", "does not know where on the screen"),
        ("apply a.png --mode chroma --hours 1 --on-screen -o c.png", "nothing in this model depends on the place"),
        ("figure 5 a.png --model model.toml --on-screen -o c.png", "colours at all places of the screen together"),
        ("map a.png --mode chroma --hours 1 --uniformity none.csv -o c.png", "no such file"),
    ],
)
def test_what_cannot_be_shown_in_its_place_writes_nothing(
    files: Path, monkeypatch: pytest.MonkeyPatch, words: str, says: str
) -> None:
    monkeypatch.chdir(files)
    done = here(*words.split(" "))
    assert (done.returncode, says in done.stderr) == (2, True)
    assert not (files / "c.png").exists()


def test_json_says_where_the_picture_lies(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(files)
    words = "apply a.png --mode chroma --hours 9000 --uniformity table.csv --force --json -o j.png"
    done = here(*words.split(" "))
    content = json.loads(done.stdout)["on_screen"]
    assert (content["width"], content["uniformity"]["file"]) == (1.0, "table.csv")
