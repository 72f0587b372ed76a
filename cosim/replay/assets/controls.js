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
  const apart = ([a, b]) => Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
  const release = ({ pointerId }) => held.delete(pointerId);
  const prevent = (event) => event.preventDefault();
  listen(canvas, {
    pointerdown(event) {
      if (event.defaultPrevented) return;
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.offsetX, event.offsetY]);
    },
    pointermove({ pointerId, offsetX, offsetY, shiftKey, buttons }) {
      if (!held.has(pointerId)) return;
      const before = [...held.values()];
      const [x, y] = held.get(pointerId);
      held.set(pointerId, [offsetX, offsetY]);
      const [dx, dy] = [offsetX - x, offsetY - y];
      if (held.size === 2) {
        camera().pan(0.5 * dx, 0.5 * dy);
        camera().zoom(apart([...held.values()]) / apart(before));
      } else if (held.size === 1 && (shiftKey || buttons & 6)) camera().pan(dx, dy);
      else if (held.size === 1) camera().orbit(dx, dy);
    },
    pointerup: release,
    pointercancel: release,
    lostpointercapture: release,
    mousedown(event) {
      if (event.button === 1) prevent(event); // the middle button pans here, it does not scroll the page
    },
    contextmenu: prevent,
    dblclick: () => camera().fit(),
  });
  const wheel = (event) => {
    prevent(event);
    const lines = event.deltaMode === 1 ? 30 : 1; // some wheels report lines instead of pixels
    camera().zoom(Math.exp(-0.0016 * clamp(lines * event.deltaY, -300, 300)));
  };
  listen(canvas, { wheel }, { passive: false });
}
