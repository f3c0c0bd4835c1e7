"""The page of a live session, in a browser, against a server that speaks the protocol: watching, commanding, driving, placing."""

from collections.abc import Iterator

import numpy as np
import pytest

from browser import Tab, until
from web.fake_server import Fake, served
from web.made_scene import layout


@pytest.fixture
def fake() -> Fake:
    return Fake()


@pytest.fixture
def live(fake: Fake, tab: Tab) -> Iterator[Tab]:
    """The page, once it shows the first state."""
    with served(fake) as address:
        tab.page.goto(address)
        tab.page.evaluate("rille.ready")
        yield tab
    assert all(asked.startswith((address, address.replace("http", "ws"), "blob:", "data:")) for asked in tab.asked)


def commanding(fake: Fake, live: Tab) -> None:
    live.page.click("#take")
    until(lambda: fake.commander and live.page.locator("#who").inner_text() == "you command", "that we command")


def toasts(live: Tab) -> str:
    return " ".join(live.page.locator("#toasts").all_inner_texts())


def test_it_follows_the_session_and_shows_its_status(fake: Fake, live: Tab):
    assert live.page.locator("#state").inner_text().lower() == "ready"
    assert live.page.locator("#who").inner_text() == "nobody commands"
    assert live.page.locator("#do-go").is_disabled()
    commanding(fake, live)
    live.page.click("#do-go")
    until(lambda: live.page.evaluate("rille.time()") > 0.5, "time going on")
    assert live.page.locator("#state").inner_text().lower() == "running"
    drawn = live.page.evaluate("rille.frames()")
    until(lambda: live.page.evaluate("rille.frames()") > drawn, "new pictures")
    live.page.keyboard.press(" ")
    until(lambda: live.page.locator("#state").inner_text().lower() == "paused", "the pause")
    at = live.page.evaluate("rille.time()")
    live.page.evaluate("rille.seek(0.2)")  # looking back, while the session stays where it is
    assert live.page.evaluate("rille.time()") == pytest.approx(0.2)
    live.page.click("#play")
    assert live.page.evaluate("rille.time()") == pytest.approx(at, abs=0.05)
    live.page.click("#do-reset")
    until(lambda: live.page.evaluate("rille.time()") == 0.0, "the start")
    assert live.complaints == []


def test_keys_drive_and_letting_go_stops(fake: Fake, live: Tab):
    commanding(fake, live)
    live.page.keyboard.press(" ")
    before = np.array(live.page.evaluate("rille.pose('chassis')"))
    live.page.keyboard.down("w")
    live.page.keyboard.down("ArrowLeft")
    until(lambda: len(fake.of("steer")) >= 3, "commands while keys are held")
    live.page.keyboard.up("ArrowLeft")
    live.page.wait_for_timeout(1000)
    live.page.keyboard.up("w")
    until(lambda: fake.of("steer")[-1]["forward"] == 0 and fake.of("steer")[-1]["turn"] == 0, "the stop")
    sent = fake.of("steer")
    assert all(0 <= one["forward"] <= 2.0 * 0.15 for one in sent)  # what the drives can
    assert any(one["turn"] > 0 for one in sent)
    assert len(sent) < 40  # the rate is limited
    assert [one["sequence"] for one in fake.commands] == sorted({one["sequence"] for one in fake.commands})
    live.page.wait_for_timeout(400)
    assert fake.of("steer") == sent  # nothing is sent while nothing is held
    moved = np.array(live.page.evaluate("rille.pose('chassis')")) - before
    assert np.hypot(*moved[:2]) > 0.1
    live.page.keyboard.down("s")
    until(lambda: fake.of("steer")[-1]["forward"] < 0, "driving back")
    live.page.evaluate("dispatchEvent(new Event('blur'))")  # the window loses the keyboard
    until(lambda: fake.of("steer")[-1]["forward"] == 0, "the stop")
    assert live.complaints == []


