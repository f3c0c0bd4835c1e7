"""The diagnosis report: every part is there, every number stands in the JSON, poor and hostile answers give a page, a browser shows it."""

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from browser import Tab, until
from made_diagnosis import BIAS, COULOMB, PATCH, WHEEL, made_diagnosis, named, ranked
from rille.diagnosis.answer.diagnosis_json import diagnosis_json, diagnosis_lines, diagnosis_of, setting_json, setting_of
from rille.diagnosis.comparison.difference import find_difference
from rille.model import InputRefused
from rille.model.diagnosis import Diagnosis, Location, Proof, Transient
from rille.model.finding import RowChange
from rille.view.diagnosis_machine import accused_bodies
from rille.view.diagnosis_report import write_diagnosis_report
from view.difference_case import comparison
from view.test_difference_report import data_of
from view.test_view import hand_made

CHANGES = (
    RowChange(table="effect", row=f"coulomb_friction.{WHEEL}", column="torque", before=None, after=0.84, unit="N m"),
    RowChange(table="soil", row="lunar_sourcebook", column="cohesion", before=170.0, after=248.0, unit="Pa"),
)


def written(path, diagnosis, **others):
    write_diagnosis_report(path, diagnosis, diagnosis_json(diagnosis), finding="diagnosis-1", **others)
    return path.read_text()


def bare(page):
    """Text that a reader sees."""
    return html.unescape(re.sub(r"<[^>]*>", " ", re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.S)))


def at(place, value):
    """What stands in JSON at "ranked[0].gain"."""
    for key in re.findall(r"[^.\[\]]+", place):
        value = value[int(key)] if isinstance(value, list) else value[key]
    return value


def improved(case):
    rng = np.random.default_rng(5)
    channels = [replace(c, simulated=c.measured - c.noise * rng.standard_normal(len(c.time))) for c in case.channels]
    return replace(case, channels=tuple(channels))


def test_every_part_is_there_and_every_number_stands_in_the_json(tmp_path):
    cases = [comparison("traverse/1", seconds=30.0, seed=1), comparison("traverse/2", seconds=8.0, seed=2)]
    diagnosis = made_diagnosis()
    page = written(
        tmp_path / "r.html",
        diagnosis,
        changes=CHANGES,
        difference=find_difference(cases),
        comparisons=cases,
        improved=[improved(c) for c in cases],
    )
    text = " ".join(bare(page).split())
    for words in (
        diagnosis.sentence,
        diagnosis.location.sentence,
        "grows with the slip",
        "missing physics, named up to a group",
        "tau = -torque sign(w)",
        "Coulomb 1785",
        "0.78 to 0.90",
        "+45.9 %",
        "rille apply rover.db diagnosis-1 -o improved.db",
        "Every term earns its place",
        "imu_yaw disagrees",
        "its load never changed",
        "speed steps",
        "drive the front left wheel at 0.4",
        "cannot explain the torque",
        "force_x",
    ):
        assert words in text, words
    assert set(re.findall(r'<figure class="plot" id="([\w-]+)"', page)) == {
        "time-line",
        "map",
        "channels",
        *(f"curve-{k}" for k in range(4)),
    }
    kept = data_of(page)["diagnosis"]
    assert kept == json.loads(json.dumps(diagnosis_json(diagnosis)))
    places = re.findall(r'data-json="([^"]+)"[^>]*>([^<]*)<', page)
    assert len(places) > 80
    for place, shown in places:
        value = at(place, kept)
        if isinstance(value, str):
            assert html.unescape(shown) == value, place
        elif shown != "-" and re.fullmatch(r"-?[\d.]+( ±.*| to .*)?", shown):
            assert float(re.match(r"-?[\d.]+", shown).group()) == pytest.approx(value, rel=0.06), place


