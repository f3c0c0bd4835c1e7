"""What a manifest accepts of what the data gate finds."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from rille.model.recording import GateFinding
from rille.model.sheet import validate_sheet
from rille.recording.columns import Column, plan_columns
from rille.recording.manifest import ManifestSheet


@dataclass(frozen=True, slots=True, kw_only=True)
class Acceptance:
    """everywhere : codes of the gate that are accepted of all. channels : codes by the name of the channel."""

    everywhere: frozenset[str]
    channels: Mapping[str, frozenset[str]]

    def refuses(self, finding: GateFinding) -> bool:
        """Whether a finding is an error that is not accepted."""
        return finding.severity == "error" and finding.code not in self.everywhere | self.channels.get(finding.channel, frozenset())

    def told(self, findings: Iterable[GateFinding]) -> tuple[GateFinding, ...]:
        """The findings; an error that is accepted is a warning that says so, without the advice to accept it."""
        return tuple(
            finding
            if finding.severity != "error" or self.refuses(finding)
            else replace(finding, severity="warning", message=f"{finding.message.partition('; ')[0].rstrip('.')}; the manifest accepts it")
            for finding in findings
        )


def acceptance(sheet: ManifestSheet, columns: Sequence[Column]) -> Acceptance:
    """What a manifest accepts. columns : as planned from it."""
    return Acceptance(everywhere=frozenset(sheet.accepted), channels={column.channel.name: column.accepted for column in columns})


def acceptance_in(manifest: str) -> Acceptance:
    """What the text of a manifest accepts, as it is kept with a recording; of one without a manifest, nothing.

    Raises
    ------
    InputRefused : if the text is of a manifest that this version cannot read.
    """
    if not manifest:
        return Acceptance(everywhere=frozenset(), channels={})
    sheet = validate_sheet(tomllib.loads(manifest), ManifestSheet, "the manifest of the recording")
    return acceptance(sheet, plan_columns(sheet, None))
