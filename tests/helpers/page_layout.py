"""What a page looks like in windows of several sizes: what is in sight, covered, or too small."""

from tests.claims.page_pictures import SIZES

LEAST = 0.55, 0.55, 0.5, 0.3
"""Share of each of these windows that pictures have at least."""
PHONE = 500
"""Windows with a side shorter than that, px, are pressed by thumbs."""
THUMB = 44
"""A finger hits what is so large, px (WCAG 2.1, 2.5.5)."""

LOOK = """([wanted, pressed, thumb]) => {
  const within = (inner, outer) => inner.left >= outer.left - 1 && inner.top >= outer.top - 1
    && inner.right <= outer.right + 1 && inner.bottom <= outer.bottom + 1;
  const cut = (one, other) => ({
    left: Math.max(one.left, other.left), right: Math.min(one.right, other.right),
    top: Math.max(one.top, other.top), bottom: Math.min(one.bottom, other.bottom) });
  const area = box => Math.max(0, box.right - box.left) * Math.max(0, box.bottom - box.top);
  const screen = { left: 0, top: 0, right: innerWidth, bottom: innerHeight };
  const shown = element => {  // what of it is to be seen: not what a scrolled part hides
    let box = cut(element.getBoundingClientRect(), screen);
    for (let above = element.parentElement; above; above = above.parentElement)
      if (getComputedStyle(above).overflowY !== "visible" && above !== document.documentElement
          && above !== document.body) box = cut(box, above.getBoundingClientRect());
    return box;
  };
  const all = selector => [...document.querySelectorAll(selector)].filter(element =>
    element.checkVisibility({ checkVisibilityCSS: true, checkOpacity: true })
    && area(element.getBoundingClientRect()) > 0);
  const name = element => element.ariaLabel || element.innerText?.trim().split("\\n")[0]
    || element.className;
  const said = [];
  for (const selector of wanted) {
    const found = all(selector);
    if (!found.length) said.push(`${selector} is not shown`);
    for (const element of found)
      if (!within(element.getBoundingClientRect(), shown(element)))
        said.push(`${selector} (${name(element)}) is not in sight`);
  }
  const page = document.documentElement;
  if (page.scrollWidth > innerWidth || page.scrollHeight > innerHeight)
    said.push(`the page scrolls: ${page.scrollWidth} x ${page.scrollHeight}`);
  const controls = all(pressed).filter(element => area(shown(element)) > 0);
  const small = [];
  for (const [k, one] of controls.entries()) {
    const { width, height } = one.getBoundingClientRect();
    if (Math.min(width, height) < thumb)
      small.push(`${name(one)}: ${width.toFixed(0)} x ${height.toFixed(0)}`);
    for (const other of controls.slice(k + 1)) {
      if (one.contains(other) || other.contains(one)) continue;
      const both = cut(shown(one), shown(other));
      if (both.right - both.left > 1 && both.bottom - both.top > 1)
        said.push(`${name(one)} and ${name(other)} overlap`);
    }
  }
  const pictures = all(".picture").map(picture => area(shown(picture)));
  const share = pictures.reduce((sum, each) => sum + each, 0) / area(screen);
  return { said, small, share };
}"""
CONTROLS = "button, a, .q-checkbox, .q-toggle, .q-slider, .q-field, .q-item, .picture"


SETTLED = """async () => {
  const painted = () => new Promise(done => requestAnimationFrame(() => setTimeout(done)));
  await painted();
  await painted();
  for (const each of document.getAnimations())
    if (isFinite(each.effect.getComputedTiming().endTime)) each.finish();
  await painted();
}"""


def settle(page):
    """Bring what a change has set going, such as of colours, to its end."""
    page.evaluate(SETTLED)


def turn_folds(page, is_open):
    """Open all that folds away and can be seen, or close it."""
    closed = page.locator(f".fold [role=button][aria-expanded={str(not is_open).lower()}]:visible")
    while closed.count():
        # Wherever it is scrolled to; and the last click may have come into effect since.
        closed.evaluate_all("heads => heads.slice(0, 1).forEach(head => head.click())")
        page.wait_for_timeout(50)


def complaints(page, wanted, least_shares=LEAST):
    """What is wrong in each of the sizes, in words.

    Args:
        page: of a browser.
        wanted: selectors of what must be wholly in sight.
        least_shares: of each window that the pictures have.
    """
    before = page.viewport_size
    wrong = []
    for (width, height), least in zip(SIZES, least_shares, strict=True):
        page.set_viewport_size({"width": width, "height": height})
        settle(page)
        seen = page.evaluate(LOOK, [list(wanted), CONTROLS, THUMB])
        said = seen["said"]
        if seen["share"] < least:
            said.append(f"the pictures have {seen['share']:.2f} of the window")
        if min(width, height) < PHONE:
            said += [f"too small for a thumb: {small}" for small in seen["small"]]
        wrong += [f"{width} x {height}: {words}" for words in said]
    page.set_viewport_size(before)
    return wrong


def barriers(page):
    """What keeps people from using the page, by axe-core: serious and critical, light and dark."""
    from axe_playwright_python.sync_playwright import Axe

    wrong = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        page.wait_for_function(f"document.body.classList.contains('body--{scheme}')")
        settle(page)
        found = Axe().run(page).response["violations"]
        wrong += [
            f"{scheme}: {each['id']}: {node['target']} {node.get('failureSummary', '')}"
            for each in found
            if each["impact"] in ("serious", "critical")
            for node in each["nodes"]
        ]
    page.emulate_media(color_scheme="light")
    return wrong
