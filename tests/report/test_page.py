"""The page on results: its content against the results, without a browser."""

import re
import shlex
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
import tomlkit
from bokeh.models import ColumnDataSource, HoverTool, NoOverlap, Plot
from made_up_ensembles import made_up

import wearsim
from tests.report.drawn import page_of, plots_of, texts_of
from wearsim.cli.app import app
from wearsim.errors import WearsimError
from wearsim.levelling import Measured
from wearsim.report.page.plots import draw
from wearsim.report.panels import Axis, Bars, Image, Panel
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.comparison.compare import compare
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.opening import comparison_of, save_report

SHORT = {"operation.duration": "3 min", "outputs.records": 4}
SERIAL = {"scheduler": "serial"}
MEASURED = Measured("trace", np.array([-1e-3, 0.0, 1e-3]), np.array([0.0, -2e-6, 0.0]))


@pytest.fixture(scope="module")
def result():
    return wearsim.run(shipped_scenario("rig-450min", SHORT))


@pytest.fixture(scope="module")
def page_of_run(result):
    return page_of([result])


@pytest.fixture(scope="module")
def cam():
    return wearsim.run(shipped_scenario("cam-eccentric", {"operation.turns": 20_000}))


def data_of(figure: Plot, column: str) -> list[ColumnDataSource]:
    """Return the sources of a figure that have a column."""
    sources = figure.select(ColumnDataSource)
    return [source for source in sources if column in source.data]


