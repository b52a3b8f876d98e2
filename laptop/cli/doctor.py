"""`doctor`: whether this computer has what the commands need."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import click

from laptop.cli.options import examples, importing, json_option, print_json
from laptop.system.findings import Finding
from shared import state
from shared.arm_description import ArmError
from shared.messages import PORT
from shared.version import VERSION

MIN_FREE_MB = 200.0
"""Least free space of a disk, MB: a run leaves up to 2."""
FIREWALLS = ("ufw", "firewalld")
"""Services of Linux that keep others out."""
QUERY_TIMEOUT = 10.0
"""Longest wait for an answer of the system, s."""
WINDOWS_FIREWALL = (
    r"SYSTEM\CurrentControlSet\Services\SharedAccess\Parameters\FirewallPolicy\StandardProfile"
)
MACOS_FIREWALL = "/usr/libexec/ApplicationFirewall/socketfilterfw"


@click.command(
    short_help="Tell whether this computer has what is needed.", epilog=examples("doctor")
)
@json_option
def doctor() -> None:
    """Tell how this computer is: each line is fine, or says what to do; the status is 1 then.

    Nothing is changed. The brick has a doctor of its own: `brick doctor`.
    """
    found = []
    for finding in findings():
        click.echo(str(finding))
        found.append(finding)
    print_json([asdict(finding) for finding in found])
    sys.exit(any(finding.advice for finding in found))


def findings() -> Iterator[Finding]:
    """Yield one finding after the other, as each is made."""
    yield program()
    yield Finding("Python", f"{platform.python_version()}, {platform.platform()}")
    yield libraries()
    with importing():  # OpenCV
        from laptop.see.camera import webcams

    yield cameras(webcams.webcams())
    yield network()
    yield from ports()
    yield firewall()
    yield room(Path.cwd(), "here")
    yield memory()
    yield browser()
    yield brick()


def program() -> Finding:
    """Return which version is run, and from where."""
    repo_root = Path(__file__).parents[2]
    kind = "installed" if repo_root.name == "_house" else "a checkout"
    return Finding("program", f"brickservo {VERSION}, {kind} in {repo_root}")


def libraries() -> Finding:
    """Return whether all libraries are there that the program asks for."""
    try:
        wanted = importlib.metadata.requires("brickservo") or []
    except importlib.metadata.PackageNotFoundError:
        return Finding("libraries", "not looked at: brickservo is not installed in this Python")
    names = [re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in wanted if ";" not in line]
    missing = []
    for name in names:
        try:
            importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    installed = f"{len(names) - len(missing)} of {len(names)}"
    if missing:
        return Finding(
            "libraries", installed, f"{', '.join(missing)} missing; install brickservo anew"
        )
    return Finding("libraries", installed)


def cameras(found: dict[int, str]) -> Finding:
    """Return which webcams there are, and whether they may be used.

    Args:
        found: their names by number, as laptop.see.camera.webcams has them.
    """
    if not found:
        return Finding("cameras", "no webcam; --camera synthetic, and files, need none")
    reported = ", ".join(f"{k} ({name})" if name else str(k) for k, name in found.items())
    barred = [
        node
        for node in (f"/dev/video{k}" for k in found)
        if os.path.exists(node) and not os.access(node, os.R_OK | os.W_OK)
    ]
    advice = f"you may not use {', '.join(barred)}; sudo usermod -aG video $USER, log in again"
    return Finding("cameras", reported, advice if barred else "")


def network() -> Finding:
    """Return the addresses at which a brick may reach this computer."""
    from laptop.see.serve.listening import own_addresses

    found = own_addresses()
    if not found:
        return Finding("network", "none", "connect the brick by its cable, or join its network")
    return Finding("network", ", ".join(found))


def ports() -> Iterator[Finding]:
    """Yield whether the ports are free at which the tracker and its page listen."""
    from laptop.page.process import HOST
    from laptop.page.process import PORT as PAGE_PORT
    from laptop.see.serve.listening import CannotListen, listen

    for what, host, port in (("tracker", "", PORT), ("page", HOST, PAGE_PORT)):
        try:
            listen(host, port).close()
        except CannotListen as error:
            yield Finding(what, f"port {port}", str(error))
        else:
            yield Finding(what, f"port {port} is free")


def firewall() -> Finding:
    """Return whether a firewall may keep the brick from the tracker."""
    name = _active_firewall()
    if not name:
        return Finding("firewall", "none seen that would keep the brick out")
    advice = {
        "ufw": f"sudo ufw allow {PORT}/tcp",
        "firewalld": f"sudo firewall-cmd --add-port={PORT}/tcp --permanent && "
        "sudo firewall-cmd --reload",
        "macOS": "say Allow when it asks about incoming connections of Python",
        "Windows": "allow Python in private networks when it asks, and let this one be private",
    }[name]
    # Whether it has been told already, only an administrator may ask.
    return Finding("firewall", f"{name} is active; if the brick does not come: {advice}")


def _active_firewall() -> str:
    """Return the name of the firewall that is on, "" if none is known to be."""
    if sys.platform == "win32":
        import winreg

        with suppress(OSError), winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, WINDOWS_FIREWALL) as key:
            return "Windows" if winreg.QueryValueEx(key, "EnableFirewall")[0] else ""
        return ""
    if sys.platform == "darwin":
        return "macOS" if "enabled" in _answer(MACOS_FIREWALL, "--getglobalstate") else ""
    active = (one for one in FIREWALLS if _answer("systemctl", "is-active", one) == "active")
    return next(active, "")


def _answer(*args: str) -> str:
    """Return what a program of the system prints; "" if it is not there."""
    try:
        done = subprocess.run(args, capture_output=True, text=True, timeout=QUERY_TIMEOUT)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip()


def room(folder: Path, where: str) -> Finding:
    """Return whether a folder can be written to, and what room there is.

    Args:
        folder: that is there.
        where: it is, for people.
    """
    free = shutil.disk_usage(folder).free / 1e6
    value = f"{free / 1000:.1f} GB free {where}"
    if free < MIN_FREE_MB:
        return Finding("disk", value, f"make room: {MIN_FREE_MB:.0f} MB are needed for many runs")
    if not os.access(folder, os.W_OK):
        return Finding("disk", value, f"{folder} cannot be written to; go to a folder of yours")
    return Finding("disk", value)


def memory() -> Finding:
    """Return whether what is remembered (bricks, markers, zeros) can be kept."""
    folder = Path(state.state_folder())
    existing = next(place for place in (folder, *folder.parents) if place.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        return Finding(
            "memory", str(folder), f"{existing} cannot be written to; give {state.STATE}=DIR"
        )
    return Finding("memory", str(folder))


def browser() -> Finding:
    """Return whether a browser is there that makes a PDF of a report."""
    from laptop.record.report.print_pdf import CannotPrint, find_browser

    try:
        return Finding("browser", find_browser())
    except CannotPrint:
        return Finding("browser", "no Chromium, Chrome or Edge; only a report as .pdf needs one")


def brick() -> Finding:
    """Return which brick is remembered."""
    from laptop.brick.choosing import last_brick

    try:
        last = last_brick()
    except ArmError as error:
        return Finding("brick", "not to be read", str(error))
    none = f"none yet; {state.laptop_program()} brick find looks for one"
    return Finding("brick", str(last) if last else none)
