"""The difference report: what is in the page, and that a browser shows it, obeys every click and asks no network."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from browser import Tab, until
from machines import plane
from rille.diagnosis.comparison.difference import find_difference
from rille.model import InputRefused
from rille.model.comparison import Comparison, Regimes
from rille.model.difference import TargetDifference
from rille.model.recording import GateFinding
from rille.view.difference_plots import DETAIL, WORST, kept_recordings, recording_data
from rille.view.difference_report import write_difference_report
from rille.view.difference_rover import body_scores, heat
from rille.view.difference_tables import findings_table
from rille.view.page import Html, Page, Section, escaped, number, probability, script_text, write_page
from rille.view.thinning import thinned
from view.difference_case import comparison
from view.test_view import hand_made


def numbers(packed: dict) -> np.ndarray:
    return np.frombuffer(base64.b64decode(packed["bdata"]), {"f4": "<f4", "f8": "<f8"}[packed["dtype"]])


def data_of(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="rille-data">(.*?)</script>', page, re.S)
    assert found is not None
    return json.loads(found.group(1))


def test_thinning_keeps_the_extremes():
    """A spike of one sample among a million must not vanish from a plot of 1000 points."""
    values = np.random.default_rng(1).normal(size=1_000_000)
    values[123_456], values[777_777], values[500_000] = 40.0, -50.0, np.nan
    kept = thinned(1000, values)
    assert len(kept) <= 1002  # first and last come on top
    assert {123_456, 777_777} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)
    np.testing.assert_array_equal(thinned(1000, np.zeros(7)), np.arange(7))
    assert len(thinned(10, np.full(1000, np.nan))) == 2  # nothing known: the ends


def test_worst_windows_are_whole_and_far_samples_stay():
    case = comparison(seconds=150.0, rate=100.0)
    found = find_difference([case])
    data = recording_data(case, found, 400)
    worst = found.windows[0]
    channel = next(c for c in case.channels if c.channel.name == worst.channel)
    series = data["series"][str([c.name for c in found.channels].index(worst.channel))]  # type: ignore[index]
    shown = numbers(series["time"])
    inside = channel.time[channel.window == worst.number]
    assert len(inside) <= DETAIL
    assert np.isin(inside, shown).all()
    assert len(shown) < 402 + (WORST + 1) * len(inside)
    assert np.nanmax(np.abs(numbers(series["residual"]))) == pytest.approx(np.nanmax(np.abs(channel.residual)), rel=1e-6)  # 32-bit


def test_a_page_holds_the_worst_of_many_recordings():
    cases = [comparison(f"run/{k}", seconds=4.0, seed=k, faulty=k == 7) for k in range(60)]
    found = find_difference(cases)
    first = next(window.recording for window in found.windows)
    kept = kept_recordings(found, cases)
    assert cases[kept.recordings[0]].recording == first
    assert len(set(kept.recordings)) == len(kept.recordings)
    many = kept_recordings(found, [replace(cases[0], recording=f"x{k}") for k in range(4000)])
    assert 10 < len(many.recordings) < 1000


def test_a_report_is_one_file_that_asks_no_network(tmp_path):
    path = tmp_path / "report.html"
    case = comparison('<script>alert("x")</script>', seconds=6.0)
    finding = GateFinding(code="bad_channel", severity="warning", channel="imu_yaw", message="imu_yaw </script> is <b>odd</b>")
    notes = write_difference_report(path, find_difference([case]), [case], gate_findings={case.recording: [finding]})
    assert notes == []
    page = path.read_text()
    outside = re.sub(r"<script>.*?</script>", "", page, flags=re.S)
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)|url\((?!data:)|@import""", outside)
    assert "default-src 'none'" in page
    assert "alert(&quot;x&quot;)" in page
    assert "<script>alert(" not in page
    assert data_of(page)["names"] == [case.recording]  # the text of a name does not end the element that holds it
    assert not list(tmp_path.glob("*.part"))


NOWHERE = Regimes(time=np.empty(0), window=np.empty(0, np.int64), values={})


@pytest.mark.parametrize(
    "change",
    [{"mode": "whole"}, {"channels": ()}, {"regimes": NOWHERE}, {"channels": (), "windows": (), "regimes": NOWHERE}],
    ids=["whole", "no channels", "no regimes", "nothing"],
)
def test_poor_comparisons_still_give_a_page(tmp_path, change):
    case = replace(comparison(seconds=6.0), **change)
    write_difference_report(tmp_path / "report.html", find_difference([case]), [case])
    assert data_of((tmp_path / "report.html").read_text())["names"] == ["traverse/1"]


