"""Aim, method and questions of a report, by the kinds of runs in it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from markupsafe import Markup

from laptop.record.figures.formulas import formula, matrix
from laptop.record.run import ACCURACY, CALIBRATION, DRAWING, SERVO, TRACKING
from shared.run_options import SERVO_METHODS, ServoMethod

AIMS = {
    DRAWING: "to let the arm draw what is given, and to measure how far the ink is from it",
    SERVO: "to bring the tip to goals that a camera sees, without a calibrated camera",
    ACCURACY: "to measure by a camera how accurately and how repeatably the arm moves",
    CALIBRATION: "to find the arm's own numbers from what a camera sees of its motion",
    TRACKING: "to follow markers in a camera's pictures",
}
"""Aims by kind of run, as parts of a sentence."""
QUESTIONS = {
    DRAWING: (
        "Where along the path is the deviation greatest? What do the joints do there?",
        "Compare the deviation with what half an encoder count is worth at the tip. What else "
        "adds to it?",
        "Which of the arms or settings is better, and by how much? Is the difference greater than "
        "that of two runs alike?",
    ),
    SERVO: (
        "How many moves pass before the error falls steadily, and what does the arm learn in them?",
        "What does the condition number of the image Jacobian say about the poses on the way?",
        "Compare what the servo says at the end with what is known of the true place.",
    ),
    ACCURACY: (
        "Which is greater, the error of accuracy or that of repeatability? What follows for "
        "calibrating the arm?",
    ),
    CALIBRATION: ("Which numbers are certain, which are not? Why can the camera not see these?",),
    TRACKING: ("When was a marker not seen, and why?",),
}
"""Questions of the discussion by kind of run."""
LAST_QUESTION = "Which errors of the measurement itself are there, and how large are they?"


class MethodStep(NamedTuple):
    """A paragraph of the method, and the formulas under it."""

    title: str
    text: str
    formulas: tuple[Markup, ...]


PARAGRAPHS = {
    "lab-step": (
        "The lab report's step (method {})",
        "Each step is solved for exactly, and cut to 10, 5 or 2 degrees, the less the nearer "
        "the goal is. J is corrected by Broyden's update.",
        r"J\, \Delta q = -e",
    ),
    "least-squares": (
        "Step (method {})",
        "Each step is a least-squares solution inside a region in which the prediction is "
        "trusted, and inside the joints' limits.",
        r"\min_{\Delta q} \ \|e + J\, \Delta q\|^2",
    ),
    "broyden": (
        "Broyden's update",
        "After each step J is corrected by the least change with which it explains what was seen.",
        r"J \leftarrow J + \dfrac{(\Delta s - J\, \Delta q)\, \Delta q^T}"
        r"{\Delta q^T \Delta q}",
    ),
    "kalman": (
        "Broyden's update, weighted by a Kalman filter",
        "P says how uncertain J is, \u03c3 is the noise of what is seen. A long move teaches "
        "almost all that it shows, as Broyden's update does, a short one next to nothing.",
        r"J \leftarrow J + \dfrac{(\Delta s - J\, \Delta q)\, (P\, \Delta q)^T}"
        r"{\Delta q^T P\, \Delta q + \sigma^2}",
    ),
    "chain": (
        "The image of a chain of joints",
        "What a camera sees of the tip is all but linear in where it is, and that is known by the "
        "arm's lengths: t holds 1 and the tip's coordinates. W is fitted to what was seen, each "
        "picture k weighted by its noise and by how near the arm is.",
        r"\min_W \ \sum_k w_k \|s_k - W\, t(q_k)\|^2 \qquad J = W\, \dfrac{\partial t}{\partial q}",
    ),
}
"""Paragraphs of the methods of servoing by the names that shared.run_options.ServoMethod has, in
the order of the report: title with the methods' names, text, formula in TeX."""


def aim(kinds: Collection[str]) -> str:
    """Return the aim of the kinds of runs, a sentence."""
    parts = [text for kind, text in AIMS.items() if kind in kinds]
    if not parts:
        parts = ["to run programs on the arm and to see what it does"]
    return f"The aim is {'; '.join(parts)}."


