"""`lutgen report`: frames, the page's structure, no network requests, and bad input."""

from __future__ import annotations

import io
import json
import re
import zlib
from base64 import b64decode, b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from lutgen import DisplayModel, apply_to_image, compare, lifetime, read_measurements
from lutgen.bake.lut import Lut
from lutgen.bindings import oiio
from lutgen.colorimetry import code_to_linear, linear_to_code
from lutgen.display import default_display
from lutgen.numerals import times
from lutgen.pictures.difference import differences
from lutgen.pictures.frame import fitting, read_frame
from lutgen.pictures.images import turned
from lutgen.pictures.viewer import WHITE
from lutgen.report.drawing import page_png
from lutgen.report.page_scenes import MOST, SIZE, STEPS, hours_of, map_colours, reach_of
from lutgen.report.page_template import environment, ticks
from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.command import Done

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).resolve().parents[1]
MODEL = DisplayModel(read_measurements(default_display()))

#: A file name that would run a script, or end an attribute or a tag, if a page took the name unescaped.
HOSTILE = "<img src=x onerror=alert(1)>&\"'$title.png"

#: Only three hours, for speed.
HOURS = ("--hours", "0,10000,18000")


class Read(HTMLParser):
    """The content of a page: elements with their attributes, and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in {"img", "meta", "link", "input", "br", "line", "polyline", "circle"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in {"line", "polyline", "circle"}:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"style", "script"} & set(self.open):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).replace("\N{NO-BREAK SPACE}", " ").split())

    def all(self, tag: str, **attributes: str) -> list[dict[str, str]]:
        wanted = {name.replace("_", "-"): value for name, value in attributes.items()}
        return [
            attributes for name, attributes in self.elements if name == tag and wanted.items() <= attributes.items()
        ]


@pytest.fixture
def run(run: Callable[..., Done], tmp_path: Path) -> Callable[..., Done]:
    """Run `lutgen report` in this process, in a folder with a.png."""
    imsave(tmp_path / "a.png", tissue(), check_contrast=False)
    return lambda *arguments, command="report": run(command, *arguments)


def delta_e(first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """ΔE2000 of code values, by colour-science."""
    import colour

    lab = (colour.XYZ_to_Lab(colour.sRGB_to_XYZ(each), (0.3127, 0.3290)) for each in (first, second))
    return np.asarray(colour.delta_E(*lab, method="CIE 2000"))


def tissue(size: int = 48) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return np.asarray(immunohistochemistry())[200 : 200 + size, 200 : 200 + size]


def pixels(address: str) -> np.ndarray[Any, np.dtype[np.uint8]]:
    kind, _, data = address.partition(",")
    assert kind == "data:image/png;base64"
    with Image.open(io.BytesIO(b64decode(data))) as image:
        return np.asarray(image.convert("RGBA" if image.mode == "RGBA" else "RGB"))


def data_in(text: str) -> dict[str, Any]:
    (data_text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    content: dict[str, Any] = json.loads(data_text)
    return content


# The page -------------------------------------------------------------------------------------------------------------


def test_the_page_begins_with_the_finding_and_has_its_sections(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("a.png", "-o", "r.html", *HOURS)
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[1].startswith("r.html: ")
    assert done.out.startswith("Luminance of chroma-luma: ")
    page = Read((tmp_path / "r.html").read_text())
    assert page.open == []
    (image,) = lifetime(["a.png"], MODEL).images
    for mode in ("chroma", "chroma-luma"):
        hours = image.curves[mode].hours_until("mean", 3)
        assert hours is not None
        assert f"after {round(hours):,} h".replace(",", " ") in page.text.partition("Display:")[0]
    assert "This display is reconstructed, not measured." in page.text
    assert [section["id"] for section in page.all("section")] == ["viewer", "lifetimes", "frames", "provenance"]
    assert read_measurements(default_display()).sha256 in page.text
    assert all(image.get("alt") for image in page.all("img"))
    assert len({attributes["id"] for _, attributes in page.elements if "id" in attributes}) == len(
        [attributes for _, attributes in page.elements if "id" in attributes]
    )


@pytest.mark.parametrize(
    ("options", "law"),
    [
        ((), "the paper's law, 67 % at 10 000 h and 40 % at 18 000 h"),
        (("--luminance", "measured"), "as this display's"),
    ],
)
def test_the_first_lines_name_the_law_of_luminance_and_no_others_do(
    options: tuple[str, ...], law: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    assert run("a.png", "-o", "r.html", *HOURS, *options).code == 0
    first, _, others = Read((tmp_path / "r.html").read_text()).text.partition("How long pictures stay true")
    assert f"Luminance of chroma-luma: {law}" in first
    assert "Luminance of chroma-luma" not in others


def test_the_page_fetches_nothing_and_names_no_folder(run: Callable[..., Done], tmp_path: Path) -> None:
    run(str(tmp_path / "a.png"), "-o", "r.html", *HOURS)
    text = (tmp_path / "r.html").read_text()
    assert str(tmp_path) not in text
    page = Read(text)
    assert not [attributes for _, attributes in page.elements if not attributes.get("src", "data:").startswith("data:")]
    assert not [
        attributes for _, attributes in page.elements if not attributes.get("href", "data:").startswith(("data:", "#"))
    ]
    assert not re.findall(r"https?://|url\(|@import|\bfetch\(|XMLHttpRequest|import\(", text)
    (policy,) = page.all("meta", http_equiv="Content-Security-Policy")
    assert policy["content"].startswith("default-src 'none'")


def test_the_table_of_contents_names_every_section_and_leads_there(run: Callable[..., Done], tmp_path: Path) -> None:
    assert run("--hours", "18000", "--format", "clf", "-o", "aged", command="build").code == 0
    run("a.png", "-o", "r.html", "--build", "aged", *HOURS)
    page = Read((tmp_path / "r.html").read_text())
    links = [link["href"].removeprefix("#") for link in page.all("a")]
    assert links == [section["id"] for section in page.all("section")]
    assert "How true the LUTs are" in page.text.partition("No script runs here")[0]


def test_the_scale_of_the_maps_is_the_first_that_holds_95_percent_of_every_map(tmp_path: Path) -> None:
    imsave(tmp_path / "a.png", tissue(), check_contrast=False)
    lives = lifetime([tmp_path / "a.png"], MODEL, hours=[0.0, 2000.0, 18_000.0])
    curves = lives.images[0].curves.values()
    reaches = [reach_of(lives, hours) for hours in ([0.0], [0.0, 2000.0], [0.0, 18_000.0])]
    assert reaches[0] == 2.0
    assert reaches == sorted(reaches)
    assert reaches[-1] >= max(float(curve.p95[-1]) for curve in curves) > reaches[-1] / 2


def test_the_numbers_are_those_of_lifetime(run: Callable[..., Done], tmp_path: Path) -> None:
    run("a.png", "-o", "r.html", *HOURS)
    run("a.png", "--json", "l.json", command="lifetime")
    data = data_in((tmp_path / "r.html").read_text())
    modes = json.loads((tmp_path / "l.json").read_text())["images"][0]["modes"]
    assert data["hours"] == [0, 10_000, 18_000]
    for mode, scenes in data["modes"].items():
        curve = {point["hours"]: point for point in modes[mode]["curve"]}
        # 10 000 h is no measured time, so lifetime does not list this hour.
        (last,) = [scene for scene in scenes if scene["hours"] == 18_000]
        assert {key: last[key] for key in ("mean", "sd", "p95", "max")} == {
            key: curve[18_000][key] for key in ("mean", "sd", "p95", "max")
        }
        white = MODEL.at(mode, 18_000).code_to_xyz(np.ones(3))
        assert [last["white_x"], last["luminance"]] == pytest.approx([white[0] / white.sum(), white[1]])


def unpacked(text: str) -> np.ndarray[Any, np.dtype[np.uint16]]:
    """Decode a table from its text as the page's script does: (n, n, n, 4)."""
    planes = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8).reshape(2, SIZE, SIZE, SIZE, 4).astype(np.uint16)
    return np.cumsum(256 * planes[0] + planes[1], axis=2, dtype=np.uint16)


