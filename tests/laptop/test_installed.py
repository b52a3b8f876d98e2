"""The laptop's side as `uv tool install` puts it there: a wheel, in a class's own folder."""

import os
import re
import shutil
import subprocess
import sys
import zipfile

import cv2
import numpy as np
import pytest
from places import ROOT, SCRIPTS
from systems import lacking

from shared.version import VERSION

BRICKSERVO = """
import sys
sys.argv[0] = "brickservo"
from brickservo.__main__ import run
run()
"""
"""What the command `brickservo` does that is made of the wheel."""

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if not os.environ.get("CI"):
        pytest.importorskip("hatchling", reason="hatchling, which makes wheels, is in group dev")
    return build("wheel", tmp_path_factory.mktemp("wheel"))


def build(target, folder, checkout=ROOT):
    """Make a wheel or an sdist there; its file."""
    words = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    subprocess.run(words, cwd=checkout, check=True, capture_output=True)
    (made,) = folder.iterdir()
    return made


def contents(wheel):
    """The files of a wheel, by name."""
    archive = zipfile.ZipFile(wheel)
    return {name: archive.read(name) for name in archive.namelist()}


def python(code, environment, cwd):
    """Run code in a Python of its own."""
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory):
    """Where it is unpacked."""
    folder = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


@pytest.fixture(params=["linux", "windows", "macos"])
def brickservo(request, site, tmp_path):
    """A function that runs the command in a class's folder, on this system or another."""
    folder = tmp_path / "Klasse 7b" / "Übung 1"
    folder.mkdir(parents=True)
    environment = {**os.environ} if request.param == "linux" else lacking(request.param)
    paths = [*environment.get("PYTHONPATH", "").split(os.pathsep)[:-1], str(site)]
    environment.update(
        PYTHONPATH=os.pathsep.join(paths),
        BRICKSERVO_STATE=str(tmp_path / "state"),
        TMPDIR=str(tmp_path),
    )

    def run(*words):
        return subprocess.run(
            [sys.executable, "-c", BRICKSERVO, *words],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
        )

    run.folder = folder
    return run


