"""Files that nobody should send, and what is said of each: refused, or drawn in part."""

import gzip
import os
import struct
import zlib

import cv2
import numpy as np

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
SHEET = SVG + 'width="10cm" height="10cm" viewBox="0 0 100 100">'
LINE = '<path stroke="black" fill="none" d="M10 10L90 90"/>'
END = "</svg>"
REFUSED, DRAWN = "refused", "drawn"


def svg(body):
    """A drawing of 10 x 10 cm with this in it."""
    return SHEET + body + END


def path(data):
    """A drawing with one path."""
    return svg(f'<path stroke="black" fill="none" d="{data}"/>')


def chunk(kind, data):
    """A chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def picture(ending, side=64):
    """A picture that shows something."""
    image = np.full((side, side), 255, np.uint8)
    cv2.circle(image, (side // 2, side // 2), side // 3, 0, -1)
    return cv2.imencode(ending, image)[1].tobytes()


def png_of(width, height):
    """A PNG that claims a size, and has a few bytes."""
    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    data = zlib.compress(bytes(10_000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def jpeg_of(width, height):
    """A JPEG whose header claims a size."""
    data = bytearray(picture(".jpg"))
    at = data.index(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", height, width)
    return bytes(data)


def laughs():
    """Entities that explode."""
    lines = ["<!DOCTYPE svg [", '<!ENTITY a0 "ha">']
    lines += [f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10)]
    return "\n".join(lines) + "]>" + svg("<text>&a9;</text>")


def use_laughs():
    """References that multiply: 10 to the power of 9."""
    groups = [f'<g id="g0">{LINE}</g>']
    for k in range(1, 10):
        groups.append(f'<g id="g{k}">' + f'<use href="#g{k - 1}"/>' * 10 + "</g>")
    return svg("<defs>" + "".join(groups) + '</defs><use href="#g9"/>')


def long_uses():
    """Ten thousand references to one path that is long, and nearly empty."""
    return svg(
        f'<path id="p" stroke="black" d="M1 1L2 2{" " * 1_000_000}"/>' + '<use href="#p"/>' * 10_000
    )


def many_rules():
    """Style rules times elements."""
    rules = "".join(f"*{{stroke:#{k % 1000:03d}}}" for k in range(10_000))
    return svg(f"<style>{rules}</style>" + "<g/>" * 10_000 + LINE)


def rings(count):
    """So many `use` elements, each of which refers to the next, and the last to the first."""
    return svg(LINE + "".join(f'<use id="u{k}" href="#u{(k + 1) % count}"/>' for k in range(count)))


def bomb(begin, megabytes):
    """What unpacks to so many megabytes."""
    packer = zlib.compressobj(9, wbits=31)
    parts = [packer.compress(begin)]
    parts += [packer.compress(b" " * 1_000_000) for _ in range(megabytes)]
    return b"".join([*parts, packer.flush()])


FILES = {
    "cut_off.svg": (SHEET + LINE, REFUSED, "is broken XML .*line 1"),
    "tags_crossed.svg": (svg("<g><a></g></a>"), REFUSED, "is broken XML"),
    "laughs.svg": (laughs(), REFUSED, "declares an entity .&a1;"),
    "entity_of_file.svg": (
        '<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>' + svg("<text>&x;</text>"),
        REFUSED,
        "declares an entity .&x;",
    ),
    "parameter_entity.svg": (
        '<!DOCTYPE svg [<!ENTITY % x SYSTEM "http://127.0.0.1:9/x.dtd"> %x;]>' + svg(LINE),
        REFUSED,
        "declares an entity",
    ),
    "dtd_elsewhere.svg": (
        '<!DOCTYPE svg SYSTEM "http://127.0.0.1:9/svg.dtd">' + svg(LINE),
        DRAWN,
        "^1 stroke;$",
    ),
    "million_points.svg": (
        svg('<polyline stroke="black" points="' + "1 2 3 4 " * 500_000 + '"/>'),
        REFUSED,
        "has more than 300000 points",
    ),
    "million_segments.svg": (path("M0 0" + "l1 1" * 1_000_000), REFUSED, "more than 300000 points"),
    "million_moves.svg": (path("M0 0" * 1_000_000), REFUSED, "more than 300000 points"),
    "million_in_parts.svg": (svg("<g/>" * 110_000), REFUSED, "more than 100000 elements"),
    "no_size.svg": (
        SVG + 'width="0" height="10cm">' + LINE + END,
        DRAWN,
        "^1 stroke; A value .*.0",
    ),
    "no_area.svg": (SVG + 'viewBox="0 0 0 0">' + LINE + END, DRAWN, "^1 stroke; A value .*0 0 0 0"),
    "size_is_nan.svg": (
        SVG + 'width="nan" height="1">' + LINE + END,
        DRAWN,
        "^1 stroke; A value .*nan",
    ),
    "size_is_huge.svg": (SVG + 'width="1e30" height="9">' + LINE + END, REFUSED, "have a size"),
    "nan.svg": (path("M nan nan L nan 1"), REFUSED, "nothing in it is drawn: A path is broken"),
    "nan_points.svg": (
        svg('<polyline stroke="black" points="1 1 2 2 nan 5 3 3"/>'),
        DRAWN,
        "^1 stroke; A path is broken",
    ),
    "infinite.svg": (path("M0 0L1e999 5"), REFUSED, "1000 m away"),
    "far_away.svg": (path("M0 0L1e30 5"), REFUSED, "1000 m away"),
    "huge_scale.svg": (
        svg(f'<g transform="scale(1e200)"><g transform="scale(1e200)">{LINE}</g></g>'),
        REFUSED,
        "1000 m away",
    ),
    "no_scale.svg": (svg(f'<g transform="scale(0)">{LINE}</g>'), REFUSED, "it has no lines"),
    "transform_is_nan.svg": (
        svg(LINE + f'<g transform="rotate(nan)">{LINE}</g>'),
        DRAWN,
        "^2 strokes; A value that cannot be read is passed over .*rotate.nan",
    ),
    "transform_backtracks.svg": (
        svg(LINE + f'<g transform="scale({"1" * 1900}!)">{LINE}</g>'),
        DRAWN,
        "^2 strokes; A value that cannot be read is passed over",
    ),
    "style_backtracks.svg": (
        svg("<style>" + "a" * 900_000 + "</style>" + LINE),
        DRAWN,
        "^1 stroke;$",
    ),
    "many_rules.svg": (many_rules(), REFUSED, "rules of its style sheets would be tried more"),
    "long_text.svg": (svg("<text>" + "x" * 2_000_000 + "</text>"), REFUSED, "characters of text"),
    "deep.svg": (svg("<g>" * 10_000 + LINE + "</g>" * 10_000), REFUSED, "200 elements inside"),
    "use_of_itself.svg": (
        svg(LINE + '<use id="u" href="#u"/>'),
        DRAWN,
        "^1 stroke; .*back to itself",
    ),
    "use_of_parent.svg": (
        svg(f'<g id="g">{LINE}<use href="#g"/></g>'),
        DRAWN,
        "^2 strokes; .*back to itself",
    ),
    "use_in_a_ring.svg": (rings(100), DRAWN, "^1 stroke; .*back to themselves"),
    "use_in_a_long_ring.svg": (rings(10_000), REFUSED, "<use> elements repeat more than"),
    "use_laughs.svg": (use_laughs(), REFUSED, "<use> elements repeat more than"),
    "use_of_long_path.svg": (long_uses(), REFUSED, "<use> elements repeat more than"),
    "use_elsewhere.svg": (
        svg(LINE + '<use xlink:href="http://127.0.0.1:9/other.svg#x"/><use href="/etc/a.svg#x"/>'),
        DRAWN,
        "^1 stroke; 2 references to other files are not followed",
    ),
    "script.svg": (svg(f"<script>while(1);</script>{LINE}"), DRAWN, "^1 stroke; A script is not"),
    "picture_elsewhere.svg": (
        svg(LINE + '<image href="http://127.0.0.1:9/a.png"/><image href="file:///etc/passwd"/>'),
        DRAWN,
        "^1 stroke; 2 pictures are not drawn",
    ),
    "style_elsewhere.svg": (
        '<?xml-stylesheet href="http://127.0.0.1:9/a.css"?>'
        + svg('<style>@import url("file:///etc/a.css");path{fill:none}</style>' + LINE),
        DRAWN,
        "^1 stroke; 2 style sheets in other files are not read",
    ),
    "foreign.svg": (
        svg(LINE + '<foreignObject><body xmlns="http://www.w3.org/1999/xhtml"/></foreignObject>'),
        DRAWN,
        "^1 stroke; Something foreign",
    ),
    "utf16.svg": (svg(LINE).encode("utf-16"), DRAWN, "^1 stroke;$"),
    "ebcdic.svg": (
        b'<?xml version="1.0" encoding="x-none"?>' + svg(LINE).encode(),
        REFUSED,
        "in an encoding that is not read|is broken XML",
    ),
    "page.svg": ("<html><body>404</body></html>", REFUSED, "is XML, but no SVG: .*<html>"),
    "png.svg": (picture(".png"), DRAWN, "strokes;"),
    "svg.png": (svg(LINE), DRAWN, "^1 stroke;$"),
    "text.svg": ("Hello", REFUSED, "is a text, whatever its name says"),
    "pdf.svg": (b"%PDF-1.7\n", REFUSED, "is a PDF, .*; save it as SVG"),
    "noise.svg": (bytes(range(256)) * 50, REFUSED, "is no drawing that is known here"),
    "zeros.png": (bytes(10_000), REFUSED, "is no drawing that is known here"),
    "empty.svg": (b"", REFUSED, "is empty"),
    "blank.svg": (b" \n\t" * 1000, REFUSED, "is empty"),
    "no_lines.svg": (svg(""), REFUSED, "nothing in it is drawn; it has no lines"),
    "packed.svgz": (gzip.compress(svg(LINE).encode()), DRAWN, "^1 stroke;$"),
    "bomb.svgz": (bomb(SHEET.encode(), 30), REFUSED, "longer than 20 MB"),
    "packed_twice.svgz": (gzip.compress(gzip.compress(b"<svg/>")), REFUSED, "holds no SVG"),
    "packed_cut_off.svgz": (gzip.compress(svg(LINE * 99).encode())[:-30], REFUSED, "and cut off"),
    "packed_noise.svgz": (b"\x1f\x8b" + bytes(200), REFUSED, "damaged"),
    "absurd.png": (png_of(100_000, 100_000), REFUSED, "claims 100000 x 100000 pixels"),
    "no_pixels.png": (png_of(0, 5), REFUSED, "claims 0 x 5 pixels"),
    "absurd.jpg": (jpeg_of(65_535, 65_535), REFUSED, "claims 65535 x 65535 pixels"),
    "cut_off.png": (picture(".png")[:-40], REFUSED, "cut off"),
    "cut_off.jpg": (picture(".jpg")[:-40], REFUSED, "cut off"),
    "only_a_head.jpg": (picture(".jpg")[:12], REFUSED, "cut off"),
    "spoilt.png": (picture(".png").replace(b"IDAT", b"IDAX"), REFUSED, "damaged PNG"),
    "few_pixels.png": (png_of(6000, 6000), REFUSED, "cut off"),
    "white.png": (cv2.imencode(".png", np.full((9, 9), 255, np.uint8))[1].tobytes(), REFUSED,
                  "shows nothing to draw"),
    "one_pixel.png": (cv2.imencode(".png", np.zeros((1, 1), np.uint8))[1].tobytes(), DRAWN,
                      "strokes;"),
    "novel.txt": ("word " * 10_000, REFUSED, "is a text of 50000 characters"),
    "signs.txt": ("\u4f60\u597d", REFUSED, "nothing in it can be written"),
}  # fmt: skip
"""Name, contents, what becomes of it, and a pattern of what is said."""


def _long(size):
    def make(path):
        with open(path, "wb") as file:  # it takes no room on the disk
            file.write(SHEET.encode())
            file.truncate(size)

    return make


def _loop(path):
    os.symlink(path, path)


def _locked(path):
    with open(path, "wb") as file:
        file.write(svg(LINE).encode())
    os.chmod(path, 0)


SPECIAL = {
    "long.svg": (_long(100_000_000), "longer than 40 MB"),
    "longer_than_memory.svg": (_long(3_000_000_000), "longer than 40 MB"),
    "folder.svg": (os.mkdir, "is a folder, not a file"),
    "pipe.svg": (os.mkfifo, "is a pipe, not a file"),
    "device.svg": (lambda path: os.symlink("/dev/zero", path), "is a device, not a file"),
    "loop.svg": (_loop, "cannot be read"),
    "locked.svg": (_locked, "cannot be read .Permission denied"),
    "missing.svg": (lambda path: None, "there is no such file; .*rose"),
}
"""Name, what makes it, and a pattern of what is said."""


def make_all(folder):
    """Write all of them into a folder; their paths by name."""
    for name, (contents, _, _) in FILES.items():
        data = contents.encode() if isinstance(contents, str) else contents
        (folder / name).write_bytes(data)
    for name, (make, _) in SPECIAL.items():
        make(folder / name)
    return {name: folder / name for name in (*FILES, *SPECIAL)}
