"""Planning a study: permitted images, rendered and frozen files, and the command."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from jsonschema.exceptions import ValidationError
from PIL import Image, ImageCms
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import DisplayModel, LutgenError, read_measurements
from lutgen.display import default_display
from lutgen.files import PARTIAL, file_sha256
from lutgen.pictures.apply import apply_to_images
from lutgen.study.pictures import blind_name, find_images, look_at, render_images, shown_pixels
from lutgen.study.protocol import ANSWERS, IMAGES, PROTOCOL, read_protocol
from tests.altered import altered
from tests.command import Done, here, in_process, words
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable

TISSUE = immunohistochemistry()

#: Chunks of a PNG that holds only its picture.
BARE = [b"IHDR", b"IDAT", b"IEND"]


def tile(place: int, side: int = 24) -> Any:
    row, column = divmod(place, 20)
    return TISSUE[row * side : (row + 1) * side, column * side : (column + 1) * side]


def write_images(folder: Path) -> None:
    """Write in/s0.png to in/s6.png."""
    (folder / "in").mkdir()
    for place in range(7):
        imsave(folder / f"in/s{place}.png", tile(place), check_contrast=False)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run `lutgen study plan` in this process, in a folder with in/s0.png to in/s6.png."""
    monkeypatch.chdir(tmp_path)
    write_images(tmp_path)
    return in_process(monkeypatch, capsys, "study", "plan")


