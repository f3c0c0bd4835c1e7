"""What is drawn, for tests that look at it before it is a picture."""


def figures_of(monkeypatch, module):
    """List that holds every figure which a module of ``rille.view`` begins from now on."""
    drawn, canvas = [], module.empty_canvas
    monkeypatch.setattr(module, "empty_canvas", lambda *size: drawn.append(canvas(*size)) or drawn[-1])
    return drawn
