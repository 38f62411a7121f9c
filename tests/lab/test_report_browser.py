"""The report in Chromium: it moves, follows, zooms, and asks nothing of the network."""

import json
import re
import time
from importlib import import_module
from math import degrees

import numpy as np
import pytest
from browser import chromium, wait
from robot_log import columns, robot_log, write

from twip.lab.report import report

pytestmark = pytest.mark.foreign
ANGLE = (
    "(() => { const {a, b} = document.querySelectorAll('.body')[%d].getCTM();"
    " return Math.atan2(b, a) * 180 / Math.PI; })()"
)
"""The angle at which the body is drawn, clockwise in degrees."""


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A browser that shows a report of one log; the log, the times it took and what was on the console and network."""
    folder = tmp_path_factory.mktemp("report")
    log = robot_log(folder / "robot.mcap", 60.0)
    path = report([log], folder / "robot.html")
    with chromium() as driver:
        driver.get(path.as_uri())
        wait(driver, "document.body.dataset.ready")
        yield driver, log, path
        errors = [entry for entry in driver.get_log("browser") if entry["level"] in ("WARNING", "SEVERE")]
        assert not errors
        messages = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
        urls = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
        assert [url for url in urls if not url.startswith(("data:", "blob:"))] == [path.as_uri()]


def script(driver, text):
    return driver.execute_script(f"return {text}")


def test_a_minute_at_a_kilohertz_is_small_and_opens_at_once(opened):
    driver, log, path = opened
    assert len(log.times) == 60_001
    assert path.stat().st_size < 10e6
    # on one free core it takes 1.3 s; ten times the promise would be a fault on any machine
    assert script(driver, "performance.getEntriesByType('navigation')[0].domComplete") < 30_000


def test_the_drawn_angle_is_the_logged_pitch(opened):
    driver, log, _ = opened
    for at in (0.2, 0.6, 1.234):
        script(driver, f"report.go({at})")
        expected = degrees(np.interp(at, log.times, log["plant.pitch"]))
        # samples are packed to 1e-6 of 20 degrees; the browser's matrices are of single precision
        assert script(driver, ANGLE % 0) == pytest.approx(expected, abs=1e-4)


def test_play_moves_robot_slider_and_cursor(opened):
    driver, log, _ = opened
    script(driver, "report.go(0.5)")
    before = script(driver, f"[{ANGLE % 0}, document.getElementById('slider').value, cursor.getBoundingClientRect().x]")
    driver.find_element("id", "play").click()
    wait(driver, "report.time > 0.7")
    driver.find_element("id", "play").click()
    stopped = script(driver, "report.time")
    after = script(driver, f"[{ANGLE % 0}, document.getElementById('slider').value, cursor.getBoundingClientRect().x]")
    assert after[0] == pytest.approx(degrees(np.interp(stopped, log.times, log["plant.pitch"])), abs=1e-4)
    assert before[0] - after[0] > 5.0
    assert float(after[1]) == pytest.approx(stopped, abs=1e-6)
    assert after[2] > before[2]
    time.sleep(0.2)
    assert script(driver, "report.time") == stopped  # paused
    script(driver, "report.go(59.9)")
    driver.find_element("id", "play").click()
    wait(driver, "document.getElementById('play').textContent == '▶'")
    assert script(driver, "report.time") == 60.0


def test_the_slider_moves_the_cursors_to_its_time(opened):
    driver, log, _ = opened
    for at in (15.0, 45.0):
        script(driver, f"(slider.value = {at}, slider.dispatchEvent(new Event('input')))")
        place = script(
            driver,
            "(() => { const box = panels.getBoundingClientRect(), line = cursor.getBoundingClientRect(),"
            " views = report.plots.panels.map(p => p.view.frame.bbox);"
            " return [line.x - box.x, line.bottom - box.bottom, views.map(v => v.left), views.map(v => v.width)]; })()",
        )
        lefts, widths = place[2:]
        assert len({round(left) for left in lefts}) == 1  # the frames begin at one place, so one line serves all
        assert place[0] == pytest.approx(lefts[0] + at / 60.0 * widths[0], abs=1.5)
        assert abs(place[1]) < 1.0
        text = script(driver, "document.querySelector('.value').textContent")
        assert float(re.match(r"[−\d.]+", text)[0].replace("−", "-")) == pytest.approx(
            degrees(np.interp(at, log.times, log["plant.pitch"])), abs=0.01
        )


def test_dragging_zooms_in_to_every_row_and_back(opened):
    driver, log, _ = opened
    chains = import_module("selenium.webdriver").ActionChains
    places = driver.find_elements("class name", "plot")
    lines = len(places)
    start = "report.plots.range.start"
    chains(driver).move_to_element_with_offset(places[1], -100, 0).click_and_hold().move_by_offset(
        60, 0
    ).move_by_offset(60, 0).release().perform()
    wait(driver, f"{start} > 0")
    ends = script(driver, "[report.plots.range.start, report.plots.range.end]")
    assert 0.0 < ends[0] < ends[1] < 60.0
    script(driver, "report.plots.zoom(0.5, 0.6)")
    wait(driver, "report.plots.panels[1].lines[0].source.data.x.length < 110")
    drawn = script(driver, "report.plots.panels.map(p => p.lines[0].source.data.x.length)")
    assert drawn == [drawn[0]] * lines
    assert drawn[0] >= 101  # each millisecond
    shown = script(driver, "[report.plots.panels[0].figure.y_range.start, report.plots.panels[0].figure.y_range.end]")
    assert 11.0 < shown[0] < degrees(log["plant.pitch"][600]) < 20.0 < shown[1] < 22.0  # fitted to what is visible
    driver.find_element("id", "reset").click()
    wait(driver, "report.plots.range.end == 60")
    assert script(driver, "document.getElementById('reset').disabled")


def test_hovering_tells_values_with_units(opened):
    driver, _, _ = opened
    chains = import_module("selenium.webdriver").ActionChains
    script(driver, "(report.plots.zoom(0, 60), report.go(0))")
    chains(driver).move_to_element_with_offset(driver.find_elements("class name", "plot")[0], 0, 0).perform()
    wait(driver, "!pointer.hidden")
    told = script(driver, "[...document.querySelectorAll('.panel')].map(p => p.querySelector('.value').textContent)")
    assert told[0].endswith("°")
    assert told[2].endswith(" m/s")
    assert told[4].endswith(" V")
    assert script(driver, "report.time") == 0  # hovering does not move the robot


def test_extremes_stay_in_the_picture(opened):
    driver, _, _ = opened
    script(driver, "report.plots.zoom(0, 60)")
    wait(driver, "report.plots.range.end == 60")
    # the tallest swing of the estimate's error is drawn although 75 rows share a pixel
    top = script(driver, "Math.max(...report.plots.panels[1].lines[0].source.data.y)")
    assert top == pytest.approx(0.2, abs=1e-5)


def test_two_logs_are_compared(tmp_path):
    one = robot_log(tmp_path / "<img src=x onerror=alert(1)>.mcap")
    two = robot_log(tmp_path / "two.mcap", plant__pitch=np.full(4001, 0.1))
    path = report([one, two], tmp_path / "both.html")
    with chromium() as driver:
        driver.get(path.as_uri())
        wait(driver, "document.body.dataset.ready")
        script(driver, "report.go(0.25)")
        assert script(driver, ANGLE % 0) == pytest.approx(20.0, abs=1e-4)
        assert script(driver, ANGLE % 1) == pytest.approx(degrees(0.1), abs=1e-4)
        apart = "[...document.querySelectorAll('.side')].map(g => g.getBoundingClientRect().x)"
        first, second = script(driver, apart)
        assert second - first > 50.0  # px: neither hides the other
        colours = script(driver, "[...document.querySelectorAll('.body rect')].map(r => r.getAttribute('stroke'))")
        assert len(set(colours)) == 2
        driver.find_element("css selector", "#apart input").click()
        places = script(driver, "[...document.querySelectorAll('.side')].map(g => g.getCTM().e)")
        assert places[0] == places[1]
        assert script(driver, ANGLE % 1) == pytest.approx(degrees(0.1), abs=1e-4)
        heads = script(driver, "[...document.querySelectorAll('thead th')].map(h => h.textContent)")
        assert heads[:3] == ["", "<img src=x onerror=alert(1)>", "two"]
        assert script(driver, "document.querySelectorAll('img').length") == 0
        driver.find_element("css selector", ".head button").click()
        wait(driver, "!report.plots.panels[0].lines[0].glyph.visible")
        assert not [e for e in driver.get_log("browser") if e["level"] in ("WARNING", "SEVERE")]


def test_a_robot_that_a_failing_run_throws_away_leaves_the_view_from_above_as_it_is(tmp_path):
    far = np.where(np.arange(1001) > 998, 1e99, 0.0)
    log = robot_log(tmp_path / "far.mcap", 1.0, plant__x=far, plant__y=-far, plant__yaw=far, plant__pitch=1e3 * far)
    with chromium() as driver:
        driver.get(report([log], tmp_path / "far.html").as_uri())
        wait(driver, "document.body.dataset.ready")
        box = [float(number) for number in script(driver, "above.getAttribute('viewBox')").split()]
        assert max(map(abs, box)) < 2000.0  # mm
        script(driver, "report.go(1)")
        assert "grid 0.1 m" in script(driver, "document.querySelector('#above + figcaption').textContent")
        assert not [e for e in driver.get_log("browser") if e["level"] in ("WARNING", "SEVERE")]


def test_a_robot_is_shown_while_its_log_lasts(tmp_path):
    times = 2.0 + np.arange(2001) / 1000.0
    moving = {"plant__pitch_rate": np.full(2001, 0.01)}
    logs = [robot_log(tmp_path / "first.mcap", 3.0), write(tmp_path / "later.mcap", columns(times, **moving), times)]
    with chromium() as driver:
        driver.get(report(logs, tmp_path / "both.html").as_uri())
        wait(driver, "document.body.dataset.ready")
        for at, shown in ((1.0, [True, False]), (2.5, [True, True]), (3.5, [False, True])):
            script(driver, f"report.go({at})")
            for part in (".body rect", ".floor line", ".top rect:first-child"):
                seen = f"[...document.querySelectorAll('{part}')].map(e => getComputedStyle(e).visibility == 'visible')"
                assert script(driver, seen)[:: len(script(driver, seen)) // 2] == shown, (at, part)
            labels = script(driver, "[...document.querySelectorAll('.pitches tspan')].map(t => t.textContent != '–')")
            assert labels == shown
        assert not [e for e in driver.get_log("browser") if e["level"] in ("WARNING", "SEVERE")]
