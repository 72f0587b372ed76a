// Elements of the page, and canvases in the screen's resolution.

const byId = (id) => document.getElementById(id);

/**
 * Make an element.
 * @param {string} tag with classes after dots: "span.value"
 * @param {object} props properties of the element ("title", "onclick"), or attributes ("aria-label")
 */
function h(tag, props = {}, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name);
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(props)) {
    if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children);
  return element;
}

/** Set a text only if it differs, so that screen readers and layout see no other change. */
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Return a short SVG line in the color and dash of a curve; SVG also prints. */
function swatch(color, dash) {
  const svg = byId("swatch").content.firstElementChild.cloneNode(true);
  svg.firstElementChild.setAttribute("stroke", color);
  svg.firstElementChild.setAttribute("stroke-dasharray", dash.join(" "));
  return svg;
}

/** Return a checkbox. */
const checkbox = (checked, label, onchange) => h("input", { type: "checkbox", checked, ariaLabel: label, onchange });

/** Listen to the pointer on an element; `on` has a function for each type of event. */
function listen(target, on, options = {}) {
  for (const [type, fn] of Object.entries(on)) target.addEventListener(type, fn, options);
}

/** Fit a canvas to its size in the page, clear it and return its context, in CSS pixels, with its width and height. */
function clearedCanvas(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = window.devicePixelRatio;
  canvas.width = Math.round(width * ratio); // this clears it
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  return { context, width, height };
}

/** Begin a path of lines, each of some points [pixels]. */
function beginLines(context, ...lines) {
  context.beginPath();
  for (const points of lines) points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
}

/** Begin a path of a rounded rectangle and fill it. */
function fillRounded(context, color, x, y, width, height, radius) {
  context.fillStyle = color;
  context.beginPath();
  context.roundRect(x, y, width, height, radius);
  context.fill();
}

/** Write a text; `style` are properties of the context: font, textAlign, textBaseline, fillStyle. */
function writeText(context, text, x, y, style) {
  Object.assign(context, style);
  context.fillText(text, x, y);
}
