// Colors of Okabe and Ito, which color-blind readers can distinguish, on paper and on a dark screen.

/** Colors of the paths of several runs; first those that no criterion has. */
const RUN_COLOURS = ["#0072B2", "#CC79A7", "#9A7B00", "#7C8A94", "#009E73", "#E69F00", "#D55E00", "#56B4E9"];

/** Colors of the scene, other than those of regions. */
const SCENE_THEMES = {
  light: {
    skyTop: "#f7fbfd",
    skyBottom: "#d9e8f1",
    ink: "#1d2b36",
    soft: "#5b6f7e",
    grid: "rgba(40, 75, 100, 0.16)",
    gridMajor: "rgba(40, 75, 100, 0.34)",
    floor: "rgba(255, 255, 255, 0.45)",
    shadow: "rgba(20, 45, 65, 0.13)",
    halo: "rgba(247, 251, 253, 0.85)",
    chip: "rgba(255, 255, 255, 0.82)",
    future: "rgba(29, 43, 54, 0.46)",
    muted: "#a9b4bc",
    thrust: "#A6407A",
    water: "#0060a8",
    hull: { float: "#E8C81F", frame: "#33424d", tube: "#8fa1ad", dome: "#a5dcf3", skid: "#4a5a66", duct: "#51626e" },
  },
  dark: {
    skyTop: "#12212d",
    skyBottom: "#070e14",
    ink: "#e6eef4",
    soft: "#93a8b7",
    grid: "rgba(150, 195, 225, 0.13)",
    gridMajor: "rgba(150, 195, 225, 0.30)",
    floor: "rgba(90, 140, 170, 0.05)",
    shadow: "rgba(0, 0, 0, 0.38)",
    halo: "rgba(7, 14, 20, 0.75)",
    chip: "rgba(14, 25, 34, 0.82)",
    future: "rgba(230, 238, 244, 0.42)",
    muted: "#6f808c",
    thrust: "#F29AC8",
    water: "#7cc0f5",
    hull: { float: "#F0DC4E", frame: "#5b6b77", tube: "#a5b6c1", dome: "#b5e6fa", skid: "#71828e", duct: "#7d8f9b" },
  },
};

/** Return the red, green and blue channels of "#rrggbb". */
function channelsOf(colour) {
  const number = parseInt(colour.slice(1), 16);
  return [(number >> 16) & 255, (number >> 8) & 255, number & 255];
}

/** Return the color at the share `part` from one "#rrggbb" to another. */
function mixedColour(from, to, part) {
  const [a, b] = [channelsOf(from), channelsOf(to)];
  const hex = a.map((x, i) => Math.round(x + part * (b[i] - x)).toString(16).padStart(2, "0"));
  return `#${hex.join("")}`;
}

/** Return a color mixed with ink until its contrast to the background of a theme is 3 to 1. */
function legible(colour, theme) {
  const [ground, ink] = theme === "dark" ? ["#121c25", "#ffffff"] : ["#ffffff", "#000000"];
  const light = (hex) => {
    const linear = channelsOf(hex).map((x) => (x <= 10 ? x / 3295 : ((x / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] + 0.05;
  };
  const contrast = (hex) => Math.max(light(hex) / light(ground), light(ground) / light(hex));
  let part = 0;
  while (contrast(mixedColour(colour, ink, part)) < 3) part += 0.05;
  return mixedColour(colour, ink, part);
}

/**
 * Return the color of a region: full if it is active, else muted in the same hue.
 * @param {object} region of the header  @param {boolean} active  @param {"light"|"dark"} theme
 */
function regionColour(region, active, theme) {
  return active ? region.colour : mixedColour(region.colour, SCENE_THEMES[theme].muted, 0.45);
}

/** Return the color of a run's trail on a page with several runs. */
function runColour(index) {
  return RUN_COLOURS[index % RUN_COLOURS.length];
}