def test_tables_hold_the_colours_of_the_model_and_their_difference(run: Callable[..., Done], tmp_path: Path) -> None:
    run("a.png", "-o", "r.html", *HOURS)
    data = data_in((tmp_path / "r.html").read_text())
    assert data["table_size"] == SIZE
    assert {mode: len(texts) for mode, texts in data["tables"].items()} == {"chroma": 3, "chroma-luma": 3}
    axis = np.linspace(0, 1, SIZE)
    for mode, texts in data["tables"].items():
        for hours, text in zip(data["hours"], texts, strict=True):
            table, display, unaged = unpacked(text), MODEL.at(mode, hours), MODEL.at("stable", 0)
            for red, green, blue in ((0, 0, 0), (16, 16, 16), (16, 0, 3), (5, 11, 2)):
                code = axis[[red, green, blue]][None]
                colour = table[blue, green, red] / (WHITE, WHITE, WHITE, 65535)
                # Beside the clip a table contains values slightly above white.
                assert np.minimum(colour[:3], 1.0) == pytest.approx(display.code_to_code(code)[0], abs=1e-5)
                (difference,) = differences(code.__getitem__, 1, unaged, [display])
                assert 100 * colour[3] == pytest.approx(difference[0], abs=0.01)


def test_how_far_the_slider_is_from_the_model_is_measured_and_told(run: Callable[..., Done], tmp_path: Path) -> None:
    rows = []
    for hours in ("0,18000", "0..18000:6000"):
        assert run("a.png", "-o", "r.html", "--force", "--hours", hours).code == 0
        text = Read((tmp_path / "r.html").read_text()).text
        (figures,) = re.findall(r"ΔE2000 ([\d.]+) from the model in mean, ([\d.]+) at 95 % and ([\d.]+) at most", text)
        rows.append([float(each) for each in figures])
        assert rows[-1] == sorted(rows[-1])
    assert rows[1][0] < rows[0][0], "more tables, less error"
    # A literal twin for the first table and the blend: half way between both tables.
    run("a.png", "-o", "r.html", "--force", "--hours", "0,18000")
    data = data_in((tmp_path / "r.html").read_text())
    code = tissue().reshape(-1, 3) / 255
    away = []
    for mode, texts in data["tables"].items():
        first, last = (unpacked(text)[..., :3] / WHITE for text in texts)
        for hour, table in ((0, first), (18_000, last), (9000, (first + last) / 2)):
            drawn = Lut("code", table).apply(code)
            away.append(delta_e(drawn, MODEL.at(mode, hour).code_to_code(code)))
    assert rows[0][0] == pytest.approx(np.mean(away), abs=0.006)
    assert rows[0][2] == pytest.approx(np.max(away), abs=0.06)


