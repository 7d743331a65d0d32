"""Tables [cam] and [follower], and what goes with them only."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ScenarioError
from wearsim.scenario import Scenario
from wearsim.studies.cam.turn import turn_of

SCENARIOS = Path(__file__).parents[2] / "scenarios"
CYCLOIDAL = (SCENARIOS / "cam-cycloidal.toml").read_text()
SWINGING = (SCENARIOS / "cam-swinging.toml").read_text()


def read(text: str, folder: Path | str = ".") -> Scenario:
    return Scenario.from_toml(text, folder=folder, name="cam.toml")


def changed(*pairs: tuple[str, str], text: str = CYCLOIDAL) -> str:
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


RISE = '{law = "cycloidal", angle = "90 deg", rise = "8 mm"}'
MISTAKES = [
    (
        [("[cam]", "[cylinder]\nradius = '25 mm'\nmaterial = 'steel'\n[cam]")],
        "a test has either",
    ),
    (
        [('[follower]\nkind = "translating"\nmass = "0.5 kg"', "")],
        "the table is missing",
    ),
    (
        [('rise = "8 mm"', 'rise = "9 mm"')],
        "its start, got 1 mm after segment 4",
    ),
    ([('rise = "8 mm"', 'rise = "8 N"')], r"\[cam.motion \(entry 2\)\] rise: wrong dimension"),
    ([('angle = "90 deg", rise = "8 mm"', 'angle = "80 deg", rise = "8 mm"')], "got 350 deg"),
    ([('law = "cycloidal"', 'law = "cycloid"')], "did you mean 'cycloidal'"),
    ([(', rise = "8 mm"', "")], r"rise: is needed with law = \"cycloidal\""),
    ([('law = "dwell",', 'law = "dwell", rise = "1 mm",')], "rise: has no meaning with law"),
    (
        [(RISE, '{law = "polynomial", angle = "90 deg", rise = "8 mm", start = ["9 mm/rad"]}')],
        r"jumps before segment 2 \(polynomial\), got from 0 mm to 9 mm per rad",
    ),
    (
        [("motion = [", 'shape = "tangent"\nmotion = [')],
        "exactly one of motion, lift",
    ),
    (
        [("motion = [", 'nose_radius = "8 mm"\nmotion = [')],
        "nose_radius: has no meaning",
    ),
    ([('mass = "0.5 kg"', 'inertia = "1 kg m^2"')], "inertia: has no meaning with kind"),
    ([('mass = "0.5 kg"', 'contact = "groove"')], "clearance: is needed with contact"),
    (
        [('mass = "0.5 kg"', 'offset = "50 mm"')],
        "offset of 50 mm does not reach",
    ),
    *(
        ([("motion = [", f"stations = {value}\nmotion = [")], "stations: is neither 'auto' nor")
        for value in (0, 100_000, 2.5, '"few"')
    ),
    ([('"300 N"', '"24 N m"')], r"\[load\] preload: wrong dimension"),
    ([("turns = 1_350_000", 'turns = 10\nduration = "1 min"')], "duration or passes or turns"),
]


@pytest.mark.parametrize(("pairs", "words"), MISTAKES)
def test_mistakes_of_a_cam_are_named(pairs, words):
    with pytest.raises(ScenarioError, match=words):
        read(changed(*pairs))


def test_keys_of_a_cam_have_no_meaning_for_a_cylinder():
    text = changed(('[follower]\nkind = "translating"\nmass = "0.5 kg"', ""))
    start, stop = text.index("[cam]"), text.index("[roller]")
    text = text[:start] + "[cylinder]\nradius = '25 mm'\nmaterial = 'steel'\n" + text[stop:]
    with pytest.raises(ScenarioError) as caught:
        read(text)
    message = str(caught.value)
    for part in (
        "[operation] turns: has no meaning without [cam]",
        "[roller] inertia: has no meaning without [cam]",
        "[load] kind: needs the follower of a cam",
    ):
        assert part in message


def test_arm_that_does_not_reach_the_cam_is_refused():
    text = changed(('arm_length = "80 mm"', 'arm_length = "30 mm"'), text=SWINGING)
    with pytest.raises(ScenarioError, match="does not reach the pitch circle"):
        read(text)


def test_load_of_an_arm_is_a_torque():
    scenario = read(SWINGING)
    assert scenario.load.kind == "follower-arm"
    assert scenario.load.options.preload == 24.0
    assert scenario.changed({"load.preload": "30 N m"}).load.options.preload == 30.0


def test_turns_count_passes_of_every_roller():
    scenario = read(changed(("turns = 1_350_000", "turns = 1000\nrollers = 3")))
    assert scenario.total_passes == 3000
    assert scenario.changed({"operation.duration": "1 min"}).total_passes == 3000


def with_file(way: str) -> str:
    start, stop = CYCLOIDAL.index("motion = ["), CYCLOIDAL.index("[follower]")
    return CYCLOIDAL[:start] + f'{way} = "points.csv"\n' + CYCLOIDAL[stop:]


def points(columns: str, rows: np.ndarray) -> str:
    return "\n".join([columns, *(", ".join(map(repr, row)) for row in rows.tolist())])


def test_lift_from_a_table_is_that_of_the_law(tmp_path):
    law = read(CYCLOIDAL).cam.motion
    degrees = np.arange(0.0, 360.0, 0.5)
    rows = np.stack([degrees, 1e3 * law.lift(np.radians(degrees))[0]], axis=1)
    (tmp_path / "points.csv").write_text(points("angle [deg], lift [mm]", rows))
    found = read(with_file("lift"), tmp_path).cam.motion
    theta = np.linspace(0.0, math.tau, 1001)
    assert found.lift(theta)[:2] == pytest.approx(law.lift(theta)[:2], abs=1e-7)


def test_corner_of_a_lift_table_is_refused(tmp_path):
    degrees = np.arange(0.0, 360.0, 2.0)
    rows = np.stack([degrees, 5.0 - np.abs(degrees - 180.0) / 36.0], axis=1)
    (tmp_path / "points.csv").write_text(points("angle [deg], lift [mm]", rows))
    with pytest.raises(ScenarioError, match="slope of the lift jumps, got a corner at 180 deg"):
        read(with_file("lift"), tmp_path)


@pytest.mark.parametrize("columns", ["angle [deg], radius [mm]", "x [mm], y [mm]"])
@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_surface_of_an_eccentric_circle_gives_its_motion(tmp_path, columns, offset):
    theta = np.linspace(0.0, math.tau, 361)[:-1]
    x, y = 5.0 + 25.0 * np.cos(theta), 25.0 * np.sin(theta)
    rows = np.stack([x, y], axis=1)
    if "radius" in columns:
        rows = np.stack([np.degrees(np.arctan2(y, x)) % 360.0, np.hypot(x, y)], axis=1)
        rows = rows[np.argsort(rows[:, 0])]
    (tmp_path / "points.csv").write_text(points(columns, rows))
    more = f'mass = "0.5 kg"\noffset = "{offset} mm"'
    base = ('base_radius = "25 mm"', 'base_radius = "20 mm"'), ('mass = "0.5 kg"', more)
    circle = changed(*base, text=with_file("profile"))
    shape = circle.replace('profile = "points.csv"', 'shape = "eccentric"\neccentricity = "5 mm"')
    found, exact = read(circle, tmp_path).cam.motion, read(shape).cam.motion
    theta = np.linspace(0.0, math.tau, 500)
    assert found.lift(theta)[0] == pytest.approx(exact.lift(theta)[0], abs=1e-9)
    assert found.lift(theta)[2] == pytest.approx(exact.lift(theta)[2], abs=2e-6)


def test_concave_arc_tighter_than_the_roller_is_refused(tmp_path):
    theta = np.linspace(0.0, math.tau, 721)[:-1]
    radius = 30.0 - 6.0 * np.exp(-(((theta - 3.0) / 0.25) ** 2))
    rows = np.stack([np.degrees(theta), radius], axis=1)
    (tmp_path / "points.csv").write_text(points("angle [deg], radius [mm]", rows))
    with pytest.raises(ScenarioError, match=r"a concave arc is tighter than the roller: .* at 17"):
        read(with_file("profile"), tmp_path)


def test_mistake_of_a_cam_is_reported_alone():
    bearing = 'bearing_friction = 0.002\nbearing_diameter = "12 mm"\nyaw'
    text = changed(('base_radius = "25 mm"', 'base_radius = "-25 mm"'), ("yaw", bearing))
    with pytest.raises(ScenarioError) as raised:
        read(text)
    assert len(raised.value.mistakes) == 1
    assert "base_radius" in str(raised.value)


def test_number_of_turns_may_be_written_with_an_exponent():
    assert read(changed(("turns = 1_350_000", "turns = 20e6"))).total_passes == 20_000_000
    assert read(changed(("turns = 1_350_000", "passes = 2.5e3"))).total_passes == 2500
    with pytest.raises(ScenarioError, match=r"turns: is not a whole number, got 2.5"):
        read(changed(("turns = 1_350_000", "turns = 2.5")))


def test_cam_that_reaches_the_pivot_of_its_arm_is_refused():
    def swinging(base: str) -> Scenario:
        return read(changed(('base_radius = "20 mm"', f'base_radius = "{base}"'), text=SWINGING))

    # the greatest radius is that of the base circle and twice the eccentricity of 5 mm
    assert turn_of(swinging("79.9 mm")).stations.count > 1
    for base in ("80.1 mm", "95 mm"):
        with pytest.raises(ScenarioError, match=r"base_radius: the cam reaches the pivot of the"):
            turn_of(swinging(base))


def test_scatter_of_the_wear_factor_counts_once():
    scatter = '{distribution = "lognormal", median = 1, factor = 1.3}'
    k = '{distribution = "lognormal", median = "1.1e-11 1/Pa", factor = 1.5}'
    old = 'cylinder = { k_over_h = "1.1e-11 1/Pa" }   # of the cam'
    both = changed((old, f"factor = {scatter}\ncylinder = {{ k_over_h = {k} }}"))
    with pytest.raises(ScenarioError) as caught:
        read(both)
    (mistake,) = caught.value.mistakes
    assert "wear.cylinder.k_over_h: the scatter of K/H counts twice" in str(mistake)
    assert "delete factor under [wear]" in str(mistake)
    for lines in (f"factor = {scatter}\n{old}", f"cylinder = {{ k_over_h = {k} }}"):
        assert len(read(changed((old, lines))).random) == 1