def questions(kinds: Collection[str]) -> list[str]:
    """Return the questions that a discussion is to answer."""
    return [*(q for kind, them in QUESTIONS.items() if kind in kinds for q in them), LAST_QUESTION]


def method(
    chains: Collection[str], kinds: Collection[str], servo_methods: Collection[str]
) -> Iterator[MethodStep]:
    """Yield the method of the runs, step by step.

    Args:
        chains: of the arms that are known: "planar", "spatial".
        kinds: of the runs.
        servo_methods: that servo runs used.
    """
    if "planar" in chains:
        yield from _planar()
    if "spatial" in chains:
        yield from _spatial()
    if DRAWING in kinds:
        yield _deviation()
    if SERVO in kinds:
        yield from _servoing(servo_methods)
    if ACCURACY in kinds:
        yield _accuracy()
    if CALIBRATION in kinds:
        yield MethodStep(
            "Calibration",
            "The numbers \u03b8 of arm and camera are those with which the tip is predicted where "
            "the camera saw it: s is what was seen, \u0161 what \u03b8 predicts, \u03c3 the noise. "
            "\u03c1 is a loss that gives outliers little weight.",
            (
                _set(
                    r"\min_\theta \ \sum_i \rho\left("
                    r"\dfrac{\|s_i - \hat{s}_i(\theta)\|^2}{\sigma^2}\right)"
                ),
            ),
        )


def _set(*tex: str) -> Markup:
    return formula(r" \qquad ".join(tex))


def _planar() -> Iterator[MethodStep]:
    yield MethodStep(
        "Forward kinematics of the arm in the plane",
        "q1 is the angle of the upper arm from x, q2 that of the forearm from the upper arm; l1 "
        "and l2 are their lengths. The tip is at",
        (
            _set(
                r"x = l_1 \cos q_1 + l_2 \cos(q_1 + q_2)",
                r"y = l_1 \sin q_1 + l_2 \sin(q_1 + q_2)",
            ),
        ),
    )
    yield MethodStep(
        "Inverse kinematics of the arm in the plane",
        "With r the distance of the point from the shoulder there are two poses, one for each sign "
        "(the law of cosines, by the tangent of the half angle).",
        (
            _set(
                r"q_2 = \pm 2\, \mathrm{atan2}\left(\sqrt{(l_1 + l_2)^2 - r^2},\ "
                r"\sqrt{r^2 - (l_1 - l_2)^2}\right)"
            ),
            _set(
                r"q_1 = \mathrm{atan2}(y,\, x) - "
                r"\mathrm{atan2}(l_2 \sin q_2,\ l_1 + l_2 \cos q_2)",
            ),
        ),
    )
    yield MethodStep(
        "Jacobian of the arm in the plane",
        "It says how the tip follows a small turn of the joints. The arm is singular where its "
        "determinant is 0: stretched or folded.",
        (
            _set(
                r"\Delta p \approx J\, \Delta q",
                "J = "
                + matrix(
                    r"-l_1 \sin q_1 - l_2 \sin(q_1 + q_2)",
                    r"-l_2 \sin(q_1 + q_2)",
                    r"l_1 \cos q_1 + l_2 \cos(q_1 + q_2)",
                    r"l_2 \cos(q_1 + q_2)",
                ),
            ),
            _set(r"\det J = l_1 l_2 \sin q_2"),
        ),
    )


