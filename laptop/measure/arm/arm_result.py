"""Measured numbers of an arm: a table for people, and those that go into the arm's file.

A number is written where it is known better than it was.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from laptop.measure.arm.arm_fit import ArmFit, BadIdentification
from laptop.see.table.arm_file import WrittenArm, write_values
from shared.arm_description import Joint

LINK_LIMIT = 0.01
"""Standard uncertainties up to which a number is worth being written: of a link, a share, ..."""
ANGLE_LIMIT = math.radians(0.8)
"""... of a zero and a backlash, rad, ..."""
OFFSET_LIMIT = 0.1
"""... and of the marker_offset, cm."""
MAX_UNCERTAINTY_SHARE = 0.7
"""Share of the uncertainty before above which a number counts as not learned."""
MAX_ZERO_SHIFT = math.radians(45)
"""Greatest difference of a first zero from its description, rad; beyond it the board lies another
quarter turned than said."""
MIN_SCALE_ERROR, MAX_SCALE_SPREAD = 0.01, 0.012
"""Least difference of the links from their description, and greatest one among them, as shares, at
which a board looks as if it was not printed at 100 %."""


@dataclass(frozen=True)
class Measured:
    """A line of the table.

    section, key  of the arm's file; "" if it does not stand there
    name   for people
    unit   of the numbers: cm, deg, mm or ""
    was, found, sigma  in that unit; sigma: standard uncertainty
    why    why it is not known, or ""
    text   what is written into the file, or ""
    """

    section: str
    key: str
    name: str
    unit: str
    was: float
    found: float
    sigma: float
    why: str = ""
    text: str = ""


def measured(fit: ArmFit) -> list[Measured]:
    """Return a fit's estimates of an arm, number by number."""
    found = []
    for joint in fit.model.arm.joints:
        found += [_link(fit, joint), _zero(fit, joint), _backlash(fit, joint)]
        if fit.sigma(f"{joint.name}.gear") > 0:
            found.append(_gear(fit, joint))
    return found + _of_marker(fit)


def _estimate(fit: ArmFit, joint: Joint, key: str) -> tuple[float, float]:
    """Return a fit's estimate for a joint, and its standard uncertainty."""
    name = f"{joint.name}.{key}"
    return fit.value(name), fit.sigma(name)


def _confusion(fit: ArmFit) -> str:
    """Say why something is not known that looks like another place of the marker."""
    why = "by sight it cannot be told from the marker's place on the link"
    return why if fit.model.spatial else f"{why}: touch crosses"


def _of_joint(
    joint: Joint,
    key: str,
    name: str,
    unit: str,
    numbers: tuple[float, float, float],
    step: float,
    why: str = "",
) -> Measured:
    """Return the line of one number of a joint.

    Args:
        joint: whose it is.
        key: of the arm's file.
        name: for people, behind the joint's.
        unit: of the line; of "deg" the numbers are in rad.
        numbers: what it was, what was found, and its standard uncertainty.
        step: to which it is written into the file, in `unit`.
        why: it is not known, or "".
    """
    was, found, sigma = map(math.degrees, numbers) if unit == "deg" else numbers
    return Measured(
        joint.name, key, f"{joint.name}: {name}", unit, was, found, sigma, why,
        _number(found, step),
    )  # fmt: skip


def _link(fit: ArmFit, joint: Joint) -> Measured:
    model = fit.model
    is_base = model.spatial and joint is model.arm.joints[0]
    by_ruler = is_base and model.known.height is not None
    link, sigma = _estimate(fit, joint, "link")
    why = ""
    if not (by_ruler or _is_learned(fit, f"{joint.name}.link")) or sigma > LINK_LIMIT * joint.link:
        why = "too few poses tell it"
        if model.known.height is None:
            what = "base's" if model.spatial else "marker's"
            why = f"it hangs on the {what} height: measure that, --marker-height"
        if not _scaled(fit):
            why = "no board gives the scale"
        elif joint is model.arm.joints[-1]:
            why = _confusion(fit)
    name = "height" if is_base else "link"
    return _of_joint(joint, "link", name, "cm", (joint.link, link, sigma), 0.01, why)


def _zero(fit: ArmFit, joint: Joint) -> Measured:
    zero, sigma = _estimate(fit, joint, "zero")
    home = fit.value(f"{joint.name}.gear") * joint.home + zero
    why = ""
    if joint is fit.model.arm.joints[0] and fit.model.known.square is None:
        why = "no camera sees it: lay the board's edge along the arm's x, --board-square"
    elif not _is_learned(fit, f"{joint.name}.zero") or sigma > ANGLE_LIMIT:
        why = _confusion(fit)
    return _of_joint(joint, "home", "home (its zero)", "deg", (joint.home, home, sigma), 0.1, why)


def _backlash(fit: ArmFit, joint: Joint) -> Measured:
    backlash, sigma = _estimate(fit, joint, "backlash")
    backlash = max(backlash, 0.0)
    why = "" if sigma <= ANGLE_LIMIT else "gravity presses the link to one side at all poses"
    numbers = joint.backlash, backlash, sigma
    return _of_joint(joint, "backlash", "backlash", "deg", numbers, 0.1, why)


def _gear(fit: ArmFit, joint: Joint) -> Measured:
    gear, sigma = _estimate(fit, joint, "gear")
    numbers = joint.gear, joint.gear * gear, joint.gear * sigma
    return _of_joint(joint, "gear", "gear", "turns", numbers, 0.001)