def test_channels_without_noise_or_samples_still_give_a_page(tmp_path):
    case = comparison(seconds=6.0)
    first, second, *rest = case.channels
    silent = replace(second, measured=np.full_like(second.measured, np.nan))
    case = replace(case, channels=(replace(first, noise=float("nan")), silent, *rest))
    write_difference_report(tmp_path / "report.html", find_difference([case]), [case])
    assert "no data" in (tmp_path / "report.html").read_text()


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputRefused, match="cannot be written"):
        write_page(tmp_path / "nowhere" / "report.html", Page(title="x", sections=[Section(key="a", title="b", body="")]))


def test_texts_of_a_page():
    assert [number(v) for v in (0.0, 1.0, 12.345, 0.00012345, 123456.0, float("nan"))] == [
        "0",
        "1.00",
        "12.3",
        "1.23·10⁻⁴",
        "1.23·10⁵",
        "-",
    ]
    assert [probability(p) for p in (0.0, 0.04, float("nan"))] == ["< 10⁻¹²", "0.040", "-"]
    assert [escaped("<b>"), escaped(Html("<b>"))] == ["&lt;b&gt;", "<b>"]
    assert json.loads(script_text({"a": [np.float64(np.nan), 1.5, np.int64(2)], "b": "</script>"})) == {
        "a": [None, 1.5, 2],
        "b": "</script>",
    }


def test_findings_of_one_kind_share_a_row():
    """Hundreds of recordings of one import say the same of a clock, each with its own numbers."""
    findings = {
        f"run/{k}": [GateFinding(code="clock_jitter", severity="note", channel="time", message=f"jitter of {k} us")] for k in range(603)
    }
    findings["run/5"].append(GateFinding(code="bad_channel", severity="warning", channel="imu_yaw", message="imu_yaw is odd"))
    rows = findings_table(findings)
    assert rows.count("<tr") == 3  # head and two
    assert "jitter of 0 us (in run/0; the others alike)" in rows
    assert "603 recordings" in rows
    assert rows.index("imu_yaw is odd") < rows.index("jitter")  # warnings first


def test_parts_are_lit_by_their_worst_target():
    _, rover = hand_made()
    joint = rover.joints[0]

    def target(kind, name, normalised):
        return TargetDifference(
            kind=kind, name=name, channels=("c",), n=10, normalised=normalised, excess=0.0, share=0.0, differs=normalised > 1.2
        )

    scores = body_scores(rover, [target("joint", joint.name, 3.0), target("part", joint.child, 1.0), target("part", "elsewhere", 9.0)])
    assert {body: score.normalised for body, score in scores.items()} == {joint.child: 3.0}
    reds = [int(heat(value, 10.0)[3:5], 16) for value in (0.9, 1.0, 2.0, 5.0, 10.0)]  # green fades as the colour goes to red
    assert reds == sorted(reds, reverse=True)


def case_of_two() -> list[Comparison]:
    return [comparison("traverse/1", seconds=40.0, seed=1), comparison("traverse/2", seconds=12.0, seed=2, faulty=False)]