def test_stills_are_what_apply_writes_and_maps_are_on_one_scale(run: Callable[..., Done], tmp_path: Path) -> None:
    run("a.png", "-o", "r.html", *HOURS)
    text = (tmp_path / "r.html").read_text()
    page, data = Read(text), data_in(text)
    largest = max(scene["p95"] for scenes in data["modes"].values() for scene in scenes)
    assert data["map_reach"] / 2 <= largest <= data["map_reach"], "the scale fits the data"
    for mode in ("chroma", "chroma-luma"):
        (picture,) = page.all("img", data_mode=mode, data_kind="picture")
        apply_to_image("a.png", "aged.png", MODEL.at(mode, 18_000), force=True)
        assert (pixels(picture["src"]) == imread(tmp_path / "aged.png")).all()
        (shown,) = page.all("img", data_mode=mode, data_kind="map")
        frame = read_frame(Path("a.png"), pixels=10**6, width=900)
        (difference,) = frame.differences(MODEL.at("stable", 0), [MODEL.at(mode, 18_000)])
        level = np.minimum(difference / data["map_reach"] * STEPS, STEPS - 1).astype(int)
        assert (pixels(shown["src"]) == map_colours()[level]).all()
    for identifier in ("unaged", "source"):
        (image,) = page.all("img", id=identifier)
        assert (pixels(image["src"]) == tissue()).all()


