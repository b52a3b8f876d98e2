"""Files that hold anything: values, or one clear line."""

import math
import os
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from lab_runs import a_picture

from laptop.record.figures.document import MAX_PNG
from laptop.record.report import run_files
from laptop.record.report.run_files import read_bytes, read_columns, read_picture
from laptop.record.run import DamagedRun
from laptop.system.decoders import quiet_decoders


def test_columns_are_numbers_by_name_and_an_empty_cell_is_nan(tmp_path):
    file = tmp_path / "trace.csv"
    file.write_text("t,q1\n0,1.5\n1,\n")
    columns = read_columns(file)
    assert columns["t"].tolist() == [0, 1]
    assert columns["q1"][0] == 1.5
    assert math.isnan(columns["q1"][1])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "trace.csv is no CSV"),
        ("t,q1\n", "trace.csv has no row"),
        ("t,q1\n0,1\n0.1", "trace.csv: row 2 has 1 values, its heading has 2"),
        ("t,q1\n0,one\n", "trace.csv: line 2 holds no numbers"),
        ("\xff", "trace.csv is no CSV"),
    ],
)
def test_a_damaged_csv_is_told_in_a_line(tmp_path, text, why):
    file = tmp_path / "trace.csv"
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(DamagedRun) as failed:
        read_columns(file)
    assert str(failed.value) == why


def test_a_picture_is_a_whole_png_or_jpeg(tmp_path):
    file = tmp_path / "picture.png"
    file.write_bytes(a_picture())
    assert read_picture(file) == a_picture()
    huge = bytearray(a_picture())
    huge[16:24] = (100_000).to_bytes(4, "big") * 2
    for content, why in (
        (b"GIF89a", "is neither PNG nor JPEG"),
        (a_picture()[:60], "is a damaged picture"),
        (b"\xff\xd8\xff", "is a damaged picture"),
        (bytes(huge), "has 100000 x 100000 px"),
    ):
        file.write_bytes(content)
        with pytest.raises(DamagedRun, match=why):
            read_picture(file)


def noise(ending):
    """A picture of over 400 kB, which a report holds as JPEG."""
    pixels = np.random.default_rng(0).integers(0, 256, (500, 500, 3), np.uint8)
    return cv2.imencode(ending, pixels)[1].tobytes()


def with_unknown_chunk(png):
    """The same PNG with a chunk, before its end, that no decoder may pass over."""
    chunk = b"ABCD"
    return png[:-12] + bytes(4) + chunk + zlib.crc32(chunk).to_bytes(4, "big") + png[-12:]


@pytest.mark.parametrize("name", ["picture.png", "picture.jpg"])
def test_a_whole_picture_is_taken_whatever_its_kind(tmp_path, name):
    content = noise(name[-4:])
    (tmp_path / name).write_bytes(content)
    assert read_picture(tmp_path / name) == content


@pytest.mark.parametrize(
    "spoil",
    [lambda png: png[:-1], lambda png: png[:-12], lambda png: png[:-5000], with_unknown_chunk],
)
def test_a_large_png_that_one_decoder_refuses_is_damaged(tmp_path, spoil, capfd):
    content = spoil(noise(".png"))
    assert len(content) > MAX_PNG  # a report holds it as JPEG
    (tmp_path / "picture.png").write_bytes(content)
    with quiet_decoders(), pytest.raises(DamagedRun, match="picture.png is a damaged picture"):
        read_picture(tmp_path / "picture.png")
    assert capfd.readouterr().err == ""


def test_a_jpeg_that_is_cut_off_is_damaged(tmp_path):
    (tmp_path / "picture.jpg").write_bytes(noise(".jpg")[:-5000])
    with quiet_decoders(), pytest.raises(DamagedRun, match="picture.jpg is a damaged picture"):
        read_picture(tmp_path / "picture.jpg")


def test_a_file_that_is_too_large_or_none_is_not_read(tmp_path):
    (tmp_path / "a").write_text("eleven bytes")
    with pytest.raises(DamagedRun, match="is larger than"):
        read_bytes(tmp_path / "a", 10)
    (tmp_path / "folder").mkdir()
    with pytest.raises(DamagedRun, match="is not there, or no file"):
        read_bytes(tmp_path / "folder", 10)


@pytest.mark.parametrize("cell", ["1e308", "-1e13", "inf", "-inf"])
def test_a_number_beyond_all_bounds_is_told_with_its_line(tmp_path, cell):
    file = tmp_path / "a.csv"
    file.write_text(f"t,x\n0,1\n1,{cell}\n")
    with pytest.raises(DamagedRun, match=f"line 3 holds {cell}, which is beyond all"):
        run_files.read_columns(file)
    assert math.isnan(run_files.read_numbers(["nan"], "a")[0])


def test_neither_a_link_nor_a_pipe_is_read(tmp_path):
    """A link may lead to what whoever sent the folder wants in the report of another."""
    (tmp_path / "secret").write_text("t,x\n0,1\n")
    (tmp_path / "a.csv").symlink_to("secret")
    os.mkfifo(tmp_path / "b.csv")
    (tmp_path / "c.csv").symlink_to("/dev/zero")
    for name in ("a.csv", "b.csv", "c.csv"):
        with pytest.raises(DamagedRun, match=f"{name} is not there, or no file"):
            run_files.read_bytes(tmp_path / name, 1000)


@pytest.mark.parametrize(("wide", "high"), [(10_001, 1), (4000, 2001)])
def test_a_picture_too_large_to_decode_is_told_by_its_head(tmp_path, wide, high):
    file = tmp_path / "picture.png"
    head = b"IHDR" + wide.to_bytes(4, "big") + high.to_bytes(4, "big")
    file.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\r" + head + b"\x08\0\0\0\0")
    with pytest.raises(DamagedRun, match=f"has {wide} x {high} px, more than 8 MP or 10000 px on"):
        read_picture(file)


@pytest.mark.parametrize("end", ["\n", "\r"])
def test_a_csv_has_not_too_many_values(tmp_path, monkeypatch, end):
    monkeypatch.setattr(run_files, "MAX_VALUES", 12)
    file = tmp_path / "trace.csv"
    file.write_text(f"t,x,y{end}" + f"1,2,3{end}" * 3, newline="")
    assert read_columns(file)["x"].tolist() == [2] * 3
    file.write_text(f"t,x,y{end}" + f"1,2,3{end}" * 5, newline="")
    with pytest.raises(DamagedRun) as failed:
        read_columns(file)
    assert str(failed.value) == "trace.csv has more than 12 values; do this run again, and shorter"


def test_rows_of_a_csv_with_too_many_values_are_not_begun(tmp_path, monkeypatch):
    monkeypatch.setattr(run_files, "MAX_VALUES", 12)
    file = tmp_path / "trace.csv"
    file.write_text("t\n" + "1\n" * 20)
    with pytest.raises(DamagedRun, match="has more than 12 values"):
        run_files.read_rows(file)


@pytest.mark.long
def test_a_long_csv_takes_little_more_memory_than_its_file(tmp_path):
    file = tmp_path / "trace.csv"
    file.write_text("t,x,y,pen\n" + "11,22,33,1\n" * 200_000)
    tracemalloc.start()
    try:
        columns = read_columns(file)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert columns["pen"].shape == (200_000,)
    assert most < 10 * file.stat().st_size
