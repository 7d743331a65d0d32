"""Scenarios and results as notebooks show them."""

import base64
import re

import pytest
from made_up_ensembles import made_up

import wearsim
from wearsim.report.text import with_interval
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.life.view import life_text

SHORT = {"operation.duration": "3 min", "outputs.records": 4}


def rows(html):
    found = re.findall(r"<tr><th[^>]*>(.*?)</th><td[^>]*>(.*?)</td></tr>", html)
    return dict(found)


def images(html):
    found = re.findall(r'<img alt="([^"]+)" src="data:image/png;base64,([^"]+)">', html)
    assert all(base64.b64decode(data).startswith(b"\x89PNG") for _, data in found)
    return len(found)


def test_run_shows_its_end_and_error():
    result = wearsim.run(shipped_scenario("rig-450min", SHORT))
    html = result._repr_html_()
    assert rows(html)["depth"].startswith(f"{1e6 * result.depth[-1]:.4g} ± ")
    assert "estimated error of depth" in rows(html)
    assert "finished: 9,000 passes" in rows(html)["test"]
    assert images(html) == 1
    assert len(html) < 100_000


def test_ensemble_shows_its_intervals():
    result = made_up()
    html = result._repr_html_()
    mean = with_interval(result.estimate("depth").mean, "um")
    assert rows(html)["mean depth"] == mean
    assert images(html) == 1


def test_ensemble_without_tests_has_no_figure():
    html = made_up(count=4, pending=4)._repr_html_()
    assert rows(html)["depth"] == "no test is completed"
    assert images(html) == 0


def test_study_of_one_contact_shows_its_power():
    study = wearsim.dissipation(shipped_scenario("paper-monte-carlo"), 40)
    html = study._repr_html_()
    mean, error = rows(html)["mean dissipated power"].removesuffix(" W").split(" ± ")
    assert float(mean) == pytest.approx(study.power.mean(), abs=0.5 * float(error))
    assert images(html) == 1


def test_life_shows_its_shares(tmp_path):
    factor = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    scenario = shipped_scenario("rig-450min", {"wear.cylinder.k_over_h": factor})
    lives = wearsim.life(
        scenario, 1, tmp_path / "life.h5", limits=["depth 5 um"], scheduler="serial"
    )
    html = lives._repr_html_()
    assert rows(html)["B10"] == life_text(lives, 10.0)
    assert images(html) == 1


@pytest.mark.parametrize("name", ["rig-450min", "rig-ensemble", "cam-cycloidal"])
def test_scenario_shows_its_keys_as_written(name):
    scenario = shipped_scenario(name)
    html = scenario._repr_html_()
    assert rows(html)["roller.radius"] == "20 mm"
    assert images(html) == (0 if scenario.cam else 1)
    for item in scenario.random:
        assert all(rows(html)[key].startswith(item.kind) for key in item.keys)


def test_titles_are_text():
    scenario = shipped_scenario("rig-450min", {"title": "<b>rig</b>"})
    assert "&lt;b&gt;rig&lt;/b&gt;" in scenario._repr_html_()
