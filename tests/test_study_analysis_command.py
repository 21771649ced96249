"""The commands `lutgen study analyse` and `study simulate`: page, files, picture, exit codes, bad input."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from jsonschema.exceptions import ValidationError
from skimage.io import imread

from lutgen.report.study_analysis import (
    PICTURE,
    _draw_agreement,
    abreast,
    between,
    changes,
    figure,
    p_value,
    signed,
    title,
)
from lutgen.study.analysis import analyse_answers, analyse_figures
from lutgen.study.protocol import write_protocol
from lutgen.study.reading import begin_reading
from lutgen.study.simulated import PAPER_DIFFERENCES, SimulatedReader, simulate
from lutgen.study.statistics import AgreementCounts
from lutgen.study.tables import TABLE_FILES, answer_table, read_answer_table, read_counts, read_summary
from tests.altered import altered
from tests.command import Done, in_process, words
from tests.schemas import validator
from tests.studies import CONDITIONS, Clock, make_study, paper_trials, read_on, small_protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.study.analysis import Analysis
    from lutgen.study.answers import Answer

pytestmark = pytest.mark.numbers

EXAMPLES = Path(__file__).parents[1] / "examples"
COUNTS, SUMMARY = str(EXAMPLES / "paper-study-counts.csv"), str(EXAMPLES / "paper-study-summary.csv")
DIFFERENCE = ("--difference", "chroma@18000=5.1")

#: One reader reads un-aged and aged images in turn, then un-aged images.
PLANNED = small_protocol(images=40, practice=0, readers=1, conditions=CONDITIONS[:2])


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Run `lutgen study` in this process, in a folder with a planned study."""
    monkeypatch.chdir(tmp_path)
    write_protocol(tmp_path / "planned", PLANNED)
    return in_process(monkeypatch, capsys, "study")


def paper_like(seed: int = 1, **more: int) -> tuple[Answer, ...]:
    trials = paper_trials(seed, **more)
    differences = {(trial.image, trial.condition): PAPER_DIFFERENCES[trial.condition] for trial in trials}
    return simulate(trials, differences, SimulatedReader(seed=seed))


# Pages ----------------------------------------------------------------------------------------------------------------


def test_the_page_of_the_paper_s_figures_holds_its_tables_and_then_what_is_beyond(run: Callable[..., Done]) -> None:
    done = run("analyse", "--counts", COUNTS, "--summary", SUMMARY)
    assert (done.code, done.err) == (0, "")
    page = words(done.out)
    for row in (
        "none 39 41.0 ± 5.4 39 9.7 ± 0.2",
        "chroma-luma 40 51.2 ± 6.4 40 8.4 ± 0.4",
        "none 27 12 69.23 [53.6, 81.4]",
        "chroma-luma 20 20 50.00 [35.2, 64.8]",
        "none ≤ chroma-luma 0.0418 yes 0.624",
        "chroma ≤ chroma-luma 0.413 no",
        "time none → chroma +9.1 +1.96 77 0.0540 no",
    ):
        assert row in page
    tables = page[page.index("As in the paper") :]
    places = [tables.index(part) for part in ("As in the paper", "Table 2", "Table 3", "Table 4", "Beyond the paper",
                                            "Welch", "Holm", "What this design can and cannot show")]  # fmt: skip
    assert places == sorted(places)
    assert page.startswith("Table 3 of Avanaki et al.")


def test_a_page_of_simulated_answers_says_so_in_its_first_line(run: Callable[..., Done]) -> None:
    assert run("simulate", "planned", "--seed", "1", *DIFFERENCE, "-o", "s.csv").code == 0
    done = run("analyse", "--answers", "s.csv")
    assert done.code == 0
    assert done.lines[0].startswith("SIMULATED answers, nobody read anything")
    for part in ("Mann–Whitney", "Cohen's κ", "Mixed models", "one reader: no differences between readers"):
        assert part in words(done.out)


@pytest.mark.parametrize("option", ["--counts", "--summary"])
def test_either_kind_of_figures_is_enough(option: str, run: Callable[..., Done]) -> None:
    done = run("analyse", option, COUNTS if option == "--counts" else SUMMARY, "--plots", "p")
    assert done.code == 0
    assert ("Table 3:" in done.out) == (option == "--counts")
    assert ("Table 2:" in done.out) == (option == "--summary")
    assert Path("p", PICTURE).is_file()