def test_the_stick_and_the_sliders_drive(fake: Fake, live: Tab):
    commanding(fake, live)
    box = live.page.locator(".stick").bounding_box()
    assert box is not None
    live.page.mouse.move(box["x"] + 58, box["y"] + 58)
    live.page.mouse.down()
    live.page.mouse.move(box["x"] + 58, box["y"] + 20, steps=3)
    until(lambda: fake.of("steer") and fake.of("steer")[-1]["forward"] > 0.05, "driving")
    live.page.mouse.up()
    until(lambda: fake.of("steer")[-1]["forward"] == 0, "the stop")
    live.page.locator("input[aria-label^='drive_rear_left']").fill("1.2")
    until(lambda: fake.of("drive"), "the drive's value")
    assert fake.of("drive")[-1] | {"sequence": 0} == {
        "sender": fake.commander, "sequence": 0, "time": None, "kind": "drive", "drive": "drive_rear_left", "value": 1.2,
    }  # fmt: skip


def test_sliders_show_what_drives_are_set_to(fake: Fake, live: Tab):
    slider = live.page.locator("input[aria-label^='drive_rear_left']")
    names = [drive["name"] for drive in layout()["drives"]]
    fake.set_values = [0.01 * k for k in range(len(names))]
    fake.set_values[names.index("drive_rear_left")] = -0.75
    until(lambda: float(slider.input_value()) == pytest.approx(-0.75, abs=0.02), "the set value", 3)
    assert live.page.locator("label.row", has=slider).locator("output").inner_text() == "\u22120.75 rad/s"
    commanding(fake, live)
    assert fake.of("drive") == []  # what is shown is not sent


def test_a_gamepad_drives(fake: Fake, live: Tab):
    """Left stick ahead, right stick to the left; near the middle it stands still."""
    commanding(fake, live)
    pad = "{connected: true, id: 'made <b>pad</b>', mapping: 'standard', axes: [%s], buttons: []}"
    show = "navigator.getGamepads = () => [null, " + pad + "]"
    live.page.evaluate(show % "0, -1, -0.5, 0")
    until(lambda: fake.of("steer") and fake.of("steer")[-1]["forward"] > 0.05 and fake.of("steer")[-1]["turn"] > 0.01, "driving")
    assert "Gamepad: made <b>pad</b>" in live.page.locator("#pane-drive").inner_text()
    live.page.evaluate(show % "0.1, 0.1, 0.05, 0")
    until(lambda: fake.of("steer")[-1]["forward"] == 0 and fake.of("steer")[-1]["turn"] == 0, "the stop")
    assert all(one["lasts"] == 1 for one in fake.of("steer"))


def test_a_gamepad_of_unknown_order_drives_by_its_first_stick_alone(fake: Fake, live: Tab):
    """Its third axis may be a trigger, which rests at -1."""
    commanding(fake, live)
    show = "navigator.getGamepads = () => [{connected: true, id: 'old pad', mapping: '', axes: [%s], buttons: []}]"
    live.page.evaluate(show % "0, 0, -1, 0")
    until(lambda: "Gamepad: old pad" in live.page.locator("#pane-drive").inner_text(), "the gamepad")
    live.page.wait_for_timeout(300)
    assert fake.of("steer") == []
    live.page.evaluate(show % "0, -1, -1, 0")
    until(lambda: fake.of("steer"), "driving")
    assert fake.of("steer")[-1]["forward"] > 0.05
    live.page.evaluate(show % "-1, 0, -1, 0")
    until(lambda: fake.of("steer")[-1]["turn"] > 0.01, "turning")
    assert all(one["turn"] == 0 for one in fake.of("steer") if one["forward"])


def test_with_shift_the_rover_is_turned(fake: Fake, live: Tab):
    commanding(fake, live)
    before = fake.x, fake.y
    x, y = live.page.evaluate("rille.onScreen('chassis')")
    live.page.mouse.move(x, y)
    live.page.mouse.down()
    live.page.keyboard.down("Shift")
    live.page.mouse.move(x + 120, y + 5, steps=4)
    assert "°" in live.page.locator(".label.place").inner_text()
    live.page.mouse.up()
    live.page.keyboard.up("Shift")
    until(lambda: fake.of("place"), "the new heading")
    assert fake.of("place")[0]["heading"] is not None
    assert np.hypot(fake.x - before[0], fake.y - before[1]) < 1e-3  # it turns on the spot
    assert abs(fake.of("place")[0]["heading"] - 0.35) > 0.05