SMALL = ("--per-condition", "2", "--seed", "3")


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the images and their study for three readers, which no test changes."""
    folder = tmp_path_factory.mktemp("planned")
    write_images(folder)
    with chdir(folder):
        assert here("study", "plan", "in", *SMALL, "--readers", "3", "-o", "study").returncode == 0
    return folder


def pixels(path: Path) -> Any:
    return np.asarray(Image.open(path)).astype(int)


def chunks(data: bytes) -> list[bytes]:
    """The types of a PNG's chunks, read without lutgen's encoder."""
    parts, place = [], 8
    while place < len(data):
        length = int.from_bytes(data[place : place + 4], "big")
        parts.append(data[place + 4 : place + 8])
        place += 12 + length
    return parts


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# Files of a study -----------------------------------------------------------------------------------------------------


def test_a_study_is_planned_whole(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("in", *SMALL, "--readers", "3", "--practice", "in/../in/s6.png", "-o", "study")
    assert done.code == 2
    assert "s6.png: is given twice" in done.err
    imsave(tmp_path / "try.tif", tile(50), check_contrast=False)
    done = run("in", *SMALL, "--readers", "3", "--practice", "try.tif", "-o", "study", "--title", "Ours")
    assert (done.code, done.err) == (0, "")
    plan_text = words(done.out)
    assert plan_text.startswith("study: 6 images, 3 readers, 2 sessions, 19 pictures rendered.")
    assert "Reading session 1: 6 images under none, chroma@18000, chroma-luma@18000." in plan_text
    assert "Reading session 2: 6 images under none, from 24 days after reading session 1 on." in plan_text
    assert "Read by nobody: 1 image given (s" in plan_text
    assert "Practice, un-aged and not analysed: try." in plan_text
    protocol = read_protocol(tmp_path / "study")
    assert (protocol.title, protocol.readers, protocol.sessions, protocol.washout_days) == ("Ours", 3, 2, 24.0)
    assert [(each.name, each.width, each.height) for each in protocol.practice] == [("try", 24, 24)]
    for each in protocol.images:
        assert each.sha256 == hashlib.sha256((tmp_path / f"in/{each.name}.png").read_bytes()).hexdigest()
    assert protocol.model["sha256"] == read_measurements(default_display()).sha256
    assert set(protocol.model["luts"]) == {"chroma@18000", "chroma-luma@18000"}
    assert str(tmp_path) not in (tmp_path / "study" / PROTOCOL).read_text()
    assert {path.name for path in tmp_path.iterdir()} == {"in", "study", "try.tif"}
    for render in protocol.renders:
        assert file_sha256(tmp_path / "study" / render.file) == render.sha256


def test_what_is_rendered_is_what_a_trial_shows_and_nothing_else(planned: Path) -> None:
    protocol = read_protocol(planned / "study")
    assert {(each.image, each.condition) for each in protocol.renders} == {
        (trial.image, trial.condition) for trial in protocol.trials
    }
    assert set(files(planned / "study")) == {PROTOCOL, *(each.file for each in protocol.renders)}


def test_unaged_pictures_are_the_images_and_aged_ones_what_the_model_shows(planned: Path) -> None:
    protocol, model = read_protocol(planned / "study"), DisplayModel(read_measurements(default_display()))
    aged = {each.name: model.at(each.mode, each.hours) for each in protocol.conditions}
    for render in protocol.renders:
        source, shown = pixels(planned / f"in/{render.image}.png"), pixels(planned / "study" / render.file)
        expected = np.rint(255 * np.clip(aged[render.condition].code_to_code(source / 255), 0, 1))
        if render.condition == "none":
            assert np.array_equal(shown, source)
        # Some pixels of a tile are at the model's jump, which a table cannot follow.
        assert np.abs(shown - expected).max() <= 3
        assert (shown == expected).mean() > 0.99


def test_pictures_hold_pixels_only_and_their_names_hint_at_nothing(run: Callable[..., Done], tmp_path: Path) -> None:
    tagged = Image.fromarray(tile(30))
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    tagged.save(tmp_path / "in/tagged.png", icc_profile=profile, dpi=(300, 300))
    tagged.save(tmp_path / "in/photo.jpg", quality=80, comment=b"chroma")
    assert run("in", "--per-condition", "3", "-o", "study").code == 0
    protocol = read_protocol(tmp_path / "study")
    for render in protocol.renders:
        data = (tmp_path / "study" / render.file).read_bytes()
        assert chunks(data) == BARE
        assert len(render.file) == len(f"{IMAGES}/") + 20 + len(".png")
    assert len({render.file for render in protocol.renders}) == len(protocol.renders)
    shown = pixels(tmp_path / "study" / protocol.render("photo", "none").file)
    # Two JPEG decoders may differ by one code.
    assert np.abs(shown - pixels(tmp_path / "in/photo.jpg")).max() <= 1


def test_neither_time_nor_size_nor_the_order_of_writing_tells_a_condition(planned: Path) -> None:
    protocol = read_protocol(planned / "study")
    states = [(planned / "study" / each.file).stat() for each in protocol.renders]
    assert len({each.st_mtime_ns for each in states}) == 1
    assert len({each.st_size for each in states}) == 1
    by_change = sorted(zip(protocol.renders, states, strict=True), key=lambda each: each[1].st_ctime_ns)
    assert [each.file for each, _ in by_change] == sorted(each.file for each in protocol.renders)


def test_no_picture_is_in_its_place_before_all_are_made(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Change and birth times of a file cannot be set: the slower making of an aged picture would reveal it."""
    there = []

    def counting(*arguments: Any, **options: Any) -> Any:
        there.append(len([*tmp_path.rglob(f"{IMAGES}/*.png")]))
        return apply_to_images(*arguments, **options)

    monkeypatch.setattr("lutgen.study.pictures.apply_to_images", counting)
    assert run("in", *SMALL, "-o", "study").code == 0
    assert set(there) == {0}
    assert {path.name for path in (tmp_path / "study").iterdir()} == {IMAGES, PROTOCOL}


def test_blind_names_depend_on_key_image_and_condition() -> None:
    named = {blind_name(key, image, under) for key in (b"1", b"2") for image in "ab" for under in ("none", "chroma@5")}
    assert len(named) == 8
    assert blind_name(b"1", "a", "none") == blind_name(b"1", "a", "none")