def test_t_intervals_are_read_and_written_as_such(run: Callable[..., Done]) -> None:
    content = json.loads(run("analyse", "--summary", SUMMARY, "--ci", "t", "--json", "-").out)
    (mean, *_) = content["table2"]["means"]
    assert mean["ci95"] == pytest.approx([35.6, 46.4])
    assert mean["sd"] == pytest.approx(5.4 * 39**0.5 / 2.0244, rel=1e-4)


def test_a_study_s_folder_is_analysed_in_its_protocol_s_order(run: Callable[..., Done]) -> None:
    study = Path("study").resolve()
    make_study(study, images=12, readers=1)
    done = run("analyse", "study")
    assert (done.code, done.out) == (2, "")
    assert "nobody has answered yet" in done.err
    for session, count in ((1, None), (2, 10)):
        with begin_reading(study, reader="Dr A", session=session, clock=Clock(), override="a test") as reading:
            read_on(reading, count)
    done = run("analyse", "study")
    assert done.code == 0
    assert done.lines[0].endswith("21 answers. 3 of 24 are still to be given.")
    content = json.loads(run("analyse", "study", "--json", "-").out)
    assert [row["condition"] for row in content["table3"]] == ["none", "chroma@18000", "chroma-luma@18000"]


# Files ----------------------------------------------------------------------------------------------------------------


def analyses() -> dict[str, Analysis]:
    one = [answer for answer in paper_like(per_condition=6) if answer.condition == "none" and answer.session == 1]
    return {
        "figures": analyse_figures(read_counts(COUNTS)[1], read_summary(SUMMARY)[1]),
        "counts": analyse_figures(read_counts(COUNTS)[1], ()),
        "paper": analyse_answers(paper_like()),
        "readers": analyse_answers(paper_like(per_condition=8, readers=2)),
        "one condition": analyse_answers(one),
        "one answer": analyse_answers(one[:1]),
    }


@pytest.fixture(scope="module")
def examples() -> dict[str, Analysis]:
    return analyses()


def strict(analysis: Analysis, capsys: pytest.CaptureFixture[str]) -> Any:
    from lutgen.cli.outputs import write_json

    write_json(analysis.as_json(), "-")
    return json.loads(capsys.readouterr().out, parse_constant=pytest.fail)


@pytest.mark.parametrize("name", ["figures", "counts", "paper", "readers", "one condition", "one answer"])
def test_json_is_as_its_schema_says(
    name: str, examples: dict[str, Analysis], capsys: pytest.CaptureFixture[str]
) -> None:
    content = strict(examples[name], capsys)
    validator("study-analyse").validate(content)
    assert {"schema", "table2", "table3", "table4", "beyond", "limits"} <= content.keys()


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("schema",), 2),
        (("table3", 0, "percent"), 101),
        (("table3", 0, "ci95"), [50]),
        (("table4", 0, "p"), -0.1),
        (("beyond", "kappas", 0, "of"), "colour"),
        (("beyond", "mixed", 0, "sd"), {"weather": 1.0}),
        (("limits",), None),
    ],
)
def test_the_schema_refuses_what_is_wrong(
    path: tuple[str | int, ...], value: object, examples: dict[str, Analysis], capsys: pytest.CaptureFixture[str]
) -> None:
    content = strict(examples["paper"], capsys)
    with pytest.raises(ValidationError):
        validator("study-analyse").validate(altered(content, path, value))


