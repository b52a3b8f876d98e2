// Show an image's overlay once the image itself is loaded.
function showOverlay(event, image, emit) {
  image.querySelector(".over").innerHTML = image.dataset.over;
  image.closest(".picture").dataset.taken = image.dataset.taken;
  emit(event.source);
}

// Report the address of an image that failed to load; "" of an element that has none yet.
function reportRefusal(event, emit) {
  emit(event.target.src || "");
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

// Move a cross in the picture by the arrow keys, and click there by Enter.
function pressKey(event, emit) {
  const picture = event.currentTarget;
  const image = picture.querySelector("img");
  // (The size is 0 while the next image is loading.)
  if (image.naturalWidth) picture.size = [image.naturalWidth, image.naturalHeight];
  const [width, height] = picture.size ?? [0, 0];
  const arrow = ARROWS[event.key];
  if (!width || !(arrow || event.key === "Enter")) return;
  event.preventDefault();
  event.stopPropagation(); // elsewhere on the page, arrows step through a recording
  let [u, v] = picture.cross ?? [Math.round(width / 2), Math.round(height / 2)];
  if (arrow) {
    const step = event.shiftKey ? 1 : 8; // px
    u = Math.min(Math.max(0, u + step * arrow[0]), width - 1);
    v = Math.min(Math.max(0, v + step * arrow[1]), height - 1);
  }
  picture.cross = [u, v];
  const k = width / 640;
  const path = `M${u - 18 * k},${v}h${12 * k}m${12 * k},0h${12 * k}M${u},${v - 18 * k}v${12 * k}m0,${12 * k}v${12 * k}`;
  picture.querySelector(".cross").innerHTML =
    `<path d="${path}" stroke="#000" stroke-width="${5 * k}"/><path d="${path}" stroke="#fff" stroke-width="${2 * k}"/>`;
  if (event.key === "Enter") emit([u, v]);
}

// Show a drawing over the picture.  svg: contents of an SVG group, without any text of users.
function showDrawing(id, svg) {
  const layer = getHtmlElement(id)?.querySelector(".drawing");
  if (layer) layer.innerHTML = svg;
}

// Show ink.  path: SVG path data, appended to what is shown or replacing it; k: scale of the line.
function showInk(id, path, replace, k) {
  const ink = getHtmlElement(id)?.querySelector(".ink");
  if (!ink) return;
  const before = replace ? "" : ink.getAttribute("d") ?? "";
  ink.setAttribute("transform", "translate(.5 .5)");
  ink.setAttribute("stroke-width", 2 * k);
  ink.setAttribute("d", before + path);
}
