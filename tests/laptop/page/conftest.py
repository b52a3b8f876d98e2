"""The controller of a page without a browser, and a browser."""

import pytest

# (They are imported late: an old Python, which leaves these tests out, reads this.)


@pytest.fixture
def scene(tmp_path):
    """A PageScene of one camera."""
    from page_scene import PageScene

    return PageScene(tmp_path)


@pytest.fixture
def client(scene):
    """Calls the scene's controller over a pipe."""
    from page_scene import connected

    with connected(scene.controller) as client:
        yield client


@pytest.fixture(scope="module")
def browser():
    """A browser without a window."""
    from page_tracker import a_browser

    with a_browser() as browser:
        yield browser