def test_json_csv_and_picture_are_written_and_the_same_again(run: Callable[..., Done], tmp_path: Path) -> None:
    run("simulate", "planned", "--seed", "1", *DIFFERENCE, "-o", "s.csv")
    outputs = ("--json", "s.json", "--csv", "tables", "--plots", "plots")
    assert run("analyse", "--answers", "s.csv", *outputs).code == 0
    written = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert {path.name for path in written} >= {*TABLE_FILES, PICTURE, "s.json"}
    again = run("analyse", "--answers", "s.csv", *outputs)
    assert (again.code, again.out) == (2, "")
    assert "--force" in again.err
    assert run("analyse", "--answers", "s.csv", *outputs, "--force").code == 0
    assert {path: path.read_bytes() for path in written} == written
    content = json.loads(Path("s.json").read_text(encoding="utf-8"))
    for name in TABLE_FILES:
        assert Path("tables", name).read_text(encoding="utf-8").startswith("# SIMULATED answers, nobody read anything")
    with Path("tables/table3.csv").open(encoding="utf-8") as lines:
        next(lines)
        rows = list(csv.DictReader(lines))
    assert [float(row["percent"]) for row in rows] == pytest.approx([row["percent"] for row in content["table3"]])
    assert [float(row["ci95_low"]) for row in rows] == pytest.approx([row["ci95"][0] for row in content["table3"]])
    assert imread("plots/study.png").shape[1] == 1500


def test_tables_that_an_analysis_does_not_have_are_taken_away_with_force(run: Callable[..., Done]) -> None:
    run("simulate", "planned", "--seed", "1", *DIFFERENCE, "-o", "s.csv")
    run("analyse", "--answers", "s.csv", "--csv", "tables")
    assert Path("tables/beyond-kappa.csv").exists()
    assert run("analyse", "--counts", COUNTS, "--csv", "tables", "--force").code == 0
    assert {path.name for path in Path("tables").iterdir()} == {
        "table3.csv", "table4.csv", "beyond-agreement.csv", "beyond-holm.csv",
    }  # fmt: skip


def test_simulated_answers_are_those_of_the_library_and_of_the_seed(run: Callable[..., Done]) -> None:
    for name, seed in (("a.csv", "1"), ("b.csv", "1"), ("c.csv", "2")):
        done = run("simulate", "planned", "--seed", seed, *DIFFERENCE, "-o", name)
        assert (done.code, done.err) == (0, "")
        assert "80 SIMULATED answers" in done.out
    one, same, other = (Path(name).read_text(encoding="utf-8") for name in ("a.csv", "b.csv", "c.csv"))
    assert one == same != other
    differences = {(image.name, "chroma@18000"): 5.1 for image in PLANNED.images}
    expected = simulate(PLANNED.trials, differences, SimulatedReader(seed=1))
    assert read_answer_table("a.csv")[1] == expected


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["analyse"], "give one of: the folder STUDY"),
        (["analyse", "planned", "--counts", COUNTS], "give one of"),
        (["analyse", "--answers", "a.csv", "--summary", SUMMARY], "give one of"),
        (["analyse", "nowhere"], "nowhere/protocol.json"),
        (["analyse", "--answers", "nowhere.csv"], "nowhere.csv: cannot read"),
        (["analyse", "--counts", SUMMARY], "the header is condition,measure,n,mean,ci95; it must be"),
        (["analyse", "--counts", COUNTS, "--ci", "z"], "z"),
        (["analyse", "--counts", COUNTS, "--json", "planned"], "is a folder"),
        (["analyse", "--counts", COUNTS, "--csv", "planned/protocol.json"], "is a file, not a folder"),
        (["analyse", "--counts", COUNTS, "--plots", "planned/protocol.json"], "is a file"),
        (["simulate", "nowhere", "--seed", "1", "-o", "a.csv"], "nowhere/protocol.json"),
        (["simulate", "planned", "-o", "a.csv"], "--seed"),
        (["simulate", "planned", "--seed", "1", *DIFFERENCE, "-o", "a.txt"], "ends in .csv"),
        (["simulate", "planned", "--seed", "1", "--difference", "chroma=5", "-o", "a.csv"], "one of chroma@18000"),
        (["simulate", "planned", "--seed", "1", "--difference", "chroma@18000=-1", "-o", "a.csv"], "ΔE2000 from 0"),
        (["simulate", "planned", "--seed", "1", "--difference", "chroma@18000=inf", "-o", "a.csv"], "ΔE2000 from 0"),
    ],
)
def test_bad_input_ends_with_2_and_a_sentence_and_writes_nothing(
    arguments: list[str], message: str, run: Callable[..., Done], tmp_path: Path
) -> None:
    done = run(*arguments)
    assert (done.code, done.out) == (2, "")
    assert message in words(done.err)
    assert "Traceback" not in done.err
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["protocol.json"]