def test_the_same_options_give_the_same_bytes_and_another_seed_other_names(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    for output in ("one", "two"):
        assert run("in", *SMALL, "-o", output).code == 0
    assert run("in", "--per-condition", "2", "--seed", "4", "-o", "three").code == 0
    one, two, three = (files(tmp_path / name) for name in ("one", "two", "three"))
    assert one == two
    assert not set(one) & set(three) - {PROTOCOL}


def test_16_bits_are_rounded_after_aging_and_it_is_said(run: Callable[..., Done], tmp_path: Path) -> None:
    deep = np.random.default_rng(1).integers(0, 65_536, (24, 24, 3), np.uint16)
    imsave(tmp_path / "in/deep.tif", deep, check_contrast=False)
    done = run("in/deep.tif", "in/s0.png", "--conditions", "none,chroma@18000", "--per-condition", "1",
               "--readers", "2", "-o", "study")  # fmt: skip
    assert done.code == 0
    assert "16 bits per channel, rounded to 8 bits for the readers: deep." in words(done.out)
    protocol = read_protocol(tmp_path / "study")
    shown = pixels(tmp_path / "study" / protocol.render("deep", "none").file)
    assert np.array_equal(shown, np.rint(deep / 257))
    aged = DisplayModel(read_measurements(default_display())).at("chroma", 18_000).code_to_code(deep / 65_535)
    shown = pixels(tmp_path / "study" / protocol.render("deep", "chroma@18000").file)
    assert (shown == np.rint(255 * aged)).mean() > 0.98


def test_a_table_gives_any_other_design(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "design.csv").write_text("session,image,condition\n1,s1,chroma@9000\n2,s1,stable@0\n2,s2,none\n")
    done = run("in", "--design", "design.csv", "--readers", "2", "-o", "study", "--json", "plan.json")
    assert done.code == 0
    protocol = read_protocol(tmp_path / "study")
    assert [each.name for each in protocol.images] == ["s1", "s2"]
    assert {(t.reader, t.session, t.image, t.condition) for t in protocol.trials} == {
        (reader, *rest)
        for reader in (1, 2)
        for rest in ((1, "s1", "chroma@9000"), (2, "s1", "stable@0"), (2, "s2", "none"))
    }
    content = json.loads((tmp_path / "plan.json").read_text())
    validator("study-plan").validate(content)
    assert content["power"] is None
    assert content["left_out"] == ["s0", "s3", "s4", "s5", "s6"]


def test_the_page_tells_of_a_session_what_all_its_readers_read(run: Callable[..., Done], tmp_path: Path) -> None:
    rows = ["1,s1,chroma@9000,1", "1,s2,none,2", "1,s3,stable@0,2"]
    (tmp_path / "design.csv").write_text("\n".join(["session,image,condition,reader", *rows]))
    done = run("in", "--design", "design.csv", "-o", "study")
    assert "Reading session 1: 1 to 2 images under chroma@9000, none, stable@0." in words(done.out)


# The images -----------------------------------------------------------------------------------------------------------


def broken(folder: Path, kind: str) -> None:
    """Add an image to the folder that a study refuses."""
    plain = Image.fromarray(tile(40))
    if kind == "transparent":
        rgba = np.dstack([tile(40), np.full((24, 24), 255, np.uint8)])
        rgba[3, 4, 3] = 254
        Image.fromarray(rgba).save(folder / "new.png")
    elif kind == "turned":
        exif = Image.Exif()
        exif[0x0112] = 6
        plain.save(folder / "new.jpg", exif=exif)
    elif kind == "grey":
        plain.convert("L").save(folder / "new.png")
    elif kind == "cut off":
        plain.save(folder / "new.png")
        (folder / "new.png").write_bytes((folder / "new.png").read_bytes()[:-20])
    elif kind == "text":
        (folder / "new.png").write_text("chroma")
    elif kind == "copied":
        shutil.copyfile(folder / "s1.png", folder / "new.png")
    elif kind == "named in bytes":
        plain.save(folder / "new.png")
        (folder / "new.png").rename(folder / "new\udcff.png")
    elif kind == "named in two lines":
        plain.save(folder / "new\n.png")
    elif kind == "stored again":
        Image.open(folder / "s1.png").save(folder / "new.tif")


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("transparent", "new.png: is transparent in places"),
        ("turned", "new.jpg: asks viewers to turn it (Orientation 6)"),
        ("grey", "new.png: has 1 channel"),
        ("cut off", "new.png: the image is truncated or damaged"),
        ("text", "new.png: not an image that lutgen reads"),
        ("named in bytes", r"'in/new\udcff.png': has letters in its name that cannot be seen"),
        ("named in two lines", r"'in/new\n.png': has letters in its name that cannot be seen"),
        ("copied", "in/new.png and in/s1.png: are the same file, byte for byte"),
        ("stored again", "in/new.tif and in/s1.png: show the same pixels"),
    ],
)
def test_an_image_that_no_reader_should_see_is_named(
    run: Callable[..., Done], tmp_path: Path, kind: str, message: str
) -> None:
    broken(tmp_path / "in", kind)
    done = run("in", *SMALL, "-o", "study")
    assert (done.code, done.out) == (2, "")
    assert message in words(done.err)
    assert {path.name for path in tmp_path.iterdir()} == {"in"}