def test_a_browser_shows_all_and_obeys_every_click(tmp_path, tab: Tab):
    """Every figure is drawn; rows, cells, lists, buttons change what is shown; console and network stay silent; it prints."""
    cases = case_of_two()
    found = find_difference(cases)
    _, rover = hand_made()
    path = tmp_path / "report.html"
    finding = GateFinding(code="quantisation", severity="note", channel="yaw", message="yaw has steps of 0.0002 rad")
    notes = write_difference_report(
        path, found, cases, rover=rover, terrain=plane(0.1), gate_findings={c.recording: [finding] for c in cases}
    )
    browser = tab.page
    browser.set_viewport_size({"width": 1300, "height": 950})
    browser.goto(path.as_uri())

    def run(script):
        return browser.evaluate(f"() => {script}")

    def text_of(key):
        return browser.locator(f"#{key}").inner_text()

    def layout(figure):
        return f"document.querySelector('#{figure} .canvas')._fullLayout"

    def traces(figure):
        return f"(document.querySelector('#{figure} .canvas').data ?? [])"

    def click(selector):
        browser.evaluate(
            "at => { const element = document.querySelector(at); element.scrollIntoView({block: 'center'}); element.click(); }", selector
        )

    def pick(selector, value):
        browser.select_option(selector, value)

    assert found.sentence[1:] in text_of("verdict")
    figures = run("[...document.querySelectorAll('figure.plot')].map(figure => figure.id)")
    assert set(figures) == {"strip", "series", "runs", "regime", "map", "correlation", "quantiles"}
    for figure in figures:
        run(f"document.getElementById('{figure}').scrollIntoView({{behavior: 'instant', block: 'center'}})")
        until(lambda figure=figure: run(f"{traces(figure)}.length > 0 && {layout(figure)} !== undefined"), figure)

    # it starts with the worst window's recording and channel
    worst = found.windows[0]
    assert f"{worst.recording}, {worst.channel}." in text_of("shown")

    # a row of the windows goes there
    click(f"#window-table tr[data-key$=':{worst.number}']")
    until(lambda: f"window {worst.number} " in text_of("shown"), "the window")
    low, high = run(f"{layout('series')}.xaxis.range")
    assert low < worst.start < worst.stop < high < low + 3 * (worst.stop - worst.start)
    assert run("document.querySelector('#window-table tr[aria-current]').dataset.key").endswith(f":{worst.number}")

    # buttons step and go back
    click("#next")
    assert f"window {worst.number + 1} " in text_of("shown")
    click("#whole")
    assert run(f"{layout('series')}.xaxis.range")[1] > 39.0

    # a channel's row, by mouse and by keyboard, changes all figures
    yaw = [c.name for c in found.channels].index("yaw")
    click(f"#channel-table tr[data-key='channel:{yaw}']")
    assert "orientation.yaw" in run(f"{layout('series')}.yaxis.title.text")
    assert "yaw" in run(f"{layout('regime')}.yaxis.title.text")
    assert text_of("white-words").startswith("yaw: Ljung-Box")
    run("document.querySelector('#channel-table tr[data-key=\"channel:0\"]').focus()")
    browser.keyboard.press("Enter")
    assert "position.x" in run(f"{layout('series')}.yaxis.title.text")

    # lists
    pick("#pick-recording", "1")
    assert text_of("shown").startswith("traverse/2")
    torque = [c.name for c in found.channels].index("front_left_torque")
    pick("#pick-channel", str(torque))
    pick("#pick-regime", "slip_ratio/wheel_front_left")
    assert run(f"{layout('regime')}.xaxis.title.text") == "slip_ratio/wheel_front_left [-]"
    assert run(f"{traces('regime')}.length") == 3
    click(f"#regime-table tr[data-key='regime:{yaw}:turning_rate']")
    assert run(f"{layout('regime')}.xaxis.title.text") == "turning_rate [rad/s]"
    pick("#pick-score", str(yaw))
    click(f"#run-table tr[data-key='run:0:{torque}']")
    assert text_of("shown").startswith("traverse/1, front_left_torque")
    click("#target-table tr[data-key]")

    # a cell of the strip and a place on the map
    run("document.getElementById('strip').scrollIntoView({behavior: 'instant', block: 'center'})")
    run(f"document.querySelector('#strip .canvas').emit('plotly_click', {{points: [{{pointIndex: [{yaw}, 20], y: {yaw}}}]}})")
    assert "yaw, window 20 " in text_of("shown")
    run("document.querySelector('#map .canvas').emit('plotly_click', {points: [{pointIndex: 3, customdata: 3}]})")
    assert "window 0 " in text_of("shown")
    run("document.querySelector('#runs .canvas').emit('plotly_click', {points: [{pointIndex: [0, 1], y: 0}]})")
    assert text_of("shown").startswith("traverse/2, x.")

    # tables sort, largest first, and show all rows on demand
    click("#channel-table th:nth-child(3) button")
    shown = [
        float(v) for v in run("[...document.querySelectorAll('#channel-table tbody td:nth-child(3)')].map(cell => cell.dataset.value)")
    ]
    assert shown == sorted(shown, reverse=True)
    click(".more[data-for='window-table']")
    assert run("[...document.querySelectorAll('#window-table tbody tr')].every(row => row.getClientRects().length === 1)")

    # both themes are readable: the text of a figure has the page's colour
    for _ in range(2):
        click("#theme")
        assert run(f"{layout('series')}.font.color") == run("rille.css('--ink')")

    browser.screenshot(path=tmp_path / "report.png", full_page=True)
    printed = browser.pdf(print_background=True)
    assert printed.startswith(b"%PDF")
    assert len(printed) > 50_000
    assert not run("document.documentElement.scrollWidth > document.documentElement.clientWidth"), "the page is wider than the window"

    assert tab.complaints == []
    assert tab.schemes <= {"file", "data", "blob"}
    if not notes:  # EGL works here
        assert run("document.querySelector('#machine-picture img').naturalWidth") > 1000
