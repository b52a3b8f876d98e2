"""`doctor`: each line of this computer is fine, or says what to do."""

import importlib.metadata
import os
import shutil
import socket
from collections import namedtuple

import pytest
from click.testing import CliRunner

from laptop.cli import doctor
from laptop.cli.main import laptop
from laptop.record.report import print_pdf
from laptop.see.serve import listening
from shared.messages import PORT


@pytest.fixture
def quiet(monkeypatch, tmp_path):
    """A computer with which all is fine, whatever this one is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    monkeypatch.setattr(listening, "own_addresses", lambda: ["10.42.0.1"])
    monkeypatch.setattr(listening, "_bind", lambda host, port: socket.socket())
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: ["click>=8", "numpy<3"])
    monkeypatch.setattr(doctor, "_answer", lambda *args: "")


def reported(status):
    result = CliRunner().invoke(laptop, ["doctor"])
    assert (result.exit_code, result.exception and type(result.exception)) == (
        status,
        SystemExit if status else None,
    ), result.output
    return dict(line.split(maxsplit=1) for line in result.output.splitlines())


def test_where_all_is_fine_each_line_says_so(quiet):
    lines = reported(0)
    assert all(line.endswith(": fine") for line in lines.values()), lines
    assert lines["libraries"] == "2 of 2: fine"
    assert lines["network"] == "10.42.0.1: fine"
    assert lines["tracker"] == f"port {PORT} is free: fine"
    assert lines["brick"] == "none yet; brickservo brick find looks for one: fine"


def test_a_library_that_lacks_is_named(quiet, monkeypatch):
    monkeypatch.setattr(
        importlib.metadata, "requires", lambda name: ["click>=8", "no-such-thing>=1"]
    )
    assert reported(1)["libraries"] == "1 of 2: no-such-thing missing; install brickservo anew"


def test_a_port_that_is_taken_is_told_with_the_way_out(quiet, monkeypatch):
    def taken(host, port):
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(listening, "_bind", taken)
    lines = reported(1)
    assert lines["tracker"].startswith(f"port {PORT}: port {PORT} is in use, perhaps by another")
    assert f"--listen-port {PORT + 1}" in lines["tracker"]


def test_without_a_network_it_says_what_to_connect(quiet, monkeypatch):
    monkeypatch.setattr(listening, "own_addresses", list)
    assert reported(1)["network"].startswith("none: connect the brick by its cable")


@pytest.mark.parametrize("name", doctor.FIREWALLS)
def test_an_active_firewall_is_told_and_how_to_open_it(quiet, monkeypatch, name):
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    monkeypatch.setattr(
        doctor, "_answer", lambda *args: "active" if args[-1] == name else "inactive"
    )
    assert f"{PORT}/tcp" in reported(0)["firewall"]


def test_a_full_disk_is_told(quiet, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage(10**9, 10**9, 10**7))
    assert reported(1)["disk"].startswith("0.0 GB free here: make room")


def test_a_folder_that_is_not_one_s_own_is_told(quiet, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    lines = reported(1)
    assert "cannot be written to; go to a folder of yours" in lines["disk"]
    assert lines["memory"].endswith("cannot be written to; give BRICKSERVO_STATE=DIR")


def test_a_camera_that_one_may_not_use_is_told(monkeypatch):
    monkeypatch.setattr(os.path, "exists", lambda node: node.startswith("/dev/video"))
    monkeypatch.setattr(os, "access", lambda node, mode: node != "/dev/video2")
    assert str(doctor.cameras({0: "Integrated", 2: "Webcam"})) == (
        "cameras   0 (Integrated), 2 (Webcam): you may not use /dev/video2; "
        "sudo usermod -aG video $USER, log in again"
    )
    assert doctor.cameras({}).advice == ""


def test_without_a_browser_that_prints_it_says_what_needs_one(quiet, monkeypatch):
    monkeypatch.setattr(print_pdf, "BROWSERS", ())
    monkeypatch.setattr(print_pdf, "BROWSER_PATHS", ())
    assert reported(0)["browser"].endswith("only a report as .pdf needs one: fine")
