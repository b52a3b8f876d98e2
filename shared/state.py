"""Channels between processes: environment variables, and files in this user's state folder.

    variable          written by                   read by                  meaning
    BRICKSERVO_STATE  people, simulate,            all                      the state folder;
                      demo, bench                                           if unset ~/.brickservo
    BRICKSERVO_ARM    people, simulate,            driver, visual_servoing, arm, its name or file;
                      demo, bench                  bench_brick, simulate,   if unset planar
                                                   demo, track
    BRICKSERVO_PROGRAM laptop's commands           all                      what people type for
                                                                            these; if unset
                                                                            brickservo
    BRICKSERVO_PLAN   simulate                     driver, other scripts    file to append the
                                                                            wanted paths to;
                                                                            if unset nobody watches
    BRICKSERVO_PURE   people                       the emulator            1: without its compiled
                                                                            modules
    BRICKSERVO_LOCK   simulate --realtime          whatever may move        file whose lock is the
                                                   motors                   right to move them; if
                                                                            unset, their own folder
    SSH_CLIENT,       sshd, simulate               visual_servoing,         where the laptop is
    SSH_CONNECTION                                 tracking_client

    file              written by                   read by                  meaning
    pairing           track                        track                    this laptop's code, salt
    markers.ini       track and its page           track                    learned markers
    tracker           visual_servoing,             the same                 the laptop's address
                      tracking_client                                       and code, and its key
    ARM.json          driver, visual_servoing      the same                 zero of an arm, and the
                                                                            numbers that it is of
    ARM.checked       driver                       driver, visual_servoing  which motor is where
                                                                            was looked at for these
    ARM.cameras       visual_servoing              the same                 what its last success
                                                                            has seen, see
                                                                            robot.servoing.
                                                                            camera_memory
    arms/             driver, people, brick        whoever reads an arm     arms of one's own, by
                                                                            name
    live/             simulate --realtime          synthetic cameras        pose of the arm, ink:
                                                                            a file for each run
    clock             whoever comes first of       the same, demo           time of the emulated
                      simulate and cameras                                  world
    emulated-motors   simulate --realtime          the same                 locked by who may move
                                                                            the arm; empty
    emulated-brick/   track: its own brick         people                   what that brick said
    brick             brick                        brick                    the last real brick
    brick-runs/       brick                        the same, people         what programs on bricks
                                                                            have said
    brick.txt         track's page                 people                   what a brick that it
                                                                            called has said
    jobs/             brick, people, driver        driver                   NAME.job: drawings, see
                                                                            shared.job; and how far
                                                                            each has come
    jobs/status       driver                       driver, brick            how the job that is
                                                                            drawn goes, or how the
                                                                            last one ended; see
                                                                            robot.jobs.report
    jobs/orders       driver, brick, people        driver                   orders to it, appended
                                                                            line by line; see
                                                                            robot.jobs.orders
    learned/          draw --by-sight              the same                 what a camera has taught
                                                                            of a path: see
                                                                            laptop.measure.ilc
    touched/          touch                        whoever places markers   ARM.json: where its
                                                                            marker sits, how it
                                                                            stands on the board

Those that are read are read by shared.config_files: a regular file of a sensible size, and any
error in it is a sentence.

Between two processes that one starts, standard output and exit status do the rest: see
laptop.see.serve.announcements.
"""

import os

STATE, ARM, PLAN = "BRICKSERVO_STATE", "BRICKSERVO_ARM", "BRICKSERVO_PLAN"
LOCK, PURE = "BRICKSERVO_LOCK", "BRICKSERVO_PURE"
PROGRAM, CODE = "BRICKSERVO_PROGRAM", "BRICKSERVO_CODE"
"""Environment variables."""
PAIRING_FILE, MARKERS_FILE, TRACKER_FILE = "pairing", "markers.ini", "tracker"
LIVE_FOLDER, CLOCK_FILE, BRICK_FOLDER = "live", "clock", "emulated-brick"
MOTORS_FILE = "emulated-motors"
LAST_BRICK_FILE = "brick"
CALLED_BRICK_FILE = "brick.txt"
BRICK_RUNS_FOLDER = "brick-runs"
OWN_ARMS_FOLDER = "arms"
TOUCHED_FOLDER = "touched"
JOBS_FOLDER, JOB_STATUS_FILE, JOB_ORDERS_FILE = "jobs", "jobs/status", "jobs/orders"
LEARNED_FOLDER = "learned"
"""Names in the state folder."""


def state_folder():
    # type: () -> str
    """Return the state folder of this user's programs; it need not exist yet."""
    return os.environ.get(STATE) or os.path.expanduser("~/.brickservo")


def laptop_program():
    # type: () -> str
    """Return what people type for the laptop's commands, to be told what to type next."""
    return os.environ.get(PROGRAM, "brickservo")


def default_arm(otherwise="planar"):
    # type: (str) -> str
    """Return the name or file of the arm where none is given."""
    return os.environ.get(ARM, otherwise)