def test_a_wheel_holds_all_that_its_folders_hold(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    for room in ("laptop", "robot", "shared"):
        for path in (ROOT / room).rglob("*"):
            name = path.relative_to(ROOT).as_posix()
            if path.is_file() and "__pycache__" not in name:
                left_out = name.startswith("laptop/cli/package/")
                assert (f"brickservo/_house/{name}" in names) != left_out, name
    assert {"brickservo/__init__.py", "brickservo/__main__.py", "brickservo/py.typed"} <= names


def test_it_takes_one_name_among_the_packages_of_a_python(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names} == {
        "brickservo",
        f"brickservo-{VERSION}.dist-info",
    }


def test_what_is_made_of_the_source_archive_is_the_same(wheel, tmp_path):
    source = build("sdist", tmp_path / "source")
    shutil.unpack_archive(source, tmp_path, filter="data")
    (checkout,) = tmp_path.glob("brickservo-*")
    again = build("wheel", tmp_path / "again", checkout)
    assert contents(again) == contents(wheel)


def test_the_robot_and_the_shared_of_others_stay_theirs(site, tmp_path):
    """Such as Robot Framework."""
    for name in ("robot", "shared"):
        (tmp_path / "others" / name).mkdir(parents=True)
        (tmp_path / "others" / name / "__init__.py").write_text("WHOSE = 'others'\n")
    code = "import robot, shared, brickservo; print(robot.WHOSE, shared.WHOSE)"
    others = {"PYTHONPATH": os.pathsep.join([str(tmp_path / "others"), str(site)])}
    done = python(code, others, tmp_path)
    assert (done.returncode, done.stdout) == (0, "others others\n")
    done = python(code + "; brickservo.Rig", others, tmp_path)
    assert done.stderr.splitlines()[-1] == (
        f"ImportError: this process uses another package called robot, "
        f"{tmp_path / 'others' / 'robot'}: run BrickServo in a process of its own"
    )
    done = python("import brickservo; brickservo.Rig; import robot.driver", others, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_what_lies_beside_a_class_s_script_is_the_script_s(brickservo):
    code = "import robot, shared, test\nprint(robot.WHOSE, shared.WHOSE, test.WHOSE)\n"
    for name in ("robot", "shared", "test"):
        (brickservo.folder / f"{name}.py").write_text("WHOSE = 'mine'\n")
    (brickservo.folder / "lab.py").write_text(code)
    done = brickservo("simulate", "--arm", "none", "lab.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("mine mine mine\n")
    done = brickservo("simulate", "driver.py", "where")
    assert (done.returncode, done.stderr) == (0, "")


def test_another_python_program_has_a_rig(site, tmp_path):
    code = (
        "import brickservo\n"
        "with brickservo.Rig('planar', plant='cpu=0') as rig:\n"
        "    rig.run('driver.py', 'line', '10,0', '5,10')\n"
        "    print(*(round(a) for a in rig.tip), brickservo.__version__)\n"
    )
    done = python(code, {"PYTHONPATH": str(site)}, tmp_path)
    assert done.stdout.splitlines()[-1] == f"5 10 {VERSION}"


def test_it_knows_its_name_and_its_version(brickservo):
    done = brickservo("--version")
    assert (done.returncode, done.stdout) == (0, f"brickservo {VERSION}\n")
    done = brickservo("simulate", "--help")
    assert "Usage: brickservo simulate [OPTIONS] SCRIPT" in done.stdout
    assert "  brickservo simulate robot/driver.py line 10,0 5,10" in done.stdout
    done = brickservo("simulate", "robot/driver.py", "--version")
    assert f"brickservo {VERSION}\n" in done.stdout


def test_a_class_runs_its_own_script_and_ours_in_its_own_folder(brickservo):
    shutil.copy(SCRIPTS / "lab1_moves.py", brickservo.folder / "my_lab.py")
    for words in (
        ["my_lab.py"],
        ["driver.py", "where"],
        ["--arm", "geared", "robot/driver.py", "line", "10,0", "5,10"],
    ):
        done = brickservo("simulate", *words)
        assert (done.returncode, done.stderr) == (0, ""), words
    runs = brickservo.folder / "runs"
    assert len([*runs.glob("*-simulate*")]) == 3
    assert [*runs.glob("*/picture.png")]
    own = brickservo.folder / "driver.py"
    own.write_text("print('my own driver')\n")
    assert brickservo("simulate", "driver.py").stdout.startswith("my own driver\n")
    done = brickservo("simulate", "robot/nothing.py")
    assert done.returncode == 2
    assert "there is no robot/nothing.py; ours are bench_brick.py, driver.py" in done.stderr


def test_a_brick_gets_the_same_program_from_it(site, tmp_path):
    from ssh_brick import SshBrick  # not above: it wants an sshd

    made = SshBrick(tmp_path, ("-c", BRICKSERVO))
    try:
        for words in (["install"], ["run", "driver.py", "inverse", "10,5"]):
            status, out, errors = made.run(*words, cwd=tmp_path, env={"PYTHONPATH": str(site)})
            assert status == 0, out + errors
        assert out.startswith("analytic ")
    finally:
        made.close()
    there = made.home / ".brickservo" / "program" / "robot" / "driver.py"
    assert there.read_bytes() == (ROOT / "robot" / "driver.py").read_bytes()


def test_a_video_is_tracked_there(brickservo):
    film = brickservo.folder / "Film.avi"
    out = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (320, 240))
    image = np.full((240, 320, 3), 130, np.uint8)
    cv2.circle(image, (100, 80), 20, (0, 0, 220), -1, cv2.LINE_AA)
    for _ in range(5):
        out.write(image)
    out.release()
    done = brickservo("track", "--camera", "Film.avi", "--no-serve", "--to", "seen.csv")
    assert (done.returncode, done.stderr) == (0, "")
    rows = (brickservo.folder / "seen.csv").read_text().splitlines()
    seen = [row.split(",") for row in rows if ",effector," in row]
    assert len(seen) == 5
    for _, _, _, u, v, _ in seen:
        assert (float(u), float(v)) == pytest.approx((100, 80), abs=0.3)


def metadata(wheel):
    """The text of a wheel's METADATA."""
    (name,) = (one for one in contents(wheel) if one.endswith("/METADATA"))
    return contents(wheel)[name].decode()


def test_an_index_is_told_what_it_is_and_shows_no_picture_that_it_lacks(wheel):
    told = metadata(wheel)
    for line in ("License-Expression: MIT", "Classifier: Typing :: Typed", "Keywords: EV3,"):
        assert f"\n{line}" in told
    text = told.partition("\n\n")[2]
    assert text.lstrip().startswith("# BrickServo")
    assert not re.search(r"\]\((?!https?:|#)", text), "a link that leads nowhere from an index"


def test_a_home_gives_the_readme_its_pictures(tmp_path):
    """Who publishes it writes the home into pyproject.toml."""
    checkout = tmp_path / "checkout"
    shutil.copytree(
        ROOT,
        checkout,
        ignore=shutil.ignore_patterns(".*", "tests", "__pycache__", "pictures", "uv.lock"),
    )
    file = checkout / "pyproject.toml"
    home = "https://example.org/arms/brickservo"
    file.write_text(file.read_text().replace('home = ""', f'home = "{home}"'))
    told = metadata(build("wheel", tmp_path / "dist", checkout))
    assert f"\nProject-URL: Source, {home}\n" in told
    assert f"]({home}/raw/main/laptop/docs/pictures/house.gif)" in told
    assert f"]({home}/blob/main/laptop/docs/index.md" in told
    assert re.findall(r"\]\((?!https?:|#)", told) == []
