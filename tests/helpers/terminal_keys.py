"""Keys that a test types where a command would read them from a terminal."""

import contextlib


def keys_for(monkeypatch, module):
    """Return what hands keys (bytes) to whoever reads them last by `module.reading`."""
    hands = []

    @contextlib.contextmanager
    def reading(take):
        hands.append(take)
        yield

    monkeypatch.setattr(module, "reading", reading)
    return lambda keys: hands[-1](keys)
