// Colours, numbers and elements.

const rgbOf = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const mixed = (a, b, share) => a.map((value, at) => Math.round(value + (b[at] - value) * share));
const cssOf = (rgb) => `rgb(${rgb.join(" ")})`;

// A colour scale of 64 stops as 256 colours.
function scaleOf(stops) {
  const colours = stops.map(rgbOf);
  return Array.from({ length: 256 }, (_, at) => {
    const place = (at / 255) * (colours.length - 1);
    const low = Math.min(Math.floor(place), colours.length - 2);
    return mixed(colours[low], colours[low + 1], place - low);
  });
}

const gradientOf = (stops) => `linear-gradient(to right, ${stops.filter((_, at) => at % 7 === 0).join(", ")})`;

// Contrast of two colours as WCAG counts it.
function contrast(a, b) {
  const light = (rgb) => {
    const [red, green, blue] = rgb.map((value) => {
      const share = value / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
  };
  const [more, less] = [light(a), light(b)].sort((x, y) => y - x);
  return (more + 0.05) / (less + 0.05);
}

// A colour made darker until it stands out from white, or left as it is on dark ground.
function lineColour(rgb, isLight) {
  let colour = rgb;
  for (let tries = 0; isLight && contrast(colour, [255, 255, 255]) < 3.4 && tries < 40; tries++) {
    colour = mixed(colour, [0, 0, 0], 0.05);
  }
  return cssOf(colour);
}

// A number with three significant digits and its thousands apart.
function figure(value) {
  if (value === null || !Number.isFinite(value)) return "n/a";
  const size = Math.abs(value);
  const digits = size >= 100 || size === 0 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  const text = size >= 1000 ? Math.round(size).toLocaleString("en-US") : size.toFixed(digits);
  return value < 0 ? `−${text}` : text;
}

const metres = (value) => `${value < -0.0005 ? "−" : ""}${Math.abs(value).toFixed(2)}`;

// An element with attributes and children; text is always text.
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

// The name of SVG's namespace, as the browser knows it.
const SVG_SPACE = new DOMParser().parseFromString("<svg></svg>", "text/html").body.firstChild.namespaceURI;

function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG_SPACE, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// A patch of colour with its name.
const swatch = (colour, name) => make("span", { class: "swatch" }, make("i", { style: `background:${colour}` }), name);

// A colour scale with what its ends stand for.
const scaleBar = (stops, low, name, high) =>
  make("div", { class: "scale" }, make("i", { style: `background:${gradientOf(stops)}` }),
    make("span", {}, low), make("span", {}, name), make("span", {}, high));