def _spatial() -> Iterator[MethodStep]:
    yield MethodStep(
        "Forward kinematics of the arm in space",
        "q1 turns the base, q2 is the pitch of the upper arm from level, q3 that of the forearm "
        "from the upper arm; h is the height of the shoulder's axis. With r the distance of the "
        "tip from the base's axis:",
        (
            _set(
                r"r = l_1 \cos q_2 + l_2 \cos(q_2 + q_3)",
                r"z = h + l_1 \sin q_2 + l_2 \sin(q_2 + q_3)",
            ),
            _set(r"x = r \cos q_1", r"y = r \sin q_1"),
        ),
    )
    yield MethodStep(
        "Inverse kinematics of the arm in space",
        "The base faces the point; in the upright plane through it the two links bend as an arm in "
        "the plane does, with d the distance of the point from the shoulder.",
        (
            _set(
                r"q_1 = \mathrm{atan2}(y,\, x)",
                r"r = \sqrt{x^2 + y^2}",
                r"d = \sqrt{r^2 + (z - h)^2}",
            ),
            _set(
                r"q_3 = \pm 2\, \mathrm{atan2}\left(\sqrt{(l_1 + l_2)^2 - d^2},\ "
                r"\sqrt{d^2 - (l_1 - l_2)^2}\right)"
            ),
            _set(
                r"q_2 = \mathrm{atan2}(z - h,\, r) - "
                r"\mathrm{atan2}(l_2 \sin q_3,\ l_1 + l_2 \cos q_3)"
            ),
        ),
    )
    yield MethodStep(
        "Jacobian of the arm in space",
        "It says how the tip follows a small turn of the joints. The arm is singular where its "
        "determinant is 0: stretched, folded, or with the tip over the base's axis.",
        (
            _set(
                r"\Delta p \approx J\, \Delta q",
                r"J = \left[\, \partial p / \partial q_1 \quad \partial p / \partial q_2 "
                r"\quad \partial p / \partial q_3 \,\right]",
                r"|\det J| = l_1 l_2\, |r \sin q_3|",
            ),
        ),
    )


def _deviation() -> MethodStep:
    return MethodStep(
        "Deviation of a drawing",
        "The ink is compared with the path that was wanted. d is the distance of a point of the "
        "ink from the path, s the length along the ink, L its whole length. The root mean square "
        "is over length, not over time. 'Missed' is the greatest distance of the path from the "
        "ink.",
        (
            _set(
                r"d_{\mathrm{greatest}} = \max_s\, d(s)",
                r"d_{\mathrm{rms}} = \sqrt{\dfrac{1}{L} \int_0^L d(s)^2\, ds}",
            ),
        ),
    )


def _servoing(methods: Collection[str]) -> Iterator[MethodStep]:
    yield MethodStep(
        "Image Jacobian",
        "The camera's picture s of the tip follows the joints. The error e is what is to vanish; "
        "s* is the goal in the picture. Neither the camera nor the arm need be calibrated: J is "
        "estimated from moves, first from a short one of each joint.",
        (
            _set(
                r"e = s - s^*",
                r"\Delta s \approx J\, \Delta q",
                r"J = \dfrac{\partial s}{\partial q}",
            ),
        ),
    )
    used = [method for method in reversed(SERVO_METHODS) if method.name in methods]
    for name, paragraph in PARAGRAPHS.items():
        told = [method for method in used if name in method.paragraphs.split()]
        if told or (name == "broyden" and not methods):
            names = " and ".join(method.name for method in told)
            more = [method.words for method in told if _last(method) == name and method.words]
            title, text, tex = paragraph
            yield MethodStep(title.format(names), " ".join([text, *more]), (_set(tex),))
    for method in used:
        if not method.paragraphs:
            yield MethodStep(f"Step (method {method.name})", method.words, ())


def _last(method: ServoMethod) -> str:
    """Return the name of the paragraph that a method's own words close."""
    return method.paragraphs.split()[-1]


def _accuracy() -> MethodStep:
    return MethodStep(
        "Accuracy and repeatability",
        "As ISO 9283 defines them: a pose p* is approached n times, each time the tip gets to "
        "p\u1d62, with the mean p\u0304. Accuracy is how far that mean is off, repeatability "
        "how far the poses scatter about it: the mean of the distances l and three times their "
        "standard deviation S. Of a path AT and RT are the greatest of the same, place k by place "
        "k.",
        (
            _set(
                r"AP = \|\bar{p} - p^*\|",
                r"l_i = \|p_i - \bar{p}\|",
                r"RP = \bar{l} + 3\, S_l",
            ),
            _set(
                r"AT = \max_k\, \|\bar{p}_k - p^*_k\|",
                r"RT = \max_k\, (\bar{l}_k + 3\, S_{l,k})",
            ),
        ),
    )
