"""The trials that a table is to be read with: every one that did not go as it was to go, and what was said of it."""

from collections.abc import Sequence

from rille.proof.summary import STRONG, Line


def failures(lines: Sequence[Line]) -> list[Line]:
    """What did not end; all wrong names; nulls that were not called complete; at twice the floor or more, and outside the catalogue at any
    strength, all that does not have the right answer first. In the order of their numbers.

    Parameters
    ----------
    lines : scores of the diagnosis.
    """
    return [line for line in sorted(lines, key=lambda line: line["trial"]) if _failed(line)]


def _failed(line: Line) -> bool:
    told = line["strength"] >= STRONG or line["sort"] in ("nothing", "outside")
    return line["status"] != "done" or line["wrong"] or (told and not line["top"])


def failures_markdown(lines: Sequence[Line]) -> str:
    """The list for people, as a table; a sentence where nothing failed."""
    found = failures(lines)
    if not found:
        return "Every trial went as it was to go.\n"
    head = "| trial | machine | what was concealed, times the floor | said | |\n|---|---|---|---|---|\n"
    return head + "".join(f"| {' | '.join(_cells(line))} |\n" for line in found)


def _cells(line: Line) -> tuple[str, ...]:
    return str(line["trial"]), line["machine"], _concealed(line), _said(line), _word(line)


def _concealed(line: Line) -> str:
    if line["sort"] == "nothing":
        return line["truth"]
    outside = " (not in the catalogue)" if line["sort"] == "outside" else ""
    return f"{line['truth']}{outside} at {line['strength']:g}"


def _said(line: Line) -> str:
    if line["status"] != "done":
        return line["status"]
    verdict = line["verdict"].replace("_", " ")
    if not line["answer"]:
        return verdict
    p = line["probability"]
    return f"{verdict}: {line['answer']}" + (f", {100 * p:.0f} %" if p is not None else "")


def _word(line: Line) -> str:
    if line["confident_wrong"]:
        return "**confident and wrong**"
    if line["wrong"]:
        return "wrong"
    return "truth in the group" if line["grouped"] else ""
