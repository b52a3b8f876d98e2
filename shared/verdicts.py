"""Verdicts, the results of a run: each one's word, for wire and logs, and its text for people."""

READY = "ready"
"""Verdict before the first Start: the brick waits for it."""
REFUSED = "refused"
"""Verdict of a Start with invalid options, which began no run."""
CONVERGED = "converged"
UNREACHABLE = "unreachable"
LIMIT = "limit"
SINGULAR = "singular"
MARKER_LOST = "marker lost"
PICTURE_FROZEN = "picture frozen"
CAMERA_SLOW = "camera slow"
CAMERA_LATE = "camera late"
LINK_LOST = "link lost"
STALLED = "stalled"
TOO_SLOW = "too slow"
BUDGET_SPENT = "budget spent"
STOPPED = "stopped"

VERDICT_TEXTS = {
    "": "On its way.",
    READY: "Ready. Aim, then start.",
    CONVERGED: "Arrived: the tip is at the goal.",
    UNREACHABLE: "Out of reach: the arm cannot get there. Aim nearer to its base.",
    MARKER_LOST: "The marker is lost. Uncover it, or pick its colour anew; then start again.",
    PICTURE_FROZEN: "The picture does not change while the arm moves. Start the camera anew; then "
    "start again.",
    CAMERA_SLOW: "Too few pictures a second. Give the camera more light, or take a smaller "
    "picture; then start again.",
    CAMERA_LATE: "The pictures come too late. End what keeps the laptop busy; then start again.",
    SINGULAR: "The joints cannot move the tip that way from here. Aim elsewhere, or start from "
    "another posture.",
    LIMIT: "A joint is at its limit. Aim elsewhere.",
    STALLED: "A motor is blocked, or does not count. Free the arm, look at its cable; then home.",
    TOO_SLOW: "The brick is too slow. End other programs on it; then start again.",
    LINK_LOST: "The link was lost. Look at the cable or Wi-Fi; then start again.",
    BUDGET_SPENT: "Not there in time. Look at camera and light, or allow a greater tolerance.",
    STOPPED: "Stopped. The arm is held.",
    REFUSED: "The brick refused these orders.",
}
"""Texts for people by verdict: the result, and the next step."""
