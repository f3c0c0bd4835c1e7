"""The data gate's page, and the verb that writes it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from browser import Tab
from command import assert_refused, rille
from recording.gate_machines import changed, machine
from rille import store
from rille.model import InputRefused
from rille.model.recording import GateFinding, Recording
from rille.recording.gate import gate
from rille.view.gate_report import MEANING, write_gate_report

CODES = re.compile(r'code="([a-z_]+)"')


def faulty() -> Recording:
    """A machine whose gyro is turned, and whose elbow's rate is held for two seconds."""
    recording = machine(202)
    gyro, rate = recording.channel("gyro"), recording.channel("elbow_velocity")
    still = np.where((rate.time > 1.0) & (rate.time < 2.6), rate.value[100], rate.value)
    return changed(changed(recording, "gyro", value=-gyro.value), "elbow_velocity", value=still)


def test_every_code_has_a_meaning(repository: Path):
    folder = repository / "pipeline" / "rille" / "recording" / "gate"
    codes = {code for path in folder.glob("*.py") for code in CODES.findall(path.read_text())}
    assert codes <= MEANING.keys()
    assert len(codes) > 15


def test_page_has_findings_and_pictures(tmp_path: Path):
    recording = faulty()
    recording = replace(recording, findings=gate([recording])[0])
    text = write_gate_report(tmp_path / "gate.html", [recording, recording], source="rover.db").read_text()
    assert "1 error" in text
    for code in ("sign", "stuck"):
        assert f">{code}<" in text
    assert text.count('class="plot"') >= 2
    assert ">2</td>" in text  # both recordings have each finding
    with pytest.raises(InputRefused, match="cannot be written"):
        write_gate_report(tmp_path / "nowhere" / "gate.html", [recording], source="rover.db")


def test_names_cannot_break_the_page(tmp_path: Path):
    """Names come from files of others."""
    evil = "<script>alert(1)</script>"
    recording = machine(202)
    recording = replace(recording, channels=(replace(recording.channels[0], name=evil), *recording.channels[1:]))
    finding = GateFinding(code="stuck", severity="warning", channel=evil, detail={"intervals": [[1.0, 2.0]]}, message=f"'{evil}' is stuck")
    text = write_gate_report(tmp_path / "gate.html", [replace(recording, findings=(finding,))], source=evil).read_text()
    assert evil not in text


def test_the_verb_checks_stores_and_shows(tmp_path: Path):
    """``rille record check``: the same findings on stdout, in the database and in the page; unknown names are refused with the nearest."""
    database = tmp_path / "drive.db"
    store.create(database)
    store.write_recording(database, replace(faulty(), name="drive"))
    result = rille("record", "check", str(database), "drive", "--json", "-o", str(tmp_path / "gate.html"))
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)["drive"]
    assert {"sign", "stuck"} <= {finding["code"] for finding in told}
    kept = store.read_recording(database, "drive", samples=False).findings
    assert [finding.message for finding in kept] == [finding["message"] for finding in told]
    assert "sign" in (tmp_path / "gate.html").read_text()
    refused = rille("record", "check", str(database), "drivv")
    assert_refused(refused, "drivv", "drive")


def test_a_browser_draws_it(tmp_path: Path, tab: Tab):
    """Every picture is drawn, and nothing is complained of or asked from a network."""
    recording = faulty()
    path = write_gate_report(tmp_path / "gate.html", [replace(recording, findings=gate([recording])[0])], source="rover.db")
    tab.page.goto(path.as_uri())
    figures = tab.page.locator("figure.plot")
    assert figures.count()
    for figure in figures.all():
        figure.scroll_into_view_if_needed()
        figure.locator(".main-svg").first.wait_for(state="attached")
    assert tab.complaints == []
    assert tab.schemes <= {"file", "data", "blob"}
