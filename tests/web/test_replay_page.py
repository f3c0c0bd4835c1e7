"""The page of a replay in a browser: it draws, plays, seeks, compares, and asks no network."""

import io
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from browser import Tab, until
from web.assembled import page
from web.made_scene import ORIGIN, POSTING, Run, run, source

FIRST, SECOND = run(seconds=20.0), run(seconds=16.0, aside=0.5, slip=0.25)
LEFT, RIGHT = 52, 10  # margins of a plot [px], as in figure.js


@pytest.fixture
def shown(tab: Tab, tmp_path: Path):
    """Open a page that replays the runs."""

    def show(*runs: Run, title: str = "Small rover", **how) -> Tab:
        path = tmp_path / "replay.html"
        path.write_text(page(source(*runs, **how), title))
        tab.page.goto(path.as_uri())
        tab.page.evaluate("rille.ready")
        return tab

    yield show
    assert tab.complaints == []
    assert tab.schemes <= {"file", "data", "blob"}


def picture(tab: Tab) -> np.ndarray:
    """What the 3-D view shows (rows, columns, 3)."""
    return np.asarray(Image.open(io.BytesIO(tab.page.locator("#view > canvas").screenshot())).convert("RGB")).astype(int)


def settled(tab: Tab) -> None:
    """Wait for the next two pictures."""
    tab.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def pose_of(which: Run, body: int, time: float) -> np.ndarray:
    """From the track, in W: positions interpolated, orientation of the frame before (they are close)."""
    k = int(np.searchsorted(which.time, time, side="right")) - 1
    low, high = which.states[k, 7 * body : 7 * body + 7], which.states[min(k + 1, len(which.time) - 1), 7 * body : 7 * body + 7]
    share = (time - which.time[k]) / (which.time[min(k + 1, len(which.time) - 1)] - which.time[k] or 1.0)
    return np.concatenate([low[:3] + share * (high[:3] - low[:3]) + np.array(ORIGIN), low[3:]])


def test_it_draws_and_is_silent(shown):
    tab = shown(FIRST)
    seen = picture(tab)
    differs = np.abs(seen - np.array([4, 6, 10])).sum(axis=2) > 30
    assert differs.mean() > 0.4  # ground and rover fill the lower part
    assert len(np.unique(seen[::7, ::7].reshape(-1, 3), axis=0)) > 200  # and are no plain areas
    assert tab.page.locator("#title").inner_text() == "Small rover, crater field"
    assert tab.page.locator(".figure").count() == 3
    assert tab.page.evaluate("rille.frames()") >= 1
    assert not tab.page.evaluate("document.documentElement.scrollWidth > innerWidth"), "the page is wider than the window"


def test_time_goes_on_while_it_plays_and_stops_at_the_end(shown):
    tab = shown(FIRST)
    before = tab.page.evaluate("rille.pose('chassis')")
    tab.page.keyboard.press(" ")
    until(lambda: tab.page.evaluate("rille.time() > 0.5"), "time going on")
    tab.page.keyboard.press(" ")
    settled(tab)
    at = tab.page.evaluate("rille.time()")
    settled(tab)
    assert tab.page.evaluate("rille.time()") == at
    assert np.hypot(*np.subtract(tab.page.evaluate("rille.pose('chassis')"), before)[:2]) > 0.02
    tab.page.select_option("#speed", "20")
    tab.page.click("#play")
    until(lambda: tab.page.evaluate("rille.time() === 20"), "the end")
    assert tab.page.get_attribute("#play", "aria-pressed") == "false"


@pytest.mark.parametrize("time", [0.0, 7.31, 20.0])
def test_scrubbing_shows_the_tracks_pose(shown, time: float):
    tab = shown(FIRST)
    tab.page.evaluate(f"rille.seek({time})")
    for body, name in enumerate(["chassis", "wheel_front_left"]):
        found = np.array(tab.page.evaluate(f"rille.pose({name!r})"))
        np.testing.assert_allclose(found[:3], pose_of(FIRST, body, time)[:3], atol=2e-5)  # float32 metres
        assert abs(found[3:] @ pose_of(FIRST, body, time)[3:]) > 0.999


