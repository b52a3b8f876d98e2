// Show an image's overlay, which is set already: only now is the image itself there.
function showOverlay(event, image, emit) {
  image.querySelector(".over").innerHTML = image.dataset.over;
  emit(event.source);
}

// Tell which image cannot be had: "" for the none that an element has at first.
function reportRefusal(event, emit) {
  emit(event.target.src || "");
}
