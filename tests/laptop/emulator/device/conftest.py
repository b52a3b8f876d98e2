"""What the tests of devices share."""

import pytest
from motor_bench import benches


@pytest.fixture
def bench():
    """Make benches; the library is on the last one made."""
    with benches() as build:
        yield build
