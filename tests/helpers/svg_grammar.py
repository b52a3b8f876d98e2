"""Drawings from a grammar of SVG: each cell of a grid has a feature of its own."""

import math
import random

CELL, GAP, ACROSS, DOWN = 40, 10, 3, 3
"""Side of a cell, what is between two, and how many there are; the sheet's units are px."""

BLACK = "black", "#000", "#000000ff", "rgb(0,0,0)", "rgb(0% 0% 0%)", "hsl(0,0%,0%)", "#112"
SHAPES = "path", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon"
PALE = (
    *("white", "#fff", "#FFFFFF", "rgb(255,255,255)", "hsl(0, 0%, 100%)", "rgba(255,255,255,1)"),
    *("none", "transparent", "rgba(0,0,0,0)", "#0000", "hsla(0,0%,0%,0)"),
)


class Maker:
    """Makes one drawing by a seed."""

    def __init__(self, seed):
        self.draw = random.Random(seed)
        self.defs, self.rules, self.count = [], [], 0

    def name(self, kind):
        self.count += 1
        return f"{kind}{self.count}"

    def number(self, low=2.0, high=CELL - 2.0):
        return round(self.draw.uniform(low, high), 1)

    def points(self, n):
        return [(self.number(), self.number()) for _ in range(n)]

    def svg(self):
        cells = []
        for row in range(DOWN):
            for column in range(ACROSS):
                kind = self.draw.choice(KINDS)
                body = getattr(self, kind)()
                x, y = column * (CELL + GAP) + GAP // 2, row * (CELL + GAP) + GAP // 2
                name = f"{kind}-{row}{column}"
                cells.append(f'<g id="{name}" transform="translate({x},{y})">{body}</g>')
        wide, high = ACROSS * (CELL + GAP), DOWN * (CELL + GAP)
        style = f"<style>{' '.join(self.rules)}</style>" if self.rules else ""
        return (
            '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
            f'viewBox="0 0 {wide} {high}" width="{wide}" height="{high}">{style}'
            f"<defs>{''.join(self.defs)}</defs>"
            f'<g fill="none" stroke="black" stroke-width="0.6">{"".join(cells)}</g></svg>'
        )

    # ---- shapes

    def data(self, is_closed=False):
        draw, parts = self.draw, []
        x, y = self.points(1)[0]
        parts.append(f"M{x} {y}")
        for _ in range(draw.randint(1, 5)):
            command = draw.choice("LLHVCSQTAlhvcsqta")
            low, high = (-12, 12) if command.islower() else (2.0, CELL - 2.0)
            flags = f"{draw.randint(0, 1)}{draw.choice(['', ' ', ','])}{draw.randint(0, 1)}"
            arc = f"{self.number(2, 15)} {self.number(2, 15)} {draw.randint(0, 180)} {flags}"
            counts = {"l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 2}
            values = [self.number(low, high) for _ in range(counts[command.lower()])]
            text = draw.choice([" ", ","]).join(map(str, values))
            parts.append(f"{command}{arc + ' ' if command in 'aA' else ''}{text}")
            if draw.random() < 0.1:
                parts.append("z")
                if draw.random() < 0.5:
                    (a, b), (c, d) = self.points(2)
                    parts.append(f"L{a} {b}M{c} {d}")
        return "".join(parts) + ("z" if is_closed else "")

    def shape(self, attributes=""):
        """Any shape, within the cell for the most part."""
        draw = self.draw
        (x, y), (w, h) = [[self.number(*span) for _ in range(2)] for span in ((2, 18), (5, 20))]
        kind = draw.choice(SHAPES)
        cx, cy, r = x + 10, y + 10, min(w, h) / 2
        if kind == "path":
            return f'<path {attributes} d="{self.data()}"/>'
        if kind == "rect":
            rx, ry = self.number(1, 9), self.number(1, 9)
            rounds = draw.choice(
                ["", f'rx="{rx}"', f'ry="{ry}"', f'rx="{rx}" ry="{ry}"', 'rx="0" ry="3"']
            )
            return f'<rect {attributes} x="{x}" y="{y}" width="{w}" height="{h}" {rounds}/>'
        if kind == "circle":
            return f'<circle {attributes} cx="{cx}" cy="{cy}" r="{r}"/>'
        if kind == "ellipse":
            radii = draw.choice([f'rx="{w / 2}" ry="{h / 2}"', f'rx="{r}"', f'ry="{r}"'])
            return f'<ellipse {attributes} cx="{cx}" cy="{cy}" {radii}/>'
        if kind == "line":
            return f'<line {attributes} x1="{x}" y1="{y}" x2="{x + w}" y2="{y + h}"/>'
        points = " ".join(f"{a},{b}" for a, b in self.points(draw.randint(3, 6)))
        return f'<{kind} {attributes} points="{points}"/>'

    def plain(self):
        return self.shape()

    def path(self):
        return f'<path d="{self.data()}"/>'

    # ---- where

    def one_transform(self, css=False):
        draw, n = self.draw, self.number
        deg, px = ("deg", "px") if css else ("", "")
        angle = str(draw.randint(-90, 90))
        if css:
            turn, rad = draw.randint(-50, 50) / 200, draw.randint(-15, 15) / 10
            angle = draw.choice(
                [f"{angle}deg", f"{turn}turn", f"{draw.randint(-100, 100)}grad", f"{rad}rad"]
            )
        x, y = n(-5, 5), n(-5, 5)
        options = [
            f"translate({n(-8, 8)}{px}, {n(-8, 8)}{px})",
            f"scale({n(0.5, 1.2)})",
            f"scale({n(0.5, 1.2)}, {draw.choice([-1, 1]) * n(0.5, 1.2)})",
            f"rotate({angle})",
            f"skewX({draw.randint(-30, 30)}{deg})",
            f"matrix({n(0.5, 1)}, {n(-0.5, 0.5)}, {n(-0.5, 0.5)}, {n(0.5, 1)}, {x}, {y})",
        ]
        if not css:
            options.append(f"rotate({draw.randint(-90, 90)} {n()} {n()})")
        return draw.choice(options)

    def transformed(self):
        draw = self.draw
        css = draw.random() < 0.5
        text = " ".join(self.one_transform(css) for _ in range(draw.randint(1, 3)))
        more = ""
        if draw.random() < 0.6:
            place = draw.choice(["20px 20px", "center", "50% 50%", "10px 30px", "left top", "20px"])
            box = draw.choice(["", "transform-box:fill-box;", "transform-box:view-box;"])
            if css:
                more = f";transform-origin:{place};{box}"
            else:
                return self.shape(f'transform="{text}" transform-origin="{place}" style="{box}"')
        if css:
            return self.shape(f'style="transform:{text}{more}"')
        return f'<g transform="{text}">{self.shape()}</g>'

    def odd_transform(self):
        text = self.draw.choice(["qwe", "rotate(", "scale(2 2 2)", "", "none", "rotate(30) x"])
        return self.shape(f'transform="{text}"')

    def viewported(self):
        draw = self.draw
        tag = draw.choice(["svg", "symbol"])
        box = draw.choice(['viewBox="0 0 40 40"', 'viewBox="5 5 20 30"', "", 'viewBox=""',
                           'viewBox="0 0 20 20" preserveAspectRatio="none"',
                           'viewBox="0 0 20 40" preserveAspectRatio="xMinYMin slice"',
                           'viewBox="0 0 20 40" preserveAspectRatio="xMaxYMid meet"'])  # fmt: skip
        flow = draw.choice(
            ["", 'overflow="visible"', 'overflow="hidden"', 'style="overflow:visible"']
        )
        size = f'width="{self.number(15, 38)}" height="{self.number(15, 38)}"'
        at = f'x="{self.number(0, 8)}" y="{self.number(0, 8)}"'
        body = self.shape() + self.shape()
        if tag == "svg" and draw.random() < 0.5:
            return f"<svg {at} {size} {box} {flow}>{body}</svg>"
        name = self.name("v")
        own = "" if tag == "symbol" else size
        self.defs.append(f'<{tag} id="{name}" {own} {box} {flow}>{body}</{tag}>')
        link = draw.choice(["href", "xlink:href"])
        return f'<use {link}="#{name}" {at} {size}/>'

    def used(self):
        name = self.name("u")
        self.defs.append(self.shape(f'id="{name}"'))
        text = self.one_transform()
        return f'<use href="#{name}" x="{self.number(-5, 5)}" transform="{text}"/>'

    # ---- seen or not

    def pale(self):
        """Something that is not seen, or is."""
        draw = self.draw
        value = draw.choice([
            f'stroke="{draw.choice(PALE)}"', f'style="stroke:{draw.choice(PALE)}"',
            'opacity="0"', 'stroke-opacity="0"', 'stroke-opacity="0%"', 'style="opacity:0%"',
            'stroke-width="0"', 'style="stroke-width:0px"', 'visibility="hidden"', 'display="none"',
            'visibility="collapse"', 'stroke="url(#nothing)"', 'stroke="url(#nothing) none"',
            'stroke="url(#nothing) black"', f'stroke="{draw.choice(BLACK)}"', 'stroke="bogus"',
            'stroke="currentColor"', 'color="white" stroke="currentColor"', 'style="stroke:bogus"',
            'style="stroke:black;stroke:bogus"', 'stroke="CURRENTCOLOR"', 'stroke="Black"',
            'style="display:inline;display:bogus"',
        ])  # fmt: skip
        inner = self.draw.choice(["", 'visibility="visible"', 'display="inline"', 'opacity="1"'])
        if draw.random() < 0.5:
            return self.shape(value)
        return f"<g {value}>{self.shape(inner)}</g>"

    def styled(self):
        """Rules against one another."""
        draw = self.draw
        a, b, i = self.name("a"), self.name("b"), self.name("i")
        off = draw.choice(
            ["display:none", "stroke:none", "visibility:hidden", "opacity:0", "stroke:#fff"]
        )
        key = off.partition(":")[0]
        on = {"display": "inline", "stroke": "black", "visibility": "visible", "opacity": "1"}[key]
        selectors = [
            f".{a}", f"#{i}", f".{a}.{b}", f"g.{b} .{a}", f"g > .{a}", f".{b} > .{a}",
            f"g.{b} > g .{a}", f"[class~={a}]", f".{a}:not(.{b})", f"svg .{a}", f".{a}:first-child",
            f"path.{a}, rect.{a}", f"circle.{a}",
        ]  # fmt: skip
        for _ in range(draw.randint(1, 3)):
            value = draw.choice([off, off, f"{key}:{on}"])
            important = draw.choice(["", "", " !important"])
            rule = f"{draw.choice(selectors)}{{{value}{important}}}"
            around = draw.choice(["{}", "{}", "@media print{{{}}}", "@media screen{{{}}}"])
            self.rules.append(around.format(rule))
        own = draw.choice(["", f'style="{key}:{on}"', f'style="{off}"', f'{key}="{on}"'])
        classes = draw.choice([a, f"{a} {b}"])
        return f'<g class="{b}">{self.shape(f"""class="{classes}" id="{i}" {own}""")}</g>'

    def spoken(self):
        """A switch, or what is for some readers only."""
        one = self.draw.choice(["xx", "de-AT, fr", "", "zh"])
        first = self.shape(f'systemLanguage="{one}"')
        return f"<switch>{first}{self.shape()}</switch>" if self.draw.random() < 0.7 else first

    # ---- cut

    def area_shape(self, attributes=""):
        """A shape with an area."""
        draw = self.draw
        (x, y), (w, h) = [[self.number(*span) for _ in range(2)] for span in ((2, 15), (10, 22))]
        kind = draw.choice(["rect", "rect", "circle", "polygon", "path", "ellipse", "round"])
        if kind == "rect":
            return f'<rect {attributes} x="{x}" y="{y}" width="{w}" height="{h}"/>'
        if kind == "round":
            return f'<rect {attributes} x="{x}" y="{y}" width="{w}" height="{h}" rx="4"/>'
        if kind == "circle":
            return f'<circle {attributes} cx="{x + w / 2}" cy="{y + h / 2}" r="{min(w, h) / 2}"/>'
        if kind == "ellipse":
            return f'<ellipse {attributes} cx="{x + 10}" cy="{y + 10}" rx="{w / 2}" ry="{h / 2}"/>'
        if kind == "polygon":
            n = draw.randint(3, 7)
            points = []
            for k in range(n):
                r = self.number(6, 15)
                a = 2 * math.pi * k / n
                points.append(f"{20 + r * math.cos(a):.1f},{20 + r * math.sin(a):.1f}")
            return f'<polygon {attributes} points="{" ".join(points)}"/>'
        return (f'<path {attributes} d="M{x} {y}h{w}v{h}h-{w}zM{x + 3} {y + 3}h{w - 6}v{h - 6}'
                f'h-{w - 6}z"/>')  # fmt: skip

    def clip(self):
        draw, name = self.draw, self.name("c")
        rule = draw.choice(["", 'clip-rule="evenodd"', 'clip-rule="nonzero"'])
        inner = self.area_shape(rule)
        if draw.random() < 0.3:
            inner = self.area_shape()
            inner += self.area_shape(draw.choice(["", 'transform="rotate(20)"', 'display="none"']))
        if draw.random() < 0.2:
            shape = self.name("s")
            self.defs.append(self.area_shape(f'id="{shape}"'))
            inner = f'<use href="#{shape}"/>'
        more = ""
        if draw.random() < 0.2:
            more = f'clip-path="url(#{self.clip()})"'
        if draw.random() < 0.2:
            more += f' transform="{self.one_transform()}"'
        if draw.random() < 0.15:
            inner = '<rect x="0.2" y="0.1" width="0.5" height="0.7"/>'
            more += ' clipPathUnits="objectBoundingBox"'
        self.defs.append(f'<clipPath id="{name}" {more}>{inner}</clipPath>')
        return name

    def clipped(self):
        where = f'clip-path="url(#{self.clip()})"'
        if self.draw.random() < 0.3:
            where = f'style="clip-path:url(#{self.clip()})"'
        if self.draw.random() < 0.5:
            return self.shape(where)
        return f"<g {where}>{self.shape()}{self.shape()}</g>"

    def masked(self):
        name = self.name("m")
        white = self.draw.choice(["white", "#fff", "rgb(255,255,255)"])
        inner = self.area_shape(f'fill="{white}" stroke="none"')
        if self.draw.random() < 0.4:
            inner += '<circle cx="18" cy="18" r="6" fill="black" stroke="none"/>'
        self.defs.append(
            f'<mask id="{name}" maskUnits="userSpaceOnUse" x="0" y="0" width="40" height="40">'
            f"{inner}</mask>"
        )
        return self.shape(f'mask="url(#{name})"')

    def filled(self):
        """An area without a line."""
        rule = self.draw.choice(["", 'fill-rule="evenodd"'])
        return self.area_shape(f'fill="{self.draw.choice(BLACK)}" stroke="none" {rule}')

    def filled_and_clipped(self):
        where = f'clip-path="url(#{self.clip()})"'
        return f'<g {where}>{self.area_shape("""fill="black" stroke="none" """)}</g>'


KINDS = (
    *("plain", "path", "path", "transformed", "transformed", "odd_transform", "viewported", "used"),
    *("pale", "pale", "styled", "styled", "spoken", "clipped", "clipped", "masked", "filled"),
    *("filled_and_clipped",),
)


def drawing(seed):
    """An SVG, by a seed."""
    return Maker(seed).svg()