def test_dragging_the_rover_places_it(fake: Fake, live: Tab):
    x, y = live.page.evaluate("rille.onScreen('chassis')")
    live.page.mouse.move(x, y)
    live.page.mouse.down()
    live.page.mouse.up()
    assert "Take the command first" in toasts(live)
    commanding(fake, live)
    before = fake.x, fake.y
    x, y = live.page.evaluate("rille.onScreen('chassis')")
    live.page.mouse.move(x, y)
    live.page.mouse.down()
    live.page.mouse.move(x + 80, y + 10, steps=4)
    assert live.page.locator(".label.place").is_visible()
    live.page.mouse.up()
    until(lambda: fake.of("place"), "the new place")
    assert 0.1 < np.hypot(fake.x - before[0], fake.y - before[1]) < 3.0
    placed = fake.of("place")[0]
    assert placed["heading"] is None
    until(lambda: abs(live.page.evaluate("rille.pose('chassis')")[0] - placed["x"]) < 1e-3, "the rover there")
    assert live.complaints == []


def test_refusals_are_shown_as_they_were_said(fake: Fake, live: Tab):
    fake.refuse["start"] = "the run <b>has ended</b>; reset it"
    commanding(fake, live)
    live.page.click("#do-go")
    until(lambda: "the run <b>has ended</b>; reset it" in toasts(live), "the refusal")
    fake.commander = "page-other"
    live.page.wait_for_timeout(1200)
    assert live.page.locator("#who").inner_text() == "page-other commands"
    live.page.click("#take")
    until(lambda: "'page-other' commands" in toasts(live), "who commands")
    live.page.keyboard.down("w")
    live.page.wait_for_timeout(200)
    live.page.keyboard.up("w")
    assert fake.of("steer") == []  # who does not command sends nothing


def test_the_command_is_handed_over_to_whom_it_is_asked_by(fake: Fake, live: Tab):
    commanding(fake, live)
    fake.asked_by = "tower"
    until(lambda: live.page.locator("#hand-over").is_visible(), "who asks", 3)
    assert live.page.locator("#hand-over").inner_text() == "Hand over to tower"
    live.page.click("#hand-over")
    until(lambda: fake.commander == "tower", "the other commander")
    until(lambda: live.page.locator("#who").inner_text() == "tower commands", "the other commander")


def test_objects_are_found_read_and_set(fake: Fake, live: Tab):
    commanding(fake, live)
    live.page.click("#tab-objects")
    live.page.click("#pane-objects input")
    live.page.locator("#pane-objects li[role=option]").first.wait_for()
    live.page.fill("#pane-objects input", "chassis pos")
    live.page.keyboard.press("Enter")
    row = live.page.locator(".object label.row")
    until(lambda: row.nth(0).locator("output").inner_text() == "98.400", "the value")
    row.nth(2).locator("input").fill("20.75")
    live.page.click(".object button[type=submit]")
    until(lambda: fake.of("set"), "the set value")
    command = fake.of("set")[0]
    assert (command["quantity"], command["target"], command["values"]) == ("position", "chassis", pytest.approx([98.4, -50.4, 20.75]))


def test_what_is_left_empty_is_set_to_what_it_is_now(fake: Fake, live: Tab):
    """Between two readings the rover moves: what was read before is not sent. One that cannot be read holds up no other."""
    commanding(fake, live)
    live.page.click("#tab-objects")
    fake.fails = {"sinkage"}
    live.page.click("#pane-objects input")
    live.page.locator("#pane-objects li[role=option]").first.wait_for()
    for words in ("sinkage", "chassis pos"):
        live.page.fill("#pane-objects input", words)
        live.page.keyboard.press("Enter")
    x = live.page.locator(".object", has_text="chassis").locator("label.row output").first
    until(lambda: x.inner_text() == "98.400", "the value")
    fake.x += 1.0
    until(lambda: x.inner_text() == "99.400", "the new value", 3)
    live.page.evaluate("rille.shown.objects.reading = true")  # no reading by itself from now on
    fake.x += 1.0
    live.page.get_by_label("new position of chassis z").fill("20.75")
    live.page.click(".object button[type=submit]")
    until(lambda: fake.of("set"), "the set value")
    assert fake.of("set")[0]["values"] == pytest.approx([100.4, -50.4, 20.75])
    fake.fails = {"position"}
    live.page.get_by_label("new position of chassis z").fill("21")
    live.page.click(".object button[type=submit]")
    until(lambda: "it cannot be read now" in toasts(live), "the reason")
    assert len(fake.of("set")) == 1


