// Colors: those of the theme are CSS variables; criteria and runs have colors of Okabe and Ito.

const COLORS = {}; // of the page's theme, by name, as style.css has them

/** Read the colors of the theme; call this when it changes. */
function readColors() {
  const root = [...document.styleSheets[0].cssRules].find(({ selectorText }) => selectorText === ":root");
  const style = getComputedStyle(document.documentElement);
  for (const name of root.style) {
    if (name.startsWith("--")) COLORS[name.slice(2)] = style.getPropertyValue(name).trim();
  }
}

/** Colors of Okabe and Ito, which criteria have; curves have them as hues of the theme. */
const PALETTE = { vermillion: "#d55e00", orange: "#e69f00", sky: "#56b4e9", purple: "#cc79a7", green: "#009e73" };

/** Colors of the paths of several runs; first those that no criterion has. */
const { purple, green, orange, vermillion, sky } = PALETTE;
const RUN_COLORS = ["#0072b2", purple, "#9a7b00", "#7c8a94", green, orange, vermillion, sky];

/** Return the color of a run's trail on a page with several runs. */
const runColor = (index) => RUN_COLORS[index % RUN_COLORS.length];

/** Return the red, green and blue channels of "#rrggbb". */
const channelsOf = (color) => [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16));

/** Return the color at the share `part` from one "#rrggbb" to another. */
function mixedColor(from, to, part) {
  const [a, b] = [channelsOf(from), channelsOf(to)];
  const hex = a.map((x, i) => Math.round(x + part * (b[i] - x)).toString(16).padStart(2, "0"));
  return `#${hex.join("")}`;
}

/** Return the relative luminance of a color, plus 0.05, as WCAG defines contrast. */
function luminance(color) {
  const linear = channelsOf(color).map((x) => (x <= 10 ? x / 3295 : ((x / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] + 0.05;
}

/** Return a color mixed with black or white until its contrast to the cards of the theme is 3 to 1. */
function legible(color) {
  const ground = luminance(COLORS.card);
  const ink = ground < 0.5 ? "#ffffff" : "#000000";
  for (let part = 0; ; part += 0.05) {
    const light = luminance(mixedColor(color, ink, part));
    if (Math.max(light / ground, ground / light) >= 3) return mixedColor(color, ink, part);
  }
}

/** Return the color of a region of the header in the scene: full if it is active, else muted in the same hue. */
const regionColor = ({ color }, active) => (active ? color : mixedColor(color, COLORS.faded, 0.45));
