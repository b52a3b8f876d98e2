"""The mutants: safety-relevant lines of source, a wrong one for each, and tests that must notice.

A line is known by its text, without its indentation, which its file has once.  Whoever changes such
a line changes it here, too; `python -m tests.claims mutants` shows that a test still holds it.
"""

from __future__ import annotations

from typing import NamedTuple


class Mutant(NamedTuple):
    """One line of source, replaced by a wrong one.

    Attributes:
        group: kind of what the line guards.
        what: what is broken, for people.
        file: path of the source in the repository.
        line: the true line, without its indentation; its file has it once.
        mutant: the line in its place.
        tests: paths of the tests that must notice, as for pytest.
    """

    group: str
    what: str
    file: str
    line: str
    mutant: str
    tests: tuple[str, ...]


GROUPS = ("limits", "stopping", "link", "jobs", "zero")
"""Kinds of what the lines guard, in the order of the list."""

ARM = "tests/robot/motion/test_arm.py::"
FAULTS = "tests/robot/test_faults.py::"
LINK = "tests/shared/test_link.py::"

MUTANTS = (
    Mutant(
        "limits",
        "a joint may go half as far again",
        "robot/motion/kinematics.py",
        "if not joint.lower - 1e-9 <= angle <= joint.upper + 1e-9:",
        "if not 1.5 * joint.lower - 1e-9 <= angle <= 1.5 * joint.upper + 1e-9:",
        (ARM + "test_beyond_a_limit_nothing_moves",),
    ),
    Mutant(
        "limits",
        "a path leads beyond the upper limits",
        "robot/motion/kinematics.py",
        "if not joint.lower <= angle <= joint.upper:",
        "if not joint.lower <= angle:",
        ("tests/robot/motion/test_trajectory.py::test_a_line_that_cannot_be_had_is_refused_whole",),
    ),
    Mutant(
        "limits",
        "points too near to the shoulder count as within reach",
        "robot/motion/chains.py",
        "if not hole - REACH_SLACK <= far <= outer + REACH_SLACK:",
        "if not far <= outer + REACH_SLACK:",
        ("tests/robot/motion/test_kinematics.py",),
    ),
    Mutant(
        "limits",
        "a chase goes beyond the upper limit",
        "robot/motion/online_trajectory.py",
        "aim = min(max(aim, self._limits[0]), self._limits[1])",
        "aim = max(aim, self._limits[0])",
        (ARM + "test_a_chase_goes_no_farther_than_the_limits",),
    ),
    Mutant(
        "limits",
        "a set-point is checked without room to stop",
        "robot/motion/control_loop.py",
        "or not axis.lower <= wanted + BRAKING_TIME * speed <= axis.upper",
        "or not axis.lower <= wanted <= axis.upper",
        (ARM + "test_a_set_point_that_no_joint_may_have_ends_the_motion",),
    ),
    Mutant(
        "limits",
        "a set-point may be half as fast again",
        "robot/motion/backlash.py",
        "fastest = SPEED_SLACK * joint.max_speed + 1.5 * joint.backlash / crossing_time(joint)",
        "fastest = 1.5 * SPEED_SLACK * joint.max_speed",
        (ARM + "test_a_set_point_that_no_joint_may_have_ends_the_motion",),
    ),
    Mutant(
        "stopping",
        "an error in a motion stops no motor",
        "robot/motion/arm.py",
        "self._halt()",
        "pass",
        (ARM + "test_what_a_watcher_raises_ends_the_motion_with_every_motor_held",),
    ),
    Mutant(
        "stopping",
        "a motor that does not answer keeps others from being stopped",
        "robot/motion/arm_motors.py",
        "lost = lost or error",
        "return error",
        (ARM + "test_stopping_stops_all_that_still_answer_and_then_says_who_does_not",),
    ),
    Mutant(
        "stopping",
        "a terminal that goes away ends the program at once",
        "robot/program.py",
        'signal.SIGINT: "SIGINT", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"',
        'signal.SIGINT: "SIGINT", signal.SIGTERM: "SIGTERM"',
        (FAULTS + "test_a_signal_stops_at_once",),
    ),
    Mutant(
        "stopping",
        "a silent link ends after 3 s, not 2",
        "shared/link.py",
        "SILENCE_TIMEOUT = 2.0",
        "SILENCE_TIMEOUT = 3.0",
        (
            LINK + "test_a_half_open_connection_ends_after_two_seconds",
            "tests/robot/test_tracking_client.py::"
            "test_a_tracker_that_falls_silent_is_lost_after_two_seconds",
        ),
    ),
    Mutant(
        "stopping",
        "in motion the arm goes on without seeing its marker",
        "robot/servoing/loop.py",
        "if not halt and not self._receiver.still_sees():",
        "if halt and not self._receiver.still_sees():",
        (
            "tests/robot/servoing/test_servo_faults.py::"
            "test_what_passes_holds_the_arm_and_it_goes_on",
        ),
    ),
    Mutant(
        "stopping",
        "a marker may be out of sight for half as long again",
        "robot/servoing/sightings.py",
        "SIGHT_TIMEOUT = 0.3",
        "SIGHT_TIMEOUT = 0.45",
        ("tests/robot/servoing/test_sightings.py",),
    ),
    Mutant(
        "stopping",
        "a joint that does not count may be pushed with all force for ever",
        "robot/motion/control_loop.py",
        "elif now - axis.slack_at > STALL_TIMEOUT and now - axis.stands_since > STALL_TIMEOUT:",
        "elif False:",
        (
            "tests/robot/motion/test_motion_pace.py::"
            "test_a_joint_that_stands_under_full_feedback_is_given_up_after_half_a_second",
        ),
    ),
    Mutant(
        "stopping",
        "a motor drives on for half as long again once its program is dead",
        "robot/ev3/motors.py",
        'self._set("time_sp", int(DEAD_MAN * 1000))',
        'self._set("time_sp", int(DEAD_MAN * 1500))',
        ("tests/robot/ev3/test_motors.py::test_a_set_point_that_is_not_renewed_ends_by_itself",),
    ),
    Mutant(
        "stopping",
        "a run is held after 3 s without a page, not 2",
        "laptop/page/page_watch.py",
        "if self._holds and silence > BROWSER_TIMEOUT and self._runs.is_driven:",
        "if self._holds and silence > 1.5 * BROWSER_TIMEOUT and self._runs.is_driven:",
        ("tests/laptop/page/test_controller.py",),
    ),
    Mutant(
        "stopping",
        "the gate answers, and stops nothing",
        "laptop/page/stop_gate.py",
        "why = await asyncio.to_thread(self._stop, scope[BROWSER])",
        'why = ""',
        (
            "tests/laptop/page/test_stop_gate.py::"
            "test_a_stop_is_taken_from_a_page_of_ours_which_may_read_the_answer",
        ),
    ),
    Mutant(
        "stopping",
        "a STOP that was lost with the link is not said again",
        "laptop/page/repeated_stop.py",
        "if status is not self._last_status:",
        "if status is self._last_status:",
        (
            "tests/laptop/page/test_run_control.py::"
            "test_a_stop_is_said_until_the_brick_has_heard_it",
        ),
    ),
    Mutant(
        "link",
        "a quarter of a signature is enough",
        "shared/signing.py",
        "if not self._is_same(self._tag(message), line[_TAG:]):",
        "if not self._is_same(self._tag(message)[:4], line[_TAG:][:4]):",
        ("tests/shared/test_signing.py",),
    ),
    Mutant(
        "link",
        "a line that is said again passes",
        "shared/signing.py",
        "self._count += 1",
        "pass",
        (LINK + "test_a_line_that_is_not_the_next_one_ends_the_connection_on_both_sides",),
    ),
    Mutant(
        "link",
        "a stranger is obeyed before it has proven who it is",
        "shared/link.py",
        "if isinstance(message, _HANDSHAKE) == self.proven and not isinstance(message, Bye):",
        "if isinstance(message, _HANDSHAKE) and self.proven and not isinstance(message, Bye):",
        (LINK + "test_a_stranger_that_says_anything_but_the_handshake_is_cut_off",),
    ),
    Mutant(
        "link",
        "a tracker with a wrong key is believed",
        "robot/tracking.py",
        "if pairing.is_proof(message.proof, self._key.key, LAPTOP, ours, theirs):",
        "if message.proof:",
        (
            "tests/robot/test_tracking_client.py::"
            "test_a_tracker_that_does_not_know_the_code_is_refused",
        ),
    ),
    Mutant(
        "link",
        "a sighting may be half as old again",
        "shared/newest_observations.py",
        "fresh = {camera: seen for camera, seen in self._slots.items() if now - seen.t <= max_age}",
        "fresh = {c: seen for c, seen in self._slots.items() if now - seen.t <= 1.5 * max_age}",
        (
            LINK + "test_a_stale_observation_is_dropped",
            LINK + "test_an_observation_that_goes_stale_while_it_waits_is_not_handed_over",
        ),
    ),
    Mutant(
        "jobs",
        "a job that was changed on its way is drawn",
        "shared/job.py",
        'if end["crc"] != crc & 0xFFFFFFFF or not isinstance(end["crc"], int):',
        'if not isinstance(end["crc"], int):',
        ("tests/shared/test_job.py::test_a_file_that_was_cut_off_or_changed_is_no_job",),
    ),
    Mutant(
        "jobs",
        "what turns back at its end is checked at its end only",
        "shared/job_pieces.py",
        "s = end if v_end >= 0 else -0.5 * v * v / a",
        "s = end",
        (
            "tests/shared/test_job.py::"
            "test_what_turns_back_at_its_very_end_is_looked_at_as_far_as_it_goes",
        ),
    ),
    Mutant(
        "jobs",
        "a job may go half as deep again into the table",
        "robot/jobs/checking.py",
        "if lowest < -MAX_DEPTH:",
        "if lowest < 1.5 * -MAX_DEPTH:",
        (
            "tests/robot/jobs/test_checking.py::test_no_part_goes_deeper_into_the_table_than_half_a_centimetre",
        ),
    ),
    Mutant(
        "jobs",
        "what a camera has taught is not checked against the limits",
        "robot/jobs/learned.py",
        "check_joints(job, k, out, joints, between, MAX_ACCELERATION)",
        "pass",
        (
            "tests/robot/jobs/test_learned.py",
            "tests/robot/test_job_commands.py::"
            "test_a_hostile_offset_is_refused_before_anything_moves",
        ),
    ),
    Mutant(
        "jobs",
        "a job from the laptop is drawn without a check of its last stroke",
        "robot/jobs/linked.py",
        "for _ in check_strokes(job, description):",
        "for _ in ():",
        (
            "tests/robot/jobs/test_linked.py::test_its_last_stroke_is_looked_at_before_the_first_is_drawn",
        ),
    ),
    Mutant(
        "jobs",
        "a job goes on though the link is lost",
        "robot/jobs/linked.py",
        "self._paused_by_link, orders.paused = True, True",
        "self._paused_by_link, orders.paused = True, False",
        (
            "tests/robot/jobs/test_linked.py::"
            "test_a_lost_link_pauses_it_until_it_is_back_and_resumed",
        ),
    ),
    Mutant(
        "zero",
        "a motor of an arm that was never homed turns",
        "robot/motion/arm.py",
        "self._engage(self._zero_needed)",
        "self._engage(False)",
        (
            "tests/robot/test_unhomed.py::"
            "test_a_program_of_ones_own_does_not_move_an_arm_that_was_never_homed"
            "[arm.move_motor(arm.joints[0], JointMove([0], [0.5], [1]))]",
        ),
    ),
    Mutant(
        "zero",
        "after motors were lent, they turn without a zero",
        "robot/motion/arm.py",
        "self._zero_needed = True",
        "pass",
        (
            "tests/robot/motion/test_arm_zero.py::test_once_motors_are_given_back_nothing_moves_without_a_zero",
        ),
    ),
    Mutant(
        "zero",
        "motors that were reset while a program waited are driven",
        "robot/motion/arm_motors.py",
        "check_not_reset(self.counts(), self._rest)",
        "pass",
        (
            "tests/robot/motion/test_arm_zero.py::"
            "test_a_reset_while_a_program_waits_is_noticed_before_anything_moves",
        ),
    ),
    Mutant(
        "zero",
        "after a stall the zero is believed still",
        "robot/motion/arm.py",
        "self.motors.doubt_zeros(error.fact)",
        "pass",
        (
            "tests/robot/motion/test_arm_zero.py::"
            "test_after_a_stall_nothing_moves_and_the_stall_is_the_cause",
        ),
    ),
    Mutant(
        "zero",
        "after a homing that was not finished an older zero is believed",
        "robot/motion/arm.py",
        "self.zero.forget()",
        "pass",
        (
            "tests/robot/motion/test_homing.py::"
            "test_an_arm_that_had_a_zero_loses_it_when_homing_fails",
            FAULTS + "test_after_an_unfinished_homing_no_older_zero_is_believed",
        ),
    ),
    Mutant(
        "zero",
        "a dead encoder is taken for a stop",
        "robot/motion/stops.py",
        'raise Stalled(motor, "it does not set out")',
        "return",
        (FAULTS + "test_homing_takes_no_dead_encoder_for_a_stop",),
    ),
    Mutant(
        "zero",
        "a joint that stands is called one that turns",
        "robot/servoing/stall_diagnosis.py",
        "if abs(turn) > max(uncertainty, least):",
        "if abs(turn) > uncertainty:",
        ("tests/robot/servoing/test_stall_diagnosis.py",),
    ),
)
