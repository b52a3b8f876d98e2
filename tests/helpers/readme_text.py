"""Reading of a README: its blocks, commands, tables, links and names; no sentence of it."""

import re

from places import ROOT


def blocks(text, language):
    """Return the bodies of the fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def prose(text):
    """Return the text without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def words(text):
    """Return the words that people have written: not those of fenced blocks and of made parts."""
    written = re.sub(r"<!-- \[\[\[cog .*?\[\[\[end\]\]\] -->", "", text, flags=re.DOTALL)
    return [word for word in prose(written).split() if re.search(r"\w", word)]


def section(text, heading):
    """Return what stands under a heading, up to the next of its level."""
    found = re.search(rf"^(#+) {re.escape(heading)}\n(.*?)(?=^\1 |\Z)", text, re.M | re.S)
    return found.group(2)


def rows(text):
    """Yield the rows of all tables as dicts, heading of the column -> cell."""
    heads = None
    for line in prose(text).splitlines():
        if not line.startswith("|"):
            heads = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if heads is None:
            heads = cells
        elif any(cell.strip("-") for cell in cells):
            yield dict(zip(heads, cells))


def stories(text):
    """Yield the commands as tuples of those that belong together."""
    for block in blocks(text, "sh"):
        lines = [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]
        one = re.match(r"cp |.*\bbrickservo track ", lines[0])  # else each stands for itself
        yield from [tuple(lines)] if one else [(line,) for line in lines]
    for row in rows(text):
        if row.get("command"):
            assert re.fullmatch(r"`[^`]+`", row["command"]), f"no command: {row}"
            yield (row["command"].strip("`"),)
    for code in re.findall(r"`([^`\n]+)`", prose(text)):
        if re.match(r"\.uv/bin/uv run (?!brickservo$)|python3 -m |robot/\w+\.py -", code):
            yield (code,)


def named(text):
    """Return all names within backquotes in a text, outside of its fenced blocks."""
    code = re.findall(r"`([^`\n]+)`", prose(text))
    return {name.strip("./") for span in code for name in re.findall(r"[\w./-]+", span)}


def options(text):
    """Return all long options in a text."""
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*(?!\w)", text))


def links(text):
    """Return the targets of links and pictures."""
    return re.findall(r"\]\(([^)\s]+)\)", prose(text))


def anchors(text):
    """Return the anchors of the headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", prose(text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in headings}


def is_broken(target, path):
    """Return True if a link in a file leads nowhere; of an address only the form counts."""
    if "://" in target:
        return not re.fullmatch(r"https://[\w-]+(\.[\w-]+)+(/[\w./#?=&~%-]*)?", target)
    name, _, anchor = target.partition("#")
    file = (path.parent / name).resolve() if name else path
    if file != ROOT and ROOT not in file.parents or not file.exists():
        return True
    return bool(anchor) and (file.is_dir() or anchor not in anchors(file.read_text("utf-8")))