def test_the_bar_and_its_keys_set_the_time(shown):
    tab = shown(FIRST)
    box = tab.page.locator("#bar").bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 17)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 17, steps=3)
    tab.page.mouse.up()
    assert tab.page.evaluate("rille.time()") == pytest.approx(15.0, abs=0.05)
    tab.page.keyboard.press("Home")
    tab.page.keyboard.press("ArrowRight")
    assert tab.page.evaluate("rille.time()") == pytest.approx(FIRST.time[1])
    tab.page.keyboard.press("ArrowLeft")
    assert tab.page.evaluate("rille.time()") == 0.0
    tab.page.keyboard.press("End")
    assert tab.page.evaluate("rille.time()") == 20.0
    tab.page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 17)
    assert "torque limit of 20 N m" in tab.page.locator("#bar-tip").inner_text()


def test_a_click_in_a_plot_seeks(shown):
    tab = shown(FIRST)
    plot = tab.page.locator(".plot").first
    box = plot.bounding_box()
    assert box is not None
    plot.click(position={"x": LEFT + 0.5 * (box["width"] - LEFT - RIGHT), "y": 50})
    assert tab.page.evaluate("rille.time()") == pytest.approx(10.0, abs=0.1)
    settled(tab)
    value = tab.page.locator(".figure").first.locator(".value").first.inner_text()
    column = FIRST.states.shape[1] - 4 * 11 + 4  # slip ratio of the first wheel
    assert float(value.replace("\N{MINUS SIGN}", "-")) == pytest.approx(FIRST.states[250, column], abs=0.02)


def test_any_channel_can_be_found_and_plotted(shown):
    tab = shown(FIRST)
    for words, title in [("rear left drawbar", "wheel rear left · drawbar pull"), ("imu", "imu roll rate"), ("yaw", "chassis · yaw")]:
        tab.page.fill("#pane-plots input", words)
        tab.page.keyboard.press("Enter")
        assert tab.page.locator(".figure figcaption b").last.inner_text() == title
    assert tab.page.locator(".figure").count() == 6
    tab.page.locator(".figure figcaption button").last.click()
    assert tab.page.locator(".figure").count() == 5


def test_wheels_press_ruts_and_looking_back_restores_them(shown):
    """The depth of a rut is the greatest sinkage that passed there; before that, the ground is untouched."""
    tab = shown(FIRST)
    deepest = "Math.max(...rille.shown.viewer.worlds[0].ground.depth)"
    pressed = "rille.shown.viewer.worlds[0].ground.touched.size"
    tab.page.evaluate("rille.seek(20)")
    settled(tab)
    sinkage = FIRST.states[:, -44 + 6 :: 11]
    assert tab.page.evaluate(deepest) == pytest.approx(sinkage.max(), rel=0.15)  # the grid's points are seldom under the middle
    many = tab.page.evaluate(pressed)
    way = 4 * 20 * 0.12  # [m] of ruts, at most
    assert 0.25 * way * 0.14 < many * POSTING**2 < 6 * way * 0.14
    tab.page.evaluate("rille.seek(0)")
    settled(tab)
    assert 0 < tab.page.evaluate(pressed) < 0.2 * many
    tab.page.keyboard.press("r")
    settled(tab)
    assert tab.page.evaluate(pressed) == 0


def test_cameras_and_layers_change_the_picture(shown):
    tab = shown(FIRST)
    tab.page.evaluate("rille.seek(10)")
    settled(tab)
    pictures = [picture(tab)]
    for key in ("2", "c", "t"):
        tab.page.keyboard.press(key)
        settled(tab)
        pictures.append(picture(tab))
    for before, after in pairwise(pictures):
        assert (np.abs(before - after).sum(axis=2) > 20).mean() > 0.002
    assert tab.page.locator("#cameras [aria-pressed=true]").inner_text() == "Chase"


def test_keys_are_told(shown):
    tab = shown(FIRST)
    tab.page.keyboard.press("?")
    assert tab.page.locator("#help").is_visible()
    tab.page.keyboard.press("Escape")
    assert not tab.page.locator("#help").is_visible()