def _of_marker(fit: ArmFit) -> list[Measured]:
    """Return the lines of marker, height and tilt."""
    rows = []
    offset = [fit.value("marker.along"), fit.value("marker.aside")]
    text = " ".join(_number(value, 0.01) for value in offset)
    names = ("marker.along", "marker.aside")
    known = all(_is_learned(fit, name) and fit.sigma(name) <= OFFSET_LIMIT for name in names)
    why = "touch crosses with the pen"
    if known or fit.model.spatial:
        why = "" if known else "by sight it cannot be told from the last link"
    for k, (name, where) in enumerate(zip(names, ("beyond the pen", "left of it"), strict=True)):
        rows.append(
            Measured(
                "arm", "marker_offset" if k == 0 else "", f"marker: {where}", "cm",
                fit.model.arm.marker_offset[k], offset[k], fit.sigma(name), why,
                text if k == 0 else "",
            )
        )  # fmt: skip
    if not fit.model.spatial and _scaled(fit):
        mean = fit.model.mean[fit.model.index("marker.height")]
        rows.append(
            Measured(
                "", "", "marker: over the table", "cm", mean, fit.value("marker.height"),
                fit.sigma("marker.height"),
            )
        )  # fmt: skip
    for axis in "xy" if fit.model.spatial else "":
        name = f"base.tilt_{axis}"
        rows.append(
            Measured(
                "", "", f"base: tilt about {axis}", "deg", 0.0, math.degrees(fit.value(name)),
                math.degrees(fit.sigma(name)),
            )
        )  # fmt: skip
    return rows


def _is_learned(fit: ArmFit, name: str) -> bool:
    spread = fit.model.spread[fit.model.index(name)]
    return bool(spread > 0 and fit.sigma(name) < MAX_UNCERTAINTY_SHARE * spread)


def _scaled(fit: ArmFit) -> bool:
    """Return whether a board gave the scale."""
    return bool(fit.model.spread[fit.model.index("board.x")] > 0)


def _number(value: float, step: float) -> str:
    digits = max(0, round(-math.log10(step)) + 1)
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def check_scale(fit: ArmFit, bar: float | None) -> None:
    """Refuse links that all differ alike while nobody has measured the board.

    Raises:
        BadIdentification: so it is.
    """
    if bar is not None or not _scaled(fit):
        return
    shares, sigmas = {}, []
    for joint in fit.model.arm.joints[1 if fit.model.spatial else 0 :]:
        sigma = fit.sigma(f"{joint.name}.link") / joint.link
        if sigma <= LINK_LIMIT:  # what is not known is not of another length
            shares[joint.name] = fit.value(f"{joint.name}.link") / joint.link
            sigmas.append(sigma)
    if not shares:
        return
    mean = sum(shares.values()) / len(shares)
    alike = max(shares.values()) - min(shares.values()) < MAX_SCALE_SPREAD
    if abs(mean - 1) > max(MIN_SCALE_ERROR, 2 * min(sigmas)) and alike:
        which = "all links are" if len(shares) > 1 else f"the link of the {min(shares)} is"
        more = "longer" if mean > 1 else "shorter"
        raise BadIdentification(
            f"by the board {which} {100 * abs(mean - 1):.1f} % {more} than the arm's file "
            f"says: a board whose bar is {100 / mean:.1f} mm long instead of 100 would explain "
            "that; measure its bar with a ruler and give it, --bar; nothing was written"
        )


def check_signs(fit: ArmFit) -> None:
    """Refuse an arm whose joints turn the other way round than its file says.

    Raises:
        BadIdentification: so it is.
    """
    wrong = [
        joint.name
        for joint, sign in zip(fit.model.arm.joints, fit.model.signs, strict=True)
        if sign < 0
    ]
    if wrong:
        raise BadIdentification(
            f"the {' and the '.join(wrong)} turns the other way round than the arm's file says "
            "(direction), or the picture is mirrored: driver.py check finds out; "
            "nothing was written"
        )


def check_square(fit: ArmFit) -> None:
    """Refuse a first joint whose zero is a quarter beside what it should be, or more.

    Raises:
        BadIdentification: so it is.
    """
    square = fit.model.known.square
    joint = fit.model.arm.joints[0]
    zero = fit.value(f"{joint.name}.zero")
    if square is None or abs(zero) <= MAX_ZERO_SHIFT:
        return
    likely = 90 * round((square - 2 * zero / math.pi) % 4) % 360
    raise BadIdentification(
        f"by the board the {joint.name}'s zero is {math.degrees(zero):.0f} deg beside where it is "
        f"believed; --board-square {likely} instead of {90 * square} would explain most of it: "
        "look how the board lies; nothing was written"
    )


def write_measured(
    fit: ArmFit, rows: Sequence[Measured], today: date, file: Path | None = None
) -> WrittenArm:
    """Write the arm's file with what was measured, each number's uncertainty in its comment.

    Args:
        fit: whose arm it is.
        rows: of it.
        today: named in the comments.
        file: to be written; None: the arm's own, or one's own copy of one that comes along.

    Returns:
        The file, and what it was before.

    Raises:
        BadIdentification: nothing is known better than before.
        ArmNotWritten: it cannot be written; all is as it was.
    """
    new = [row for row in rows if row.text and row.key and not row.why]
    if not new:
        raise BadIdentification(
            "nothing is known better than before; show the board, and touch crosses: nothing was "
            "written"
        )
    values = {(row.section, row.key): row.text for row in new}
    sigmas = {(row.section, row.key): f"{row.sigma:.2g}" for row in new}
    if ("arm", "marker_offset") in sigmas:  # two numbers in one line
        sigmas["arm", "marker_offset"] += f" {fit.sigma('marker.aside'):.2g}"
    notes = {
        (row.section, row.key): f"+- {sigmas[row.section, row.key]} {row.unit}, seen by a camera "
        f"{today}"
        for row in new
    }
    return write_values(fit.model.arm, values, file, notes)