def test_opaque_alpha_is_left_out(tmp_path: Path) -> None:
    Image.fromarray(np.dstack([tile(1), np.full((24, 24), 255, np.uint8)])).save(tmp_path / "a.png")
    assert np.array_equal(shown_pixels(tmp_path / "a.png"), tile(1))


def test_names_are_stems_where_these_tell_images_apart(tmp_path: Path) -> None:
    (tmp_path / "more").mkdir()
    for place, name in enumerate(("a.png", "a.tif", "b.png", ".hidden.png", "more/c.png")):
        imsave(tmp_path / name, tile(place), check_contrast=False)
    (tmp_path / "notes.txt").write_text("not an image")
    images = find_images([tmp_path])
    assert [each.name for each in look_at(images, lambda _done: None)] == ["a.png", "a.tif", "b", "c"]
    imsave(tmp_path / "more/a.png", tile(9), check_contrast=False)
    with pytest.raises(LutgenError, match=r"both would be called a\.png in the study"):
        look_at(find_images([tmp_path]), lambda _done: None)


def test_a_float_image_is_refused(tmp_path: Path) -> None:
    imsave(tmp_path / "f.tif", tile(0).astype(np.float32) / 255, check_contrast=False)
    with pytest.raises(LutgenError, match="readers are shown PNG, TIFF or JPEG of 8 or 16 bits"):
        shown_pixels(tmp_path / "f.tif")


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("in",), "7 images are fewer than the design needs: 3 conditions × 40 images each are 120. Give 113 more"),
        (("in", "gone.png", *SMALL), "gone.png: there is no such image"),
        (("n" * 300, *SMALL), "cannot be listed: file name too long"),
        (("in", "in/s0.png", *SMALL), "in/s0.png: is given twice"),
        (("empty", *SMALL), "empty: no image in this folder or below. Looked for .png, .jpg, .jpeg, .tif, .tiff."),
        (("in", *SMALL, "--conditions", "none,chroma@99999"), "hour 99999 is outside the measured span 0..18000 h"),
        (("in", *SMALL, "--conditions", "none,blue@5"), "unknown condition 'blue@5'. Write none (un-aged), or a mode"),
        (("in", *SMALL, "--conditions", ","), "unknown condition ''"),
        (("in", "--per-condition", "1", "--conditions", ""), "unknown condition ''"),
        (("in", *SMALL, "--title", "a\udcff"), r"--title 'a\udcff': give one line of letters that can all be seen"),
        (("in", *SMALL, "--title", "a\nb"), r"--title 'a\nb': give one line"),
        (("in", *SMALL, "--washout-days", "-1"), "--washout-days -1: give days from 0 to 3650"),
        (("in", *SMALL, "--washout-days", "nan"), "Invalid value for '--washout-days': 'nan' is not a finite number"),
        (("in", "--per-condition", "1", "--seed", "-1"), "--seed -1: give a whole number from 0 on"),
        (("in", *SMALL, "--model", "gone.toml"), "gone.toml"),
        (("in", *SMALL, "--json", "in"), "in: is a folder"),
        (("in", "--design", "gone.csv"), "gone.csv: cannot read the table"),
        (("in", "--design", "gone.csv", "--sessions", "1"), "--design holds the whole design"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    arguments: tuple[str, ...], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    done = run(*arguments, "-o", "study")
    assert (done.code, done.out) == (2, "")
    assert message in words(done.err)
    assert {path.name for path in tmp_path.iterdir()} == {"in", "empty"}


# The folder -----------------------------------------------------------------------------------------------------------

PLAIN = ("in", "--conditions", "none", "--per-condition", "2", "--sessions", "1")


def test_a_study_is_replaced_with_force_alone_and_never_one_with_answers(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    study = tmp_path / "study"
    assert run(*PLAIN, "-o", "study/").code == 0
    before = files(study)
    done = run(*PLAIN, "--seed", "9", "-o", "study")
    assert (done.code, files(study)) == (2, before)
    assert "study: holds a study already. Choose another folder, or add --force" in words(done.err)
    assert run(*PLAIN, "--seed", "9", "-o", "study", "--force").code == 0
    after = files(study)
    assert set(after) != set(before)
    (study / ANSWERS).mkdir()
    (study / ANSWERS / "1.sqlite").write_bytes(b"answers")
    done = run(*PLAIN, "-o", "study", "--force")
    assert (done.code, files(study)) == (2, {**after, f"{ANSWERS}/1.sqlite": b"answers"})
    assert "holds readers' answers, which --force does not delete either" in words(done.err)


@pytest.mark.parametrize("held", ["mine.txt", f"study/{PROTOCOL}"])
def test_a_folder_of_others_is_never_replaced(held: str, run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "study").mkdir()
    if held == "mine.txt":
        (tmp_path / "study/mine.txt").write_text("mine")
    else:
        shutil.rmtree(tmp_path / "study")
        assert run(*PLAIN, "-o", "study").code == 0
        (tmp_path / "study/notes.txt").write_text("mine")
    before = files(tmp_path / "study")
    done = run(*PLAIN, "-o", "study", "--force")
    assert (done.code, files(tmp_path / "study")) == (2, before)
    assert "holds what lutgen study plan did not make" in words(done.err)


def test_an_empty_folder_may_become_the_study_and_a_file_not(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "study").mkdir()
    assert run(*PLAIN, "-o", "study").code == 0
    (tmp_path / "file").write_text("mine")
    assert "file: is a file" in run(*PLAIN, "-o", "file", "--force").err
    assert "cannot make the study: file name too long" in run(*PLAIN, "-o", "n" * 300).err
    assert "file/study: cannot make the study: not a directory" in run(*PLAIN, "-o", "file/study").err


def test_what_a_killed_run_left_is_removed_by_the_next(run: Callable[..., Done], tmp_path: Path) -> None:
    folder = tmp_path / f".study{PARTIAL}"
    (folder / "new" / IMAGES).mkdir(parents=True)
    (folder / "new" / IMAGES / "half.png").write_bytes(b"half")
    assert run(*PLAIN, "-o", "study").code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"in", "study"}
    assert "images/half.png" not in files(tmp_path / "study")


def test_a_study_that_cannot_be_replaced_stays(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(*PLAIN, "-o", "study").code == 0
    before = files(tmp_path / "study")
    rename = Path.rename

    def full(path: Path, target: Path) -> Path:
        if path.name == "new":
            raise OSError(28, "No space left on device")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", full)
    done = run(*PLAIN, "--seed", "9", "-o", "study", "--force")
    assert (done.code, files(tmp_path / "study")) == (2, before)
    assert "study: cannot make the study: no space left on device. Make room" in words(done.err)
    assert {path.name for path in tmp_path.iterdir()} == {"in", "study"}


def test_answers_that_come_while_a_study_is_replaced_are_kept(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answering(*arguments: Any) -> Any:
        (tmp_path / "study" / ANSWERS).mkdir()
        (tmp_path / "study" / ANSWERS / "1.sqlite").write_bytes(b"answers")
        return render_images(*arguments)

    assert run(*PLAIN, "-o", "study").code == 0
    monkeypatch.setattr("lutgen.study.plan.render_images", answering)
    done = run(*PLAIN, "--seed", "9", "-o", "study", "--force")
    assert (done.code, (tmp_path / "study" / ANSWERS / "1.sqlite").read_bytes()) == (2, b"answers")
    assert "holds readers' answers" in words(done.err)


def test_a_study_beyond_what_power_is_worked_out_for_is_planned_all_the_same(
    run: Callable[..., Done], tmp_path: Path
) -> None:
    done = run("in", "--conditions", "none,stable@0", "--per-condition", "3", "--readers", "700", "--sessions", "1",
               "-o", "study", "--json", "-")  # fmt: skip
    content = json.loads(done.out)
    assert (done.code, content["power"], content["trials"]) == (0, None, 4200)
    assert read_protocol(tmp_path / "study").sha256 == content["protocol_sha256"]


def test_an_image_that_changes_while_the_study_is_planned_is_named(
    run: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def meddling(*arguments: Any) -> Any:
        renders = render_images(*arguments)
        (tmp_path / "in/s0.png").write_bytes((tmp_path / "in/s1.png").read_bytes())
        return renders

    monkeypatch.setattr("lutgen.study.plan.render_images", meddling)
    done = run("in", "--conditions", "none", "--per-condition", "7", "--sessions", "1", "-o", "study")
    assert done.code == 2
    assert "in/s0.png: was changed while the study was planned. Plan it again." in words(done.err)
    assert {path.name for path in tmp_path.iterdir()} == {"in"}


#: The command, interrupted with its processes, as by a terminal, while it ages the second picture.
INTERRUPTED = """
import os, signal, sys
from lutgen.cli import main
from lutgen.study import pictures

apply, calls = pictures.apply_to_images, []

def interrupted(*arguments, **options):
    calls.append(arguments)
    if len(calls) == 2:
        os.killpg(0, signal.SIGINT)
    return apply(*arguments, **options)

pictures.apply_to_images = interrupted
main()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows interrupts in its own way")
def test_an_interrupted_plan_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for place in range(7):
        imsave(tmp_path / f"in/s{place}.png", tile(place), check_contrast=False)
    command = [sys.executable, "-c", INTERRUPTED, "study", "plan", "in", *SMALL, "-o", "study"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, check=False, text=True, start_new_session=True, timeout=300
    )
    assert (done.returncode, done.stdout) == (130, "")
    assert "Traceback" not in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"in"}


# JSON -----------------------------------------------------------------------------------------------------------------


def test_json_is_as_the_schema_says_and_ties_to_the_protocol(run: Callable[..., Done], tmp_path: Path) -> None:
    done = run("in", *SMALL, "-o", "study", "--json", "-")
    content = json.loads(done.out)
    validator("study-plan").validate(content)
    protocol = read_protocol(tmp_path / "study")
    assert content["protocol_sha256"] == protocol.sha256
    assert (content["trials"], content["renders"]) == (len(protocol.trials), len(protocol.renders))
    assert [each["images_a_reader"] for each in content["conditions"]] == [2, 2, 2]
    assert [each["lut"] is None for each in content["conditions"]] == [True, False, False]
    # The README's figure for .clf: the largest smooth ΔE2000 over 31 hours is 0.0016.
    assert max(each["lut"]["worst_smooth_delta_e_2000"] for each in content["conditions"][1:]) < 0.005
    assert content["power"]["answers"] == 2
    for path, value in (
        (("protocol_sha256",), "x"),
        (("conditions", 1, "lut", "worst_delta_e_2000"), None),
        (("conditions", 0, "name"), "un-aged"),
        (("power",), 0.8),
        (("images",), []),
    ):
        with pytest.raises(ValidationError):
            validator("study-plan").validate(altered(content, path, value))