def test_only_the_pages_own_scripts_may_run(run: Callable[..., Done], tmp_path: Path) -> None:
    run("a.png", "-o", "r.html", *HOURS)
    text = (tmp_path / "r.html").read_text()
    (policy,) = Read(text).all("meta", http_equiv="Content-Security-Policy")
    scripts = re.findall(r"<script(?: type=\"module\")?>(.*?)</script>", text, re.DOTALL)
    hashes = {f"'sha256-{b64encode(sha256(each.encode()).digest()).decode()}'" for each in scripts}
    (permitted,) = re.findall("script-src ([^;]*)", policy["content"])
    assert set(permitted.split()) == hashes
    assert len(hashes) == 2


def test_a_second_run_gives_the_same_bytes(run: Callable[..., Done], tmp_path: Path) -> None:
    run("a.png", "-o", "r.html", *HOURS)
    run("a.png", "-o", "s.html", *HOURS)
    assert (tmp_path / "r.html").read_bytes() == (tmp_path / "s.html").read_bytes()


def test_a_hostile_file_name_is_only_text(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "a.png").rename(tmp_path / HOSTILE)
    assert run(HOSTILE, "-o", "r.html", *HOURS).code == 0
    text = (tmp_path / "r.html").read_text()
    assert "<img src=x" not in text
    page = Read(text)
    assert HOSTILE in page.text
    assert not [attributes for _, attributes in page.elements if "onerror" in attributes]