def test_a_study_without_aged_images_takes_no_difference(run: Callable[..., Done], tmp_path: Path) -> None:
    write_protocol(tmp_path / "unaged", small_protocol(images=4, practice=0, readers=1, conditions=CONDITIONS[:1]))
    done = run("simulate", "unaged", "--seed", "1", *DIFFERENCE, "-o", "a.csv")
    assert (done.code, done.out) == (2, "")
    assert "the study in unaged has no aged condition. Leave --difference out." in words(done.err)


# Pictures and figures -------------------------------------------------------------------------------------------------


def test_the_title_of_the_picture_says_the_finding(examples: dict[str, Analysis]) -> None:
    agreement = "agreement −19.2 points (p = 0.042)"
    expected = f"chroma-luma against none: time +10.2 s (p = 0.02), ease −1.3 (p < 0.001), {agreement}"
    assert title(examples["figures"]) == expected
    assert title(examples["counts"]) == f"chroma-luma against none: {agreement}"
    assert title(examples["one condition"]) == "none alone: nothing to compare with"
    time = changes(examples["figures"], "time")
    assert time["chroma"] == pytest.approx((9.1, 0.054), abs=5e-4)
    assert "agreement −2" not in title(examples["figures"])


@pytest.mark.parametrize("conditions", [3, 4, 6])
def test_shares_of_all_are_written_inside_the_picture_and_apart(conditions: int) -> None:
    from itertools import pairwise

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    page = Figure(figsize=(15, 7.5), dpi=100)
    FigureCanvasAgg(page)
    # As wide and high as the last of three panels.
    axes = page.add_axes((0.68, 0.2, 0.258, 0.55))
    rows = [AgreementCounts(f"chroma-luma@{hours}000", 20, 0) for hours in range(10, 10 + conditions)]
    _draw_agreement(axes, analyse_figures(rows, ()))
    page.draw_without_rendering()
    shares = [text.get_window_extent() for text in axes.texts]
    names = [label.get_window_extent() for label in axes.get_xticklabels()]
    for row in (shares, names):
        assert len(row) == conditions
        assert all(left.x1 <= right.x0 for left, right in pairwise(row))
    assert max(share.y1 for share in shares) <= axes.title.get_window_extent().y0 + 3
    assert not any(share.overlaps(axes._left_title.get_window_extent()) for share in shares)  # type: ignore[attr-defined]


def test_one_answer_has_a_dash_for_its_interval(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text(answer_table(paper_like()[:1], remark="SIMULATED"))
    done = run("analyse", "--answers", "one.csv")
    assert (done.code, "nan" in done.out, "± –" in done.out) == (0, False, True)


def test_the_title_states_the_chance_of_a_difference() -> None:
    analysis = analyse_figures(read_counts(COUNTS)[1][1:], ())
    assert title(analysis) == "chroma-luma against chroma: agreement −2.5 points (p = 0.41)"


def test_answers_of_one_height_lie_side_by_side() -> None:
    import numpy as np

    assert abreast(np.array([5.0, 9.0, 9.0]), 4.0).tolist() == pytest.approx([0.0, -0.0225, 0.0225])
    assert np.ptp(abreast(np.zeros(100), 0.0)) < 0.7


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (p_value(0.0418287), "0.0418"),
        (p_value(0.05402), "0.0540"),
        (p_value(2.5506e-7), "2.6e-07"),
        (p_value(1.0), "1.00"),
        (p_value(0.0), "< 1e-300"),
        (p_value(float("nan")), "–"),
        (figure(-1.25, 1), "−1.2"),
        (figure(float("inf"), 1), "∞"),
        (figure(float("nan"), 1), "–"),
        (signed(9.1, 1), "+9.1"),
        (signed(-0.01, 1), "0.0"),
        (between((-1.0, 2.0), 1), "[−1.0, 2.0]"),
    ],
)
def test_figures_are_written_as_readers_expect(written: str, expected: str) -> None:
    assert written == expected
