"""The commands of `driver.py` for jobs: draw one, give it orders, list them."""

import os
import re
import sys

from robot import program
from robot.command_line import Parser, number_in
from shared.arm_description import ArmError
from shared.state import default_arm

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Optional, Sequence, Tuple, Union  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.command_line import Values  # noqa: F401
    from robot.jobs.logbook import LogFile  # noqa: F401
    from robot.jobs.orders import Buttons, Keys  # noqa: F401
    from robot.jobs.progress import SavedProgress  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401
    from shared.job import Job  # noqa: F401

COMMANDS = ("job", "jobs", "order")
"""Names of the commands that are here."""

EXAMPLES = """\
  driver.py job rose
  driver.py job rose.job --resume
  driver.py order pause
  driver.py order speed 60"""
"""Examples in the help."""

CHECK_REPORT_PERIOD = 3.0
"""Period of the lines on how far the check of a job is, s."""

RUNNING = ("drawing", "paused")
"""States of a job that is not over."""


def _share(text):
    # type: (str) -> float
    return number_in(0, 100, "%")(text[:-1] if text.endswith("%") else text)


def _times(text):
    # type: (str) -> int
    return int(number_in(1, 10000, "times")(text))


def _parser():
    # type: () -> Parser
    parser = Parser(
        "driver.py", "Draw what a laptop has planned: a job file, stroke by stroke.", EXAMPLES
    )
    add = parser.add_command
    job = add("job", "draw a job: a file, or its name in the folder of jobs")
    job.add_argument("file", metavar="FILE")
    job.add_argument(
        "--arm", default=default_arm(), metavar="FILE",
        help="arm file (default: $BRICKSERVO_ARM, else planar)",
    )  # fmt: skip
    job.add_argument(
        "--resume", action="store_true",
        help="go on with the stroke that was under way, after a crash or a stop",
    )  # fmt: skip
    job.add_argument(
        "--from", dest="share", type=_share, metavar="PERCENT",
        help="begin with the stroke that lies at so much of its length, like 40%%",
    )  # fmt: skip
    job.add_argument(
        "--repeat", type=_times, metavar="N", help="draw it so many times (default: once)"
    )
    job.add_argument(
        "--speed-percent", type=number_in(25, 100, "%"), default=100.0, metavar="PERCENT",
        help="of the planned speed (default: 100)",
    )  # fmt: skip
    job.add_argument(
        "--paused", action="store_true",
        help="wait over the first point, pen up, until it is resumed: there it can be nudged",
    )  # fmt: skip
    job.add_argument("--dry", action="store_true", help="the pen stays up")
    job.add_argument(
        "--log", metavar="FILE", help="where the motors were, if the job asks for that: as CSV"
    )
    job.add_argument("--stay", action="store_true", help="stay where it ends, see other commands")
    program.add_take(job)
    order = add("order", "tell the job that is drawn: pause, resume, abort, speed 60, pen -5, ...")
    order.add_argument("words", nargs="+", metavar="ORDER")
    jobs = add("jobs", "list the jobs that are here, and the one that is drawn")
    jobs.add_argument("name", nargs="?", default="", metavar="NAME")
    jobs.add_argument("--remove", action="store_true", help="remove the job NAME")
    jobs.add_argument("--json", action="store_true", help="a line of JSON each")
    return parser


# ---- driver.py job