class Links(HTMLParser):
    """Addresses in the tags of a page, without those in the text of scripts."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found += [value for name, value in attrs if name in {"src", "href"}]


def titled(plots, title):
    (found,) = [figure for name, figure in plots.items() if name.startswith(title)]
    return found


def test_slider_has_the_profile_of_every_record(result):
    plot = titled(plots_of(result, [MEASURED]), "Worn profile")
    (source,) = data_of(plot, "shown")
    for number, profile in enumerate(result.profiles):
        assert source.data[str(number)] == pytest.approx(-1e6 * profile, rel=1e-6)
    assert source.data["shown"] == pytest.approx(-1e6 * result.profiles[-1], rel=1e-6)
    (measured,) = [source for source in data_of(plot, "y") if len(source.data["y"]) == 3]
    assert measured.data["y"] == pytest.approx([0.0, -2.0, 0.0])


def test_columns_are_in_single_precision(result):
    for figure in plots_of(result).values():
        for source in figure.select(ColumnDataSource):
            arrays = [v for v in source.data.values() if isinstance(v, np.ndarray)]
            assert all(array.dtype.itemsize <= 4 for array in arrays if array.dtype.kind == "f")


def test_labels_of_axes_do_not_overlap(life):
    """The ticks of a probability plot are denser than their labels, such as 4,000,000."""
    for figure in plots_of(life).values():
        for axis in (*figure.xaxis, *figure.yaxis):
            assert isinstance(axis.major_label_policy, NoOverlap)


def test_page_states_question_answer_error_and_origin(result, page_of_run):
    page = unescape(page_of_run)
    assert "How deep does the cylinder wear in 9,000 roller passes (3.000 min)?" in page
    assert f"{1e6 * result.depth[-1]:.4g} ± " in page
    assert "The stated error is that of the steps and strips" in page
    assert "It does not contain the errors of the contact model" in page
    assert "numpy " in page
    assert "wearsim run rig-450min.toml" in page
    (saved,) = re.findall(r'href="data:text/plain;charset=utf-8,([^"]+)"', page)
    assert unquote(saved) == result.raw.scenario_text


@pytest.mark.parametrize(
    ("until", "written"), [("roller_depth=1um", "'roller depth 1um'"), ("1 min", "'1 min'")]
)
def test_command_of_a_run_has_its_limit(until, written):
    rough = {**SHORT, "wear.roller.k_over_h": "1.1e-11 1/Pa"}
    found = wearsim.run(shipped_scenario("rig-450min", rough), until=until)
    page = unescape(texts_of([found]))
    assert f"wearsim run rig-450min.toml --until {written}" in page


def test_page_loads_nothing(page_of_run):
    links = Links()
    links.feed(page_of_run)
    assert links.found
    assert all(link.startswith("data:") for link in links.found)


def test_text_of_a_scenario_cannot_alter_the_page(result):
    text = result.raw.scenario_text + "# <script>alert(1)</script>"
    raw = replace(result.raw, title="</script><b>bold</b>", scenario_text=text)
    page = page_of([replace(result, raw=raw)])
    assert "<b>bold</b>" not in page
    assert "<script>alert" not in page


def test_cam_has_a_map_and_its_lift_error(cam):
    plots = plots_of(cam)
    (image,) = data_of(titled(plots, "Worn depth"), "image")
    assert image.data["image"][0].max() == pytest.approx(1e6 * cam.final["depth_m"], rel=1e-3)
    (curve,) = data_of(titled(plots, "Lift error"), "shown")
    assert np.ptp(curve.data["shown"]) == pytest.approx(1e6 * cam.final["lift_error_m"], rel=0.02)
    assert "How deep does the cam wear in 20,000 turns" in texts_of([cam])


def first_screen(page):
    """Return the text of the first screen of a page, without marks."""
    screen = page[page.index('<div class="overview">') : page.index('<p class="excluded">')]
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", screen)).split())


def test_first_screen_of_a_cam_has_picture_loads_and_limits(cam):
    limits = {"depth": "1 nm", "lift_error": "1 m"}
    limited = replace(cam, raw=replace(cam.raw, scenario_text=with_limits(cam, limits)))
    page = page_of([limited])
    assert '<figure class="picture"><img src="data:image/png;base64,' in page
    text = first_screen(page)
    for part in ("Loads", "peak pressure, new", "drive torque", "Limits", "1000 rpm"):
        assert part in text
    assert "depth failed after about" in text
    assert "lift error passed: 0.06" in text
    assert "Not included:" in page
    assert "fatigue (pitting)" in page


def test_first_screen_of_a_comparison_has_the_limits_of_each(cam):
    text = first_screen(texts_of([cam, cam]))
    assert "Loads" not in text  # they would be those of one cam
    assert re.search(r"Limits of 1: .* Limits of 2: ", text)


def with_limits(result, limits):
    text = re.sub(r"(?ms)^\[limit\].*?(?=^\[|\Z)", "", result.raw.scenario_text)
    return text + "\n[limit]\n" + "".join(f'{key} = "{value}"\n' for key, value in limits.items())


def test_ensemble_shows_its_estimates():
    result = made_up()
    found = result.estimate("depth").mean
    page = unescape(texts_of([result]))
    assert f"{1e6 * found.value:.2f} um [{1e6 * found.low:.2f}, {1e6 * found.high:.2f}]" in page
    plots = plots_of(result)
    (bars,) = data_of(titled(plots, "Depth at the end"), "value")
    assert bars.data["more0"].sum() == result.count
    (points,) = data_of(titled(plots, "Depth against friction"), "y")
    assert points.data["y"] == pytest.approx(1e6 * result.at_end("depth"), rel=1e-6)


@pytest.mark.parametrize("options", [{"count": 1}, {"spread": 0.0}, {"count": 4, "pending": 4}])
def test_page_of_an_ensemble_without_scatter_or_tests(options):
    page = page_of([made_up(**options)])
    assert "Traceback" not in page
    assert "Repeat it" in page


def test_ensemble_of_a_thousand_tests_is_below_three_megabytes(tmp_path):
    save_report([made_up(1000)], tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < 3e6


def test_several_results_are_compared(result):
    deeper = wearsim.run(shipped_scenario("rig-450min", {**SHORT, "friction.coefficient": 0.2}))
    page = unescape(page_of([result, deeper]))
    assert "How do the depths at the end of these tests differ?" in page
    assert "deeper by" in page
    plots = plots_of(compare([result, deeper], ["mild", "severe"]))
    sources = data_of(plots["Value and estimated error"], "x")
    values = sorted(float(value) for source in sources for value in source.data["x"])
    assert values == pytest.approx([1e6 * run.depth[-1] for run in (result, deeper)])
    assert len(data_of(plots["Worn profiles"], "y")) == 2


def test_one_contact_is_not_compared_with_tests(result):
    study = wearsim.dissipation(shipped_scenario("paper-monte-carlo"), 40)
    assert "mean dissipated power" in texts_of([study])
    with pytest.raises(WearsimError, match="only runs and ensembles can be compared"):
        comparison_of([result, study], ["run", "contact"])
    # a page has them one after the other
    both = unescape(texts_of([result, study]))
    assert "How deep does the cylinder wear" in both
    assert "mean dissipated power" in both
    assert "at the end of these tests" not in both


@pytest.fixture(scope="module")
def life(tmp_path_factory):
    folder = tmp_path_factory.mktemp("life")
    scenario = shipped_scenario("rig-life", {"contact.strips": 61})
    return wearsim.life(
        scenario, 24, folder / "life.h5", limits=["depth 5 um"], target=20_000, **SERIAL
    )


def test_life_shows_its_quantiles_and_survival(life):
    written = page_of([life])
    page = unescape(written)
    assert "How many passes does the design last, until the first of: depth 5.000 um?" in page
    found = life.b(10)
    low, value, high = (f"{round(life, -2):,.0f}" for life in (found.low, found.value, found.high))
    assert f"{value} passes [{low}..{high}]" in page
    assert "what moves the life: Sobol indices of its logarithm" in page
    assert "P(life < 20,000 passes)" in page
    text = first_screen(written)
    digits = [f"{float(f'{end:.3g}'):,.0f}" for end in (found.value, found.low, found.high)]
    assert "{} passes, 95 %: {} to {}".format(*digits) in text
    assert "What moves the life" in text
    assert re.search(r"% of the scatter; life \+\d+ %, -\d+ %", text)
    plots = plots_of(life)
    (curve,) = data_of(titled(plots, "Survival"), "y")
    places = np.searchsorted(-curve.data["y"], -90.0)
    assert curve.data["x"][places] == pytest.approx(found.value, rel=0.05)
    (points,) = data_of(titled(plots, "Life against"), "y")
    assert points.data["y"] == pytest.approx(life.lives, rel=1e-6)


def test_command_of_a_life_has_its_options(life, tmp_path):
    options = repeated(texts_of([life.with_settings(target=1_234_567.0)]), tmp_path)
    assert options[:2] == ["life", "rig-life.toml"]
    given = dict(zip(options[2::2], options[3::2], strict=True))
    assert (given["-n"], given["--b"], given["--target"]) == ("24", "1,10,50", "1234567")
    assert float(given["--max"]) == life.most


def test_command_of_an_ensemble_has_its_precision(tmp_path):
    options = repeated(texts_of([made_up(until="depth.mean 1%")]), tmp_path)
    assert options[-2:] == ["--precision", "depth.mean 1%"]


def test_two_lives_are_compared(life, tmp_path):
    scenario = shipped_scenario("rig-life", {"contact.strips": 61, "friction.coefficient": 0.15})
    other = wearsim.life(scenario, 24, tmp_path / "rough.h5", limits=["depth 5 um"], **SERIAL)
    page = unescape(page_of([life, other]))
    assert "Which design lasts more passes?" in page
    assert f"{life.compare(other).b10_ratio.value:.2f}"[:3] in page
    assert " outlives " in page


def test_identification_shows_its_verdict_and_traces(tmp_path):
    scenario = shipped_scenario("rig-450min")
    truth = wearsim.run(scenario)
    y = np.arange(-10e-3, 10e-3, 100e-6)
    noise = 1e-6 * np.random.default_rng(2).standard_normal(len(y))
    height = noise - np.interp(y, truth.y, truth.profiles[-1])
    rows = [f"{1e3 * place:.4f},{1e6 * value:.4f}" for place, value in zip(y, height, strict=True)]
    (tmp_path / "t1.csv").write_text("\n".join(["y [mm],height [um]", *rows]))
    found = wearsim.identify(shipped_scenario("rig-identify"), [tmp_path / "t1.csv"], draws=16)
    page = unescape(page_of([found]))
    assert "is K/H random?" in page
    k = found.tests[0]["k_over_h_per_Pa"]["value"]
    assert f"K/H {1e12 * k:.3g}" in page
    deepest = [source.data["y"].min() for source in data_of(titled(plots_of(found), "t1.csv"), "y")]
    assert pytest.approx(-1e6 * truth.depth[-1], rel=0.05) in deepest


def repeated(page: str, folder: Path) -> list[str]:
    """Save the files of a page in a folder, and return its command."""
    pattern = r'download="([^"]+)" href="data:text/plain;charset=utf-8,([^"]+)"'
    for name, text in re.findall(pattern, page):
        (folder / unescape(name)).write_text(unquote(text))
    (command,) = re.findall(r"<code>(wearsim .*)</code>", page)
    return shlex.split(unescape(command))[1:]


def test_identification_is_repeated_from_its_page(tmp_path, monkeypatch):
    depth = {"depth": "5 um", "depth_std": "0.5 um", "at": "2 min", "group": "one"}
    (tmp_path / "tables").mkdir()
    y = np.arange(-10e-3, 10e-3, 100e-6)
    noise = 0.05e-6 * np.random.default_rng(2).standard_normal(len(y))
    short = shipped_scenario("rig-identify", {"operation.duration": "20 min"})
    truth = wearsim.run(shipped_scenario("rig-450min", {"operation.duration": "20 min"}))
    down = noise + np.interp(y, truth.y, truth.profiles[-1])
    rows = [f"{1e3 * a:.4f},0,{1e6 * b:.4f}" for a, b in zip(y, down, strict=True)]
    (tmp_path / "tables" / "t1.csv").write_text("\n".join(["place,z,Tiefe", *rows]))
    profile = {"profile": "tables/t1.csv", "columns": ["place", "-Tiefe"], "units": ["mm", "um"]}
    known = {"set": {"load": "310 N", "friction": 0.11}, "std": {"load": "5 N"}}
    tests = {"test": [depth, {**profile, **known, "shoulders": "8 mm"}]}
    (tmp_path / "tests.toml").write_text(tomlkit.dumps(tests))
    found = wearsim.identify(short, tmp_path / "tests.toml", draws=16, negligible=0.3)
    page = texts_of([found])
    assert "these files are needed too, beside rig-identify-tests.toml: t1.csv." in page
    folder = tmp_path / "again"
    folder.mkdir()
    command = repeated(page, folder)
    (tmp_path / "tables" / "t1.csv").rename(folder / "t1.csv")
    monkeypatch.chdir(folder)
    app([*command, "-o", "again.h5", "-q"], standalone_mode=False)
    again = wearsim.open_results("again.h5")
    assert again.summary == found.summary
    for name in ("depth_m", "k_over_h_per_Pa", "passes"):
        assert [test[name] for test in again.tests] == [test[name] for test in found.tests]


def test_page_of_an_identification_without_its_measurements_claims_no_repetition():
    depths = [Measurement("a.csv", depth=48e-6, depth_std=1e-6)]
    found = wearsim.identify(shipped_scenario("rig-identify"), depths, draws=16)
    page = unescape(texts_of([replace(found, raw=replace(found.raw, measured=[]))]))
    assert "add the options of the study" in page
    assert "gives the same numbers" not in page


@pytest.mark.parametrize(("unit", "ending"), [("1", ""), ("mm", " mm")])
def test_values_under_the_pointer_have_their_unit_and_plain_numbers_none(unit, ending):
    axis, ends = Axis("power $P_d$", unit), np.arange(2.0)
    marks = [Bars(ends[:1], ends[1:], ends[1:]), Image(ends, ends, np.ones((2, 2)), axis)]
    tools = draw(Panel("numbers", axis, axis, marks)).select(HoverTool)
    values = ["@value{%.5g}", "@low{%.5g} to @high{%.5g}", "@image{%.5g}", "$x{0.00}", "$y{0.00}"]
    shown = [text for tool in tools for _, text in tool.tooltips]
    assert sorted(shown) == sorted(f"{value}{ending}" for value in values)
    assert {name for tool in tools for name, _ in tool.tooltips} == {"power P"}