def test_who_comes_late_sees_the_run_so_far(fake: Fake, tab: Tab):
    """Path, ruts and plots begin where the run did, not where the page was opened."""
    fake.state, fake.steer = "running", (0.5, 0.0)
    for _ in range(40):
        fake.history.append(fake.frame())
        fake.move(0.1)
    with served(fake) as address:
        tab.page.goto(address)
        tab.page.evaluate("rille.ready")
        until(lambda: tab.page.evaluate("rille.time()") > 4.2, "time going on")
        assert tab.page.evaluate("rille.shown.clock.start") == 0.0
        world = "rille.shown.viewer.worlds[0]"
        for times in ("path.times", "stamps.all.map(stamp => stamp.time)", "trails.of[0].times"):
            found = tab.page.evaluate(f"{world}.{times}")
            assert min(found) < 0.2, times
            assert max(found) > 4.0, times
            assert found == sorted(found), times
        assert tab.complaints == []


def test_a_run_that_waits_is_shown_at_once(fake: Fake, tab: Tab):
    """The first frame is what the history ended with: nothing new, and the page is ready."""
    fake.history.append(fake.frame())
    with served(fake) as address:
        tab.page.goto(address)
        assert tab.page.evaluate("Promise.race([rille.ready.then(() => true), new Promise(done => setTimeout(() => done(false), 5000))])")
        assert tab.complaints == []


@pytest.mark.parametrize(("driven", "saved"), [(True, 50.0), (True, 0.1), (False, 50.0)])
def test_another_run_has_a_history_of_its_own(fake: Fake, live: Tab, driven: bool, saved: float):
    """A state of another time is loaded, later or earlier than now: path, trails, plots and events are of what came since."""
    commanding(fake, live)
    fake.saved = (saved, 2.5)
    if driven:
        fake.steer = (0.5, 0.0)
        live.page.click("#do-go")
        until(lambda: live.page.evaluate("rille.time()") > 0.5, "time going on")
    world = "rille.shown.viewer.worlds[0]"
    assert live.page.evaluate(f"{world}.path.times[0]") == 0.0
    live.page.click("#do-load")
    until(lambda: live.page.evaluate("rille.time()") == saved, "the loaded state")
    until(lambda: live.page.evaluate("rille.shown.track.start") == saved, "a history that begins there", 3)
    assert live.page.evaluate(f"{world}.path.times") == [saved]
    live.page.click("#do-go")
    until(lambda: live.page.evaluate("rille.time()") > saved + 0.5, "time going on")
    for times in ("path.times", "stamps.all.map(stamp => stamp.time)", "trails.of[0].times"):
        found = live.page.evaluate(f"{world}.{times}")
        assert found, times
        assert min(found) >= saved, times
    assert live.page.evaluate("rille.shown.clock.start") == saved
    assert live.page.evaluate("rille.shown.track.events.map(event => event.subject)") == ["of the loaded run"]


def test_events_of_the_run_before_are_gone_from_the_list(fake: Fake, live: Tab):
    commanding(fake, live)
    live.page.click("#tab-events")
    live.page.click("#do-go")
    until(lambda: live.page.evaluate("rille.time()") > 0.2, "time going on")
    rows = live.page.locator(".events li")
    for saved in (0.1, 50.0):  # one event in each run: it is not the number of them that tells
        fake.saved = (saved, 2.5)
        live.page.click("#do-load")
        until(lambda at=saved: [row.split()[0] for row in rows.all_inner_texts()] == [f"0:{at:05.2f}"], "the event of this run", 3)


