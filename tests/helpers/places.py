"""Where the things are that tests need besides what they import."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROBOT = ROOT / "robot"
SCRIPTS = ROOT / "tests" / "scripts"
FOOTAGE = ROOT.parent / "shared" / "footage"
"""Real video; it is not in the checkout, and may be absent."""
