// Camera control: drag orbits, right button or Shift pans, wheel or two fingers zoom.

/**
 * Connect pointer and wheel events of a canvas to a camera.
 *
 * A listener that handles a pointer itself, such as dragging a region, listens on the canvas in the capturing phase.
 * It calls preventDefault() on the pointerdown event.
 * @param {HTMLCanvasElement} canvas  @param {function(): Camera} camera returns the current camera
 */
function controlCamera(canvas, camera) {
  const held = new Map(); // position [pixels] of each pressed pointer
  canvas.style.touchAction = "none"; // else a finger would scroll the page too
  const place = (event) => [event.offsetX, event.offsetY];

  canvas.addEventListener("pointerdown", (event) => {
    if (event.defaultPrevented) return;
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, place(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return;
    const before = [...held.values()];
    const [x, y] = held.get(event.pointerId);
    held.set(event.pointerId, place(event));
    const [dx, dy] = [event.offsetX - x, event.offsetY - y];
    if (held.size === 1) {
      if (event.shiftKey || event.buttons & 6) camera().pan(dx, dy);
      else camera().orbit(dx, dy);
    } else if (held.size === 2) {
      const after = [...held.values()];
      const apart = ([a, b]) => Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
      camera().pan(0.5 * dx, 0.5 * dy);
      camera().zoom(apart(after) / apart(before));
    }
  });
  const release = (event) => held.delete(event.pointerId);
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("lostpointercapture", release);
  canvas.addEventListener("mousedown", (event) => {
    if (event.button === 1) event.preventDefault(); // the middle button pans here, it does not scroll the page
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => camera().fit());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1; // some wheels report lines instead of pixels
      camera().zoom(Math.exp(-0.0016 * Math.max(-300, Math.min(300, lines * event.deltaY))));
    },
    { passive: false },
  );
}
