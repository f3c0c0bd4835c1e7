"""Numbers in texts that other programs read."""


def numbers(*values: float) -> str:
    """Numbers with all their digits, blanks between."""
    return " ".join(repr(float(v)) for v in values)