def _job(parser, args):
    # type: (Parser, Values) -> int
    from robot.clock import Clock
    from robot.jobs.orders import JobOrders, orders_file
    from robot.jobs.progress import find_job, load_progress
    from robot.jobs.report import JobReport, status_file
    from robot.jobs.runner import JobRunner
    from shared.arm_description import find_arm, read_arm
    from shared.job import Job

    if args.resume and args.share is not None:
        parser.error("--resume knows where to go on; leave it or --from out")
    clock = Clock()
    description = read_arm(find_arm(args.arm))
    job = Job(find_job(args.file), description)
    header = job.header
    first, repeat, progress = 1, 1, None
    if args.resume:
        progress = load_progress(job.crc, header.strokes)
        first, repeat = progress.stroke, progress.repeat
        if first > header.strokes:
            first, repeat = 1, repeat + 1
    elif args.share is not None:
        first = job.stroke_at(args.share / 100)
    repeats = max(args.repeat or 1, repeat)
    _check(job, description, clock)
    arm = program.connect(description, clock, args.take)
    with program.parking(arm):
        arm.load_zero()
        print("{}: {}, {:.0f} cm, {}".format(
            header.name, in_strokes(header.strokes), header.cm, in_minutes(header.seconds)
        ))  # fmt: skip
        paused = args.paused
        if progress:
            paused = _report_resumed(arm, job, progress, first) or paused
        elif args.share is not None:
            print("begins with stroke {} of {}".format(first, header.strokes))
        presses = _presses()
        orders = JobOrders(args.speed_percent / 100, paused, presses, orders_file())
        log = None
        try:
            if progress:
                orders.pen = progress.pen
            log = _log_file(args.log, len(header.links))
            report = JobReport(header, job.crc, clock, repeats, path=status_file())
            runner = JobRunner(arm, clock, job, orders, report, log, args.dry)
            done = runner.run(first, repeat, repeats)
        finally:
            for source in presses + ([log] if log else []):
                source.close()
            orders.close()
        if not args.stay:
            from robot.drawing import Driver

            Driver(arm).go_low()
    return 0 if done else 1


def _check(job, description, clock):
    # type: (Job, Arm, Clock) -> None
    """Refuse, by BadJob, an unfit stroke before anything moves; that takes the brick long."""
    from robot.jobs.checking import check_strokes

    reported_at = clock.now()
    for k in check_strokes(job, description):
        if clock.now() > reported_at + CHECK_REPORT_PERIOD:
            reported_at = clock.now()
            print("looked through {} of {}".format(k, in_strokes(job.header.strokes)))


def _log_file(path, joints):
    # type: (Optional[str], int) -> Optional[LogFile]
    """Return the log to write to a path, for an arm of so many joints, or None.

    Raises:
        BadLog: it cannot be written.
    """
    if path is None:
        return None
    from robot.jobs.logbook import LogFile

    return LogFile(path, joints)


def _report_resumed(arm, job, progress, first):
    # type: (RobotArm, Job, SavedProgress, int) -> bool
    """Print where it goes on, and how well that will fit; return whether to wait for a nudge."""
    from robot.jobs.runner import max_offset

    zeros = arm.motors.zeros()
    same = zeros == progress.zeros
    stroke = job.stroke(first)
    off = 10 * max_offset(arm.description, arm.joints, stroke, same)
    print("goes on with stroke {} of {}".format(first, job.header.strokes))
    if same:
        print(
            "the zero is that of before: the two parts may be up to {:.1f} mm apart, which is what "
            "the encoders count".format(off)
        )
        return False
    print(
        "the zero was found anew: the two parts may be up to {:.1f} mm apart; nudge the tip by the "
        "arrows where it does not meet what is drawn".format(off)
    )
    return _is_somebody_there()


def _is_somebody_there():
    # type: () -> bool
    from robot.asking import Person

    if Person(None).at_brick:
        return True
    try:
        return os.isatty(sys.stdin.fileno())
    except (OSError, ValueError, AttributeError):
        return False


def _presses():
    # type: () -> List[Union[Buttons, Keys]]
    """Return the sources of presses: the brick's buttons, and the keys of a terminal."""
    from robot.asking import Person
    from robot.jobs.orders import Buttons, Keys

    found = []  # type: List[Union[Buttons, Keys]]
    for kind in (Buttons, Keys):
        try:
            found.append(kind())
        except (ImportError, OSError, ValueError, AttributeError):
            continue  # not on a brick; no terminal
    if Person(None).at_brick:
        print("CENTRE: pause, resume\nUP, DOWN: speed\narrows in a pause: nudge\nBACK ends.")
    elif found and isinstance(found[-1], Keys):
        print("Enter: pause, resume; up, down: speed; arrows in a pause: nudge; Ctrl-C: stop")
    return found


def in_strokes(count):
    # type: (int) -> str
    """Return a number of strokes in words."""
    return "1 stroke" if count == 1 else "{} strokes".format(count)


