// Upload of files to draw: dropped anywhere on the page, or chosen.
async function sendDrawing(file, most) {
  if (!file) return;
  emitEvent("drawing-sent", file.name);
  if (file.size > most) {
    emitEvent("drawing-refused", `${file.name}: more than ${most / 1e6} MB; make it smaller`);
    return;
  }
  try {
    const answer = await fetch(`/drawing?name=${encodeURIComponent(file.name)}`, {
      method: "POST",
      headers: { "content-type": "application/octet-stream" },
      body: file,
    });
    const why = await answer.text();
    if (why || !answer.ok) emitEvent("drawing-refused", why || `${file.name}: not taken`);
  } catch (error) {
    emitEvent("drawing-refused", `${file.name}: the page is cut off; try again`);
  }
}

// Accept files that are dropped on the page.  most: greatest size, bytes.
function acceptDrops(most) {
  const hasFile = event => [...(event.dataTransfer?.types ?? [])].includes("Files");
  let inside = 0; // number of nested elements under the pointer
  const show = shown => document.body.classList.toggle("dropping", shown);
  addEventListener("dragenter", event => {
    if (hasFile(event)) show(++inside > 0);
  });
  addEventListener("dragleave", event => {
    if (hasFile(event)) show(--inside > 0);
  });
  addEventListener("dragover", event => {
    if (hasFile(event)) event.preventDefault();
  });
  addEventListener("drop", event => {
    if (!hasFile(event)) return;
    event.preventDefault();
    show((inside = 0) > 0);
    sendDrawing(event.dataTransfer.files[0], most);
  });
}

// Let the user choose a file.
function chooseDrawing(most) {
  const field = document.createElement("input");
  field.type = "file";
  field.accept = ".svg,.svgz,.png,.jpg,.jpeg,.txt,image/svg+xml,image/png,image/jpeg";
  field.addEventListener("change", () => sendDrawing(field.files[0], most));
  field.click();
}