def test_two_runs_as_ghost_and_side_by_side(shown):
    tab = shown(FIRST, SECOND, mode="ghost", labels=("as built", "recording"))
    tab.page.evaluate("rille.seek(12)")
    settled(tab)
    assert tab.page.locator(".label.run").all_inner_texts() == ["as built", "recording"]
    ghost = picture(tab)
    orange = (ghost[..., 0] - ghost[..., 2] > 60).mean()
    assert orange > 0.005
    assert tab.page.evaluate("rille.shown.viewer.worlds.length") == 2
    tab.page.click("#modes [data-mode=side]")
    settled(tab)
    side = picture(tab)
    half = side.shape[1] // 2
    for part in (side[:, :half], side[:, half:]):
        assert (np.abs(part - np.array([4, 6, 10])).sum(axis=2) > 30).mean() > 0.4
    assert (np.abs(side[:, : half - 2] - side[:, half + 2 : 2 * half]).sum(axis=2) > 30).mean() > 0.02
    tab.page.click("#modes [data-mode=single]")
    settled(tab)
    assert tab.page.evaluate("rille.shown.viewer.worlds.length") == 1
    assert "|" in tab.page.locator(".figure .value").first.inner_text()


def test_what_is_no_longer_compared_leaves_the_graphics_card(shown):
    tab = shown(FIRST, SECOND, mode="ghost", labels=("as built", "recording"))
    held = "(info => [info.memory.geometries, info.programs.length])(rille.shown.viewer.stage.renderer.info)"
    settled(tab)
    before = tab.page.evaluate(held)
    for _ in range(3):
        for mode in ("single", "ghost"):
            tab.page.click(f"#modes [data-mode={mode}]")
            settled(tab)
    after = tab.page.evaluate(held)
    assert after[0] <= 1.1 * before[0]  # what is just out of sight is not uploaded
    assert after[1] <= before[1]
    assert (np.abs(picture(tab) - np.array([4, 6, 10])).sum(axis=2) > 30).mean() > 0.4  # and what both share is drawn


def test_hostile_names_stay_texts(shown):
    evil = "<img src=x onerror=\"document.title='broken'\"></script><b>"
    with_event = Run(FIRST.time, FIRST.states, [{"time": 3.0, "kind": evil, "subject": evil, "message": evil}])
    tab = shown(with_event, title=evil, labels=(evil,), chassis=evil)
    for name in ("numbers", "events", "plots"):
        tab.page.click(f"#tab-{name}")
        settled(tab)
    tab.page.fill("#pane-plots input", "img position")
    tab.page.keyboard.press("Enter")
    settled(tab)
    tab.page.click("#tab-events")
    assert evil in tab.page.locator(".events").inner_text()
    assert tab.page.locator("img").count() == 0
    assert tab.page.title() != "broken"
    assert np.isfinite(tab.page.evaluate("name => rille.pose(name)", evil)).all()


def test_what_is_not_known_is_a_gap(shown):
    """Unknown numbers are NaN: lines break, bodies keep their place by the root; where that is unknown nothing is drawn."""
    states = FIRST.states.copy()
    states[:, 7 : 7 * 5] = np.nan  # wheels' poses
    states[200:300] = np.nan
    tab = shown(Run(FIRST.time, states, []))
    tab.page.evaluate("rille.seek(4)")
    settled(tab)
    chassis, wheel = (np.array(tab.page.evaluate(f"rille.pose({name!r})")) for name in ("chassis", "wheel_front_left"))
    assert np.linalg.norm(chassis[:3] - wheel[:3]) == pytest.approx(np.linalg.norm([0.36, 0.32, 0.25]), abs=1e-3)  # as in the glb
    tab.page.evaluate("rille.seek(10)")
    settled(tab)
    assert not tab.page.evaluate("rille.shown.viewer.worlds[0].known")


def test_a_page_whose_data_do_not_fit_says_so(tab: Tab, tmp_path: Path):
    broken = source(FIRST)
    broken["layout"]["wheels"].pop()
    (tmp_path / "broken.html").write_text(page(broken))
    tab.page.goto((tmp_path / "broken.html").as_uri())
    tab.page.wait_for_selector("#banner.bad")
    assert "do not belong together" in tab.page.locator("#banner").inner_text()


def test_a_narrow_window_keeps_everything_in_sight(shown):
    tab = shown(FIRST, SECOND, mode="ghost")
    tab.page.set_viewport_size({"width": 900, "height": 640})
    settled(tab)
    assert not tab.page.evaluate("document.documentElement.scrollWidth > innerWidth")
    for name in ("#play", "#bar", "#clock", "#help-button", "#modes", "#cameras", "#layers", "#tab-events"):
        box = tab.page.locator(name).bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 901, name
        assert box["y"] + box["height"] <= 641, name
