"""The verdict in words."""

import math
from collections.abc import Sequence

from rille.model.diagnosis import Estimate, Location, NamedTerm, Proof, RankedHypothesis, Transient, Verdict

LITTLE = 0.005  # share of the excess that is not worth a word
MORE = 1.5  # times the floor, beyond which what is left is told
MOST_NAMES = 4


def statement(
    verdict: Verdict,
    terms: Sequence[NamedTerm],
    ranked: Sequence[RankedHypothesis],
    location: Location,
    leftover: float,
    proof: Proof | None,
    transients: Sequence[Transient],
    limits: Sequence[str],
    unknown_like: str = "",
    apart: str = "",
) -> str:
    """One paragraph: what it is, where, how sure, how much better, and what stays open. leftover : share of the excess that is left.
    apart : which channels took no part, and why.
    """
    parts = [_what(verdict, terms, ranked, location, leftover), unknown_like]
    if verdict != "nothing_missing" and location.sentence:
        parts.append(location.sentence)
    if transients:
        parts.append(pushes_in_words(transients))
    if proof is not None and verdict not in ("nothing_missing", "cannot_know"):
        parts.append(_proven(proof))
    if verdict in ("cannot_know", "unknown", "group") and limits:
        parts.append(limits[0])
    parts.append(apart)
    return " ".join(sentence(part) for part in parts if part)


def sentence(text: str) -> str:
    """With a capital and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def number(estimate: Estimate) -> str:
    """``torque 0.52 N m (0.50 to 0.54)``."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    interval = f" ({estimate.low:.3g} to {estimate.high:.3g})" if estimate.low < estimate.high else ""
    return f"{estimate.name} {estimate.value:.3g}{unit}{interval}"


def percent(share: float) -> str:
    """``93 %``; never certain."""
    return "> 99 %" if share > 0.99 else "< 1 %" if share < 0.01 else f"{100 * share:.0f} %"


def _named(term: NamedTerm) -> str:
    numbers = ", ".join(number(e) for e in term.estimates[:3])
    return f"{term.term.hypothesis.title}{f', {numbers}' if numbers else ''}"


def _listed(names: Sequence[str]) -> str:
    shown = [*names[:MOST_NAMES], *([f"{len(names) - MOST_NAMES} more"] if len(names) > MOST_NAMES else [])]
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"


def _what(verdict: Verdict, terms: Sequence[NamedTerm], ranked: Sequence[RankedHypothesis], location: Location, leftover: float) -> str:
    sure = f"; probability {percent(ranked[0].probability)}" if ranked else ""
    explained = _explained(leftover)
    named = _listed([_named(term) for term in terms]) if terms else ""
    if verdict == "nothing_missing":
        return "nothing is missing: the model reproduces these recordings to their noise"
    if verdict == "cannot_know":
        differs = any(target.differs for target in location.targets)
        if differs:
            return "the model differs from these recordings, but they cannot tell why"
        return "these recordings cannot tell whether the model differs from them"
    if verdict == "sensor_fault":
        return f"the model is not to blame, a sensor is: {named}{sure}{explained}"
    if verdict == "parameter":
        return f"no physics is missing, a number of the model is wrong: {named}{sure}{explained}"
    if verdict == "group":
        members = [row.title for row in ranked if row.group == ranked[0].group and row.probability > 0]
        if len(members) == 1:
            what = "numbers of the model are wrong" if ranked[0].cause == "parameter" else "this is missing in the model"
            return f"{what}, or something that these recordings cannot tell from it: {named or members[0]}{sure}{explained}"
        return f"one of these is missing, and these recordings cannot tell which: {_listed(members)}{sure}{explained}; best: {named}"
    if verdict == "unknown":
        nearest = f"; nearest is {ranked[0].title}, which explains {100 * ranked[0].explained:.0f} %" if ranked else ""
        return f"something is missing that the catalogue has no name for{nearest}"
    faults = [term for term in terms if term.term.hypothesis.cause == "sensor"]
    missing = [term for term in terms if term not in faults]
    beside = f"; and a sensor is at fault: {_listed([_named(term) for term in faults])}" if faults else ""
    listed = _listed([_named(term) for term in missing])
    return f"{'this is' if len(missing) == 1 else 'these are'} missing in the model: {listed}{beside}{sure}{explained}"


def _explained(leftover: float) -> str:
    """How much of the excess an answer takes away: chance is set aside, so that all of it says nothing of how few samples there are."""
    if not 0 <= leftover <= 1:
        return ""
    share = f"{100 * (1 - leftover):.0f} % of what is" if leftover >= LITTLE else "all that is clearly"
    return f"; explains {share} beyond the noise"


def pushes_in_words(transients: Sequence[Transient]) -> str:
    """How many, and the clearest."""
    strongest = max(transients, key=lambda t: abs(t.score))
    unit = "N" if strongest.component.startswith("force") else "N m"
    return (
        f"{len(transients)} short {'push' if len(transients) == 1 else 'pushes'} found; the clearest at {strongest.peak_time:.2f} s of "
        f"'{strongest.recording}': {strongest.component} of {strongest.amplitude:+.3g} +- {strongest.amplitude_error:.2g} {unit} at "
        f"{strongest.target}"
    )


def _proven(proof: Proof) -> str:
    if not math.isfinite(proof.gap_closed):
        return ""
    interval = f" ({100 * proof.low:.0f} to {100 * proof.high:.0f} %)" if math.isfinite(proof.low) else ""
    return (
        f"on {proof.held_out}, which the fit has not seen, the gap to the noise closes by {100 * proof.gap_closed:.0f} %{interval}: "
        f"RMS {proof.before:.2f} to {proof.after:.2f} times the noise, floor {proof.floor:.2f}"
        + (
            f"; in the channels that it changes, RMS {proof.touched.before:.2f} to {proof.touched.after:.2f}"
            if proof.touched is not None
            else ""
        )
        + ("; what is left there is not noise, so that this is not all of it" if proof.after > MORE * proof.floor else "")
    )