def test_plus_and_minus_change_the_speed_step_by_step(fake: Fake, live: Tab):
    commanding(fake, live)
    for key, factor in (("+", 2), ("+", 5), ("+", 10), ("-", 5)):
        live.page.keyboard.press(key)
        until(lambda wanted=factor: fake.speed == wanted and live.page.locator("#speed").input_value() == str(wanted), f"speed {factor}", 3)


def test_a_status_on_its_way_does_not_take_back_a_speed_just_chosen(fake: Fake, live: Tab):
    commanding(fake, live)
    fake.answers_after = 0.5
    live.page.keyboard.press("+")
    live.page.wait_for_timeout(250)  # the status before has come
    assert live.page.locator("#speed").input_value() == "2"
    live.page.keyboard.press("+")
    until(lambda: fake.speed == 5, "the second step")
    until(lambda: live.page.locator("#speed").input_value() == "5", "the second step on the page")
    fake.refuse["speed"] = "not now"
    live.page.keyboard.press("+")
    until(lambda: live.page.locator("#speed").input_value() == "5" and "not now" in toasts(live), "that a refused speed is taken back")


def test_a_drive_along_a_slide_is_in_metres(fake: Fake, tab: Tab):
    drives = {drive["name"]: drive for drive in fake.layout["drives"]}
    fake.layout["joints"][2]["kind"] = fake.layout["joints"][3]["kind"] = "prismatic"
    drives["drive_rear_left"] |= {"mode": "position", "lower": None, "upper": 0.5}
    drives["drive_rear_right"] |= {"max_speed": None}
    drives["drive_front_right"] |= {"mode": "torque"}
    with served(fake) as address:
        tab.page.goto(address)
        tab.page.evaluate("rille.ready")
        sliders = tab.page.locator("#pane-drive input[aria-label^='drive_']").all()
        assert [slider.get_attribute("aria-label") for slider in sliders] == [
            "drive_front_left: speed [rad/s]",
            "drive_front_right: torque [N m]",
            "drive_rear_left: position [m]",
            "drive_rear_right: speed [m/s]",
        ]
        ranges = [(float(s.get_attribute("min") or "nan"), float(s.get_attribute("max") or "nan")) for s in sliders]
        assert ranges == [(-2.0, 2.0), (-20.0, 20.0), (-1.0, 0.5), (-1.0, 1.0)]


def test_states_are_saved_and_loaded(fake: Fake, live: Tab):
    commanding(fake, live)
    live.page.fill("#run input", "on the rim")
    live.page.keyboard.press("Enter")
    live.page.click("#do-load")
    until(lambda: fake.of("load"), "the load")
    assert fake.of("save")[0]["name"] == "on the rim"
    assert fake.of("load")[0]["name"] == "before"
    live.page.select_option("#speed", "5")
    until(lambda: fake.of("speed"), "the speed")
    assert fake.of("speed")[0]["factor"] == 5


def test_a_server_that_goes_is_told_and_found_again(fake: Fake, tab: Tab):
    with served(fake) as address:
        tab.page.goto(address)
        tab.page.evaluate("rille.ready")
        port = fake.port
    until(lambda: tab.page.locator("#banner").is_visible(), "that the server is gone")
    assert "does not answer" in tab.page.locator("#banner").inner_text()
    assert tab.page.locator("#state").inner_text().lower() == "no server"
    fake.sockets.clear()
    with served(fake, port):
        until(lambda: tab.page.locator("#banner").is_hidden(), "the server again")
        until(lambda: tab.page.locator("#state").inner_text().lower() == "ready", "its status")


def test_a_wrong_token_is_told_and_not_tried_again(fake: Fake, tab: Tab):
    fake.rejects = 4401, "the token is missing or wrong"
    with served(fake) as address:
        tab.page.goto(address)
        until(lambda: "the token is missing or wrong" in tab.page.locator("#banner").inner_text(), "the reason")
        tab.page.wait_for_timeout(1500)
        assert fake.connections == 1


def test_a_live_page_without_its_server_says_what_to_do(tab: Tab, tmp_path):
    from web.assembled import page

    (tmp_path / "live.html").write_text(page({"kind": "live"}))
    tab.page.goto((tmp_path / "live.html").as_uri())
    until(lambda: "rille serve" in tab.page.locator("#banner").inner_text(), "the sentence")