def test_a_hostile_name_is_text(tmp_path):
    evil = '<img src=x onerror="alert(1)"></script><script>alert(2)</script>'
    case = comparison(evil, seconds=6.0)
    term = named(replace(COULOMB, target=evil), {"torque": 1.0}, {"torque": 0.1}, equation=evil, source=evil, meaning=evil)
    diagnosis = made_diagnosis(
        recordings=(evil,),
        held_out=(evil,),
        sentence=evil,
        model=evil,
        setting=(term.term,),
        ranked=(ranked((term,), evil, "effect", 0.9, 3.0, 0.9, loses_because=evil),),
        transients=(replace(made_diagnosis().transients[0], recording=evil, target=evil, component=evil),),
        data_problems=(evil,),
        unknown_like=evil,
        experiments=(replace(made_diagnosis().experiments[0], scenario=evil, sentence=evil, name=evil),),
        location=replace(made_diagnosis().location, sentence=evil, regimes=(evil,)),
    )
    changes = (replace(CHANGES[0], row=evil, column=evil, unit=evil),)
    page = written(tmp_path / "r.html", diagnosis, changes=changes, difference=find_difference([case]), comparisons=[case])
    assert "<img src=x" not in page
    assert "<script>alert" not in page
    assert "default-src 'none'" in page
    outside = re.sub(r"<script>.*?</script>", "", page, flags=re.S)
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)|url\((?!data:)|@import""", outside)


NOWHERE = Location(shape="nowhere")
NAN = float("nan")


@pytest.mark.parametrize(
    "diagnosis",
    [
        Diagnosis(
            model="m.db",
            scenario="",
            recordings=("a",),
            held_out=(),
            verdict="nothing_missing",
            sentence="the model reproduces the recording to its noise",
            location=NOWHERE,
        ),
        made_diagnosis(verdict="unknown", setting=(), unknown_like="output += k w |w|", groups=()),
        made_diagnosis(verdict="cannot_know", setting=(), ranked=(), groups=(), transients=(), proof=None),
        made_diagnosis(
            verdict="sensor_fault",
            setting=(),
            groups=(),
            ranked=(ranked((named(BIAS, {"offset": 0.1}, {"offset": 0.01}),), "bias of yaw", "sensor", 0.97, 80.0, 0.99),),
        ),
        made_diagnosis(proof=Proof(gap_closed=NAN, low=NAN, high=NAN, before=NAN, after=NAN, floor=NAN, held_out="")),
    ],
    ids=lambda d: d.verdict,
)
def test_every_verdict_gives_a_page_and_a_text(tmp_path, diagnosis):
    page = written(tmp_path / "r.html", diagnosis)
    assert diagnosis.sentence.rstrip(".")[1:] in bare(page)
    assert "rille apply" not in bare(page)  # nothing changes
    assert diagnosis_lines(diagnosis)[0] == diagnosis.sentence
    assert repr(diagnosis_of(json.loads(json.dumps(diagnosis_json(diagnosis))))) == repr(diagnosis)  # NaN and all


def test_settings_are_read_back_and_others_refused():
    setting = made_diagnosis().setting
    assert setting_of(json.loads(json.dumps(setting_json(setting)))) == setting
    with pytest.raises(InputRefused, match="another version"):
        setting_of([{"values": [1.0]}])
    with pytest.raises(InputRefused, match="another version"):
        diagnosis_of(diagnosis_json(made_diagnosis()) | {"verdict": "perhaps"})


def test_many_recordings_are_rows_of_one_picture(tmp_path):
    cases = [comparison(f"run/{k}", seconds=4.0, seed=k, faulty=k == 3) for k in range(9)]
    pulse = made_diagnosis().transients[0]
    diagnosis = made_diagnosis(
        recordings=tuple(c.recording for c in cases), transients=(replace(pulse, recording="run/3", start=1.0, peak_time=1.1),)
    )
    page = written(tmp_path / "r.html", diagnosis, difference=find_difference(cases), comparisons=cases)
    figure = json.loads(re.search(r'id="time-line".*?<script type="application/json">(.*?)</script>', page, re.S).group(1))
    assert figure["data"][0]["type"] == "heatmap"
    assert set(figure["data"][0]["y"]) == {c.recording for c in cases}
    assert figure["data"][1]["y"] == ["run/3"]


def test_a_place_is_a_circle_on_the_map(tmp_path):
    case = comparison("traverse/1", seconds=20.0)
    term = PATCH.at({"stiffness_change": -0.4, "center_x": 1.5, "center_y": 0.2, "radius": 0.6})
    page = written(tmp_path / "r.html", made_diagnosis(setting=(term,)), difference=find_difference([case]), comparisons=[case])
    figure = json.loads(re.search(r'id="map".*?<script type="application/json">(.*?)</script>', page, re.S).group(1))
    circle = figure["layout"]["shapes"][0]
    assert [circle[edge] for edge in ("x0", "x1", "y0", "y1")] == pytest.approx([0.9, 2.1, -0.4, 0.8])


def test_what_is_lit():
    _, rover = hand_made()
    channels = {"yaw": "chassis"}

    def lit(**changes):
        return set(accused_bodies(rover, replace(COULOMB, **changes), channels))

    wheels = {w.name for w in rover.wheels}
    assert lit() == {WHEEL}
    assert lit(target="*", target_kind="wheel") == wheels
    assert lit(target="chassis", target_kind="body") == {"chassis"}
    assert lit(target="*", target_kind="terrain") == set()
    assert lit(target="lunar_sourcebook", target_kind="soil") == set()
    assert lit(target="", target_kind="world") == set()
    assert lit(target="", target_kind="machine", kind="track_width") == wheels
    assert set(accused_bodies(rover, BIAS, channels)) == {"chassis"}
    assert lit(target="nobody") == set()


def test_a_browser_draws_every_figure_in_silence(tmp_path, tab: Tab):
    cases = [comparison("traverse/1", seconds=30.0, seed=1), comparison("traverse/2", seconds=8.0, seed=2)]
    _, rover = hand_made()
    path = tmp_path / "r.html"
    written(
        path,
        made_diagnosis(),
        changes=CHANGES,
        difference=find_difference(cases),
        comparisons=cases,
        improved=[improved(c) for c in cases],
        rover=rover,
    )
    tab.page.goto(path.as_uri())

    def run(script):
        return tab.page.evaluate(script)

    figures = run("[...document.querySelectorAll('figure.plot')].map(figure => figure.id)")
    assert len(figures) == 7
    for figure in figures:
        run(f"document.getElementById('{figure}').scrollIntoView({{behavior: 'instant', block: 'center'}})")
        until(lambda figure=figure: run(f"document.querySelector('#{figure} .canvas')._fullLayout !== undefined"), figure)
    for _ in range(2):
        run("document.getElementById('theme').click()")
        assert run("document.querySelector('#time-line .canvas')._fullLayout.font.color") == run("rille.css('--ink')")
    bars = run("[...document.querySelectorAll('.bar i')].map(bar => bar.parentNode.style.getPropertyValue('--part'))")
    assert bars == ["71.0%", "22.0%", "5.0%", "2.0%"]
    assert not run("document.documentElement.scrollWidth > document.documentElement.clientWidth"), "the page is wider than the window"
    assert tab.complaints == []
    assert tab.schemes <= {"file", "data", "blob"}


def test_transients_alone_have_a_time_line(tmp_path):
    pulses = tuple(
        Transient(
            recording="run",
            kind="joint_pulse",
            target=f"hinge{k}",
            component="torque",
            start=k,
            duration=0.1,
            peak_time=k + 0.05,
            amplitude=(-1) ** k * 2.0,
            amplitude_error=0.1,
            score=8.0,
        )
        for k in (1, 2)
    )
    text = bare(written(tmp_path / "r.html", made_diagnosis(transients=pulses, recordings=("run",))))
    assert "-2.00 ± 0.10" in text
    assert "hinge2" in text