def test_a_build_adds_its_certificates_and_says_when_it_is_of_another_display(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    assert run("--hours", "0,18000", "--format", "clf", "-o", "aged", command="build").code == 0
    run("a.png", "--build", "aged", "-o", "r.html", *HOURS)
    text = Read((tmp_path / "r.html").read_text()).text
    assert "aged holds 4 LUTs, 0 to 18 000 h." in text
    assert "where the display neither jumps nor is clipped" in text
    assert "another display or model" not in text
    run("a.png", "--build", "aged", "--selection", "continuous", "-o", "s.html", *HOURS)
    assert "another display or model" in Read((tmp_path / "s.html").read_text()).text


@pytest.mark.slow
def test_readings_add_the_diagnosis_and_the_pictures_are_of_their_display(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    data = str(ROOT / "examples/display-a.csv")
    assert run("a.png", "--data", data, "--hours", "0,18000", "-o", "r.html").code == 0
    page = Read((tmp_path / "r.html").read_text())
    assert "several: More than one effect is missing: eotf-drift" in page.text
    assert "the error falls from" in page.text
    assert "This display is simulated, not measured." in page.text
    assert "this section is about" not in page.text
    before, _, after = page.text.partition("The picture as the display ages")
    assert "several: More than one effect is missing: eotf-drift" in before, "the verdict is on top"
    comparison = compare(read_measurements(data))
    assert f"the error falls from {times(comparison.ratio)}" in before
    assert "several: More than one effect is missing: eotf-drift" in after
    assert len(page.all("figure", **{"class": "plot"})) == 6


@pytest.mark.slow
@pytest.mark.rare(instead="test_readings_add_the_diagnosis_and_the_pictures_are_of_their_display")
def test_a_model_adds_its_effects(run: Callable[..., Done], tmp_path: Path) -> None:
    rest = {"new": 0.002, "grown": 0.0, "power": 1.0, "saturation": 0.0, "tint_x": 0.0, "tint_z": 0.0}
    lines = [f"{name} = {{ value = {value} }}" for name, value in rest.items()]
    lines[0] = "new = { value = 0.002, stderr = 0.0001, free = true }"
    head = 'schema = 1\n[model]\nselection = "continuous"\n[[effects]]\nname = "black-level"\norigin = "built-in"\n'
    (tmp_path / "m.toml").write_text("\n".join([f"{head}[effects.parameters]", *lines, ""]))
    done = run("a.png", "--model", "m.toml", "-o", "r.html", "--hours", "0,18000")
    assert done.code == 0, done.err
    text = Read((tmp_path / "r.html").read_text()).text
    assert "Effects of the model black-level: new 0.00200 ± 0.00010" in text
    assert "m.toml" in text


# The frame ------------------------------------------------------------------------------------------------------------


def test_a_large_image_is_shrunk_by_the_mean_of_its_light(tmp_path: Path) -> None:
    picture = tissue(96)
    imsave(tmp_path / "a.png", picture, check_contrast=False)
    frame = read_frame(tmp_path / "a.png", pixels=48 * 48, width=900)
    linear = code_to_linear(picture / 255.0).reshape(48, 2, 48, 2, 3).mean(axis=(1, 3))
    assert (frame.colours[frame.places] == np.rint(linear_to_code(linear) * 255.0)).all()
    assert (frame.width, frame.source_width, frame.whole) == (48, 96, False)


def test_cells_that_straddle_pixels_and_blocks_keep_all_light(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = tissue(97)
    path = str(tmp_path / "a.tif")
    spec = oiio().ImageSpec(97, 97, 3, "uint8")
    spec.tile_width = spec.tile_height = 32
    out = oiio().ImageOutput.create(path)
    assert out.open(path, spec)
    assert out.write_tiles(0, 97, 0, 97, 0, 1, np.ascontiguousarray(picture))
    assert out.close()
    whole = read_frame(tmp_path / "a.tif", pixels=10**6, width=41)
    monkeypatch.setattr("lutgen.pictures.images.BAND", 32 * 32)
    parts = read_frame(tmp_path / "a.tif", pixels=10**6, width=41)
    assert (parts.colours[parts.places] == whole.colours[whole.places]).all()
    mean = code_to_linear(whole.colours[whole.places] / 255.0).mean()
    assert mean == pytest.approx(code_to_linear(picture / 255.0).mean(), rel=1e-3)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_frame_is_turned_as_its_file_asks(tmp_path: Path, orientation: int) -> None:
    image = Image.fromarray(np.arange(60, dtype=np.uint8).reshape(4, 5, 3))
    exif = Image.Exif()
    exif[0x0112] = orientation
    image.save(tmp_path / "a.tif", exif=exif)
    from PIL import ImageOps

    with Image.open(tmp_path / "a.tif") as stored:
        upright = np.asarray(ImageOps.exif_transpose(stored))
    frame = read_frame(tmp_path / "a.tif", pixels=10**6, width=900)
    assert (frame.colours[frame.places] == upright).all()
    assert (turned(np.asarray(image), orientation) == upright).all()
    assert (frame.height, frame.width) == (frame.source_height, frame.source_width)


def test_what_is_transparent_shows_nothing(run: Callable[..., Done], tmp_path: Path) -> None:
    picture = np.dstack([tissue(), np.full((48, 48), 255, np.uint8)])
    picture[:10, :, 3] = 0
    imsave(tmp_path / "b.png", picture, check_contrast=False)
    run("b.png", "-o", "r.html", *HOURS)
    (unaged,) = Read((tmp_path / "r.html").read_text()).all("img", id="unaged")
    assert (pixels(unaged["src"])[..., 3] == picture[..., 3]).all()


@pytest.mark.parametrize(
    ("height", "width", "fits"), [(100, 200, (100, 200)), (10_000, 20_000, (350, 700)), (1, 10**6, (1, 900))]
)
def test_a_frame_fits(height: int, width: int, fits: tuple[int, int]) -> None:
    assert fitting(height, width, 245_000, 900) == fits


# Small parts ----------------------------------------------------------------------------------------------------------


def test_png_is_read_back_by_others() -> None:
    random = np.random.default_rng(0)
    for channels in (3, 4):
        picture = random.integers(0, 256, (7, 11, channels), np.uint8)
        with Image.open(io.BytesIO(page_png(picture))) as image:
            assert (np.asarray(image) == picture).all()
    smooth = np.add.outer(np.arange(40), np.arange(50)).astype(np.uint8)[..., None].repeat(3, axis=2)
    with Image.open(io.BytesIO(page_png(smooth))) as image:
        assert (np.asarray(image) == smooth).all()
    assert len(page_png(smooth)) < smooth.size / 20
    level = random.integers(0, 5, (7, 11), np.uint8)
    palette = random.integers(0, 256, (5, 3), np.uint8)
    with Image.open(io.BytesIO(page_png(level, palette))) as image:
        assert (np.asarray(image.convert("RGB")) == palette[level]).all()


@pytest.mark.parametrize("last", [0.4, 1.0, 7.3, 26.0, 100.0, 18_000.0, 61_320.0])
def test_ticks_are_round_few_and_within(last: float) -> None:
    labels = ticks(last)
    assert labels[0] == 0
    assert labels[-1] <= last
    assert 3 <= len(labels) <= 8


def test_usual_hours_are_measured_times_with_the_ends() -> None:
    frames, curve = hours_of(None, MODEL)
    assert 7 <= len(frames) <= 13
    assert set(frames) <= set(MODEL.tips.hours)
    assert (frames[0], frames[-1]) == (0, 18_000)
    assert curve == list(MODEL.tips.hours)


def test_a_table_escapes_its_cells() -> None:
    parts: Any = environment().get_template("parts.html").module
    written = str(parts.table(Table(["x & y"], [("<b>\nc",)], notes=["1 < 2"])))
    assert "&lt;b&gt;<br>c</th>" in written
    assert "x &amp; y</th>" in written
    assert "<p>1 &lt; 2</p>" in written


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.png", "-o", "r.html"), "none.png: there is no such image"),
        (("a.png", "-o", "r.pdf"), "r.pdf: give a name that ends in .html or .htm"),
        (("a.png", "-o", "there.html"), "there.html: exists already"),
        (("a.png", "-o", "folder.html"), "is a folder"),
        (("a.png", "-o", "r.html", "--tolerance", "3,-1"), "tolerance -1"),
        (("a.png", "-o", "r.html", "--tolerance", "three"), "--tolerance three: give numbers"),
        (("a.png", "-o", "r.html", "--hours", "0..90000"), "18000"),
        (("a.png", "-o", "r.html", "--hours", "0..18000:10"), f"at most {MOST} hours"),
        (("a.png", "-o", "r.html", "--build", "folder.html"), "folder.html: holds no manifest.json"),
        (("a.png", "-o", "r.html", "--data", "none.csv"), "none.csv"),
        (("a.png", "-o", "r.html", "--instrument", "0.002,0.003"), "--instrument states the noise of --data"),
        (("a.png", "a.png", "-o", "r.html"), "unexpected extra argument"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    run: Callable[..., Done], tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    (tmp_path / "there.html").write_text("mine")
    (tmp_path / "folder.html").mkdir()
    done = run(*arguments)
    assert done.code == 2
    assert message in done.err
    assert (tmp_path / "there.html").read_text() == "mine"
    assert not (tmp_path / "r.html").exists()


def test_force_replaces_a_page(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "r.html").write_text("mine")
    assert run("a.png", "-o", "r.html", "--force", *HOURS).code == 0
    assert (tmp_path / "r.html").read_text().startswith("<!DOCTYPE html>")


def test_an_image_of_one_colour_has_its_page(run: Callable[..., Done], tmp_path: Path) -> None:
    imsave(tmp_path / "one.png", np.full((1, 1, 3), 128, np.uint8), check_contrast=False)
    assert run("one.png", "-o", "r.html", *HOURS).code == 0
    assert run("one.png", "-o", "s.html", "--hours", "0").code == 0