def in_minutes(seconds):
    # type: (float) -> str
    """Return a time, s, as minutes and seconds for people."""
    seconds = int(round(seconds))
    return "{}:{:02d}".format(seconds // 60, seconds % 60)


# ---- driver.py order


class NothingRuns(ArmError):
    """There is no job that an order could be for."""


def _status():
    # type: () -> Tuple[Dict[str, Any], bool]
    """Return the contents of the status file (a dict), and whether that job is drawn now."""
    from robot.jobs.report import status_file
    from shared.config_files import InvalidFile, read_json

    try:
        status = read_json(status_file())
        state, pid = status["state"], int(status["pid"])
    except (OSError, InvalidFile, KeyError, TypeError, ValueError):
        return {}, False
    return status, state in RUNNING and _is_alive(pid)


def _is_alive(pid):
    # type: (int) -> bool
    if os.name == "nt":  # there a signal 0 would end it
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # another user's
    return True


def _order(args):
    # type: (Values) -> int
    from robot.jobs.orders import orders_file, read_order
    from shared.config_files import open_to_write

    text = " ".join(one.strip() for one in args.words)
    read_order(text)
    status, runs = _status()
    if not runs:
        raise NothingRuns("no job is drawn now; start one: driver.py job FILE")
    with open(open_to_write(orders_file(), os.O_APPEND), "a") as file:
        file.write(text + "\n")
    print("{}: told {}".format(text, status.get("job", "the job")))
    return 0


# ---- driver.py jobs


def _jobs(parser, args):
    # type: (Parser, Values) -> int
    import json

    from robot.jobs.progress import NoJob, find_job, forget_progress, jobs_folder, load_progress
    from shared.job import Job
    from shared.job_pieces import BadJob

    status, runs = _status()
    if args.remove:
        if not args.name:
            parser.error("--remove takes the NAME of a job")
        path = find_job(args.name)
        if os.path.dirname(os.path.abspath(path)) != os.path.abspath(jobs_folder()):
            raise NoJob("{} is not in {}; remove it by hand".format(path, jobs_folder()))
        try:
            crc = Job(path).crc
        except BadJob:
            crc = None
        if runs and status.get("crc") == crc:
            raise NoJob("{} is being drawn; first: driver.py order abort".format(args.name))
        if crc is not None:
            forget_progress(crc)
        os.remove(path)
        print("removed {}".format(path))
        return 0
    try:
        names = sorted(name for name in os.listdir(jobs_folder()) if name.endswith(".job"))
    except OSError:
        names = []
    if args.name:
        names = [os.path.abspath(find_job(args.name))]
    for name in names:
        facts = {"file": os.path.splitext(os.path.basename(name))[0]}  # type: Dict[str, Any]
        try:
            job = Job(os.path.join(jobs_folder(), name))
            facts.update(job.header._asdict(), crc=job.crc, state="", next=1)
            if runs and status.get("crc") == job.crc:
                facts.update(state=status["state"], left_s=status.get("left_s"))
            else:
                progress = load_progress(job.crc, job.header.strokes)
                facts.update(state="begun", next=progress.stroke)
        except NoJob:
            pass
        except BadJob as problem:
            facts.update(state="spoilt", reason=str(problem))
        print(json.dumps(facts, sort_keys=True) if args.json else _in_words(facts))
    if not names and not args.json:
        print("no jobs in {}".format(jobs_folder()))
    return 0


def _in_words(facts):
    # type: (Dict[str, Any]) -> str
    if "strokes" not in facts:
        return "{}: {}".format(facts["file"], facts["reason"])
    state = facts["state"] and {
        "begun": "begun, goes on with stroke {next}: driver.py job {file} --resume"
    }.get(facts["state"], "{state} now").format(**facts)
    return "{}: {}, {:.0f} cm, {}{}".format(
        facts["file"], in_strokes(facts["strokes"]), facts["cm"], in_minutes(facts["seconds"]),
        state and "; " + state,
    )  # fmt: skip


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Run one command; return the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    # A leading space tells argparse that "-5" is a number and not an option.
    argv = [" " + arg if re.match(r"-(\d|\.)", arg) else arg for arg in argv]
    parser = _parser()
    args = parser.parse_args(argv)
    status = []

    def command():
        # type: () -> None
        if args.command == "order":
            status.append(_order(args))
        elif args.command == "jobs":
            status.append(_jobs(parser, args))
        else:
            status.append(_job(parser, args))

    return program.run(parser.prog, command) or status[0]
