// SPDX-License-Identifier: Apache-2.0
// Colour maps. All are monotone in lightness (deviation: on either side of zero), so that they hold in grey print and for
// eyes that tell red from green badly. A map is a list of stops {value, rgb}, linear between them in sRGB.

const blue_white_red = [
  [5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [247, 247, 247],
  [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31],
];
const blues = [[209, 227, 243], [146, 195, 222], [75, 151, 201], [25, 100, 171], [8, 48, 107]];
const browns = [[255, 247, 214], [254, 211, 112], [244, 147, 38], [190, 82, 8], [94, 34, 6]];
const purples = [[69, 27, 120], [116, 83, 165], [160, 144, 197], [206, 200, 226], [240, 238, 246]];

export const kNotScanned = [154, 158, 163];

const spread = (colours, low, high) =>
  colours.map((rgb, i) => ({ value: low + ((high - low) * i) / (colours.length - 1), rgb }));

/** Blue below zero, red above; `low` < 0 < `high`. */
export const deviation_stops = (low, high) => {
  const half = (blue_white_red.length - 1) / 2;
  return blue_white_red.map((rgb, i) => ({ value: i <= half ? low * (1 - i / half) : (high * (i - half)) / half, rgb }));
};
export const coverage_stops = (low, high) => spread(blues, low, high);
export const uncertainty_stops = (low, high) => spread(browns, low, high);
export const age_stops = (low, high) => spread(purples, low, high);

/** The stops of another range: each side of zero stretched on its own, so that zero keeps its colour. */
export function stretched(stops, low, high) {
  const [old_low, old_high] = [stops[0].value, stops[stops.length - 1].value];
  return stops.map(({ value, rgb }) => ({ value: value < 0 ? (value / old_low) * low : old_high ? (value / old_high) * high : 0, rgb }));
}

/** RGB (0 to 255) at a value; the ends hold beyond the range. */
export function colour_at(stops, value) {
  if (value <= stops[0].value) return stops[0].rgb;
  for (let i = 1; i < stops.length; ++i) {
    const [a, b] = [stops[i - 1], stops[i]];
    if (value > b.value) continue;
    const t = b.value > a.value ? (value - a.value) / (b.value - a.value) : 1;
    return a.rgb.map((from, k) => from + (b.rgb[k] - from) * t);
  }
  return stops[stops.length - 1].rgb;
}

/** Discrete steps of a deviation map: the tolerance band is one step, what lies beyond is cut into `each` on either side. */
export function deviation_steps(stops, tolerance, each = 4) {
  const low = stops[0].value;
  const high = stops[stops.length - 1].value;
  const inside = tolerance && tolerance[0] > low && tolerance[1] < high;
  const band = inside ? tolerance : [low / (2 * each + 1), high / (2 * each + 1)];
  const edges = [];
  for (let i = 0; i < each; ++i) edges.push(low + ((band[0] - low) * i) / each);
  edges.push(band[0]);
  for (let i = 0; i <= each; ++i) edges.push(band[1] + ((high - band[1]) * i) / each);
  return edges.slice(1).map((to, i) => {
    const from = edges[i];
    // Each step shows its far end's side of the map, so that steps beyond the band never look like the band.
    const at = i < each ? from + (to - from) * 0.35 : i === each ? 0 : from + (to - from) * 0.65;
    return { from, to, rgb: colour_at(stops, at).map(Math.round) };
  });
}

/** Equal steps of any map. */
export function even_steps(stops, count) {
  const low = stops[0].value;
  const high = stops[stops.length - 1].value;
  return Array.from({ length: count }, (_, i) => {
    const from = low + ((high - low) * i) / count;
    const to = low + ((high - low) * (i + 1)) / count;
    const at = count > 1 ? low + ((high - low) * i) / (count - 1) : high;
    return { from, to, rgb: colour_at(stops, at).map(Math.round) };
  });
}

/** RGBA bytes of `size` texels from low to high, for a shader to look up. */
export function lookup(stops, steps, size = 512) {
  const low = stops[0].value;
  const high = stops[stops.length - 1].value;
  const texels = new Uint8Array(size * 4);
  for (let i = 0; i < size; ++i) {
    const value = low + ((high - low) * (i + 0.5)) / size;
    const rgb = steps ? (steps.find((step) => value < step.to) ?? steps[steps.length - 1]).rgb : colour_at(stops, value);
    texels.set([...rgb.map(Math.round), 255], i * 4);
  }
  return texels;
}

/** A colour for the i-th of many things that must be told apart: hues by the golden angle, three lightnesses in turn. */
export function category_colour(i) {
  const hue = (i * 137.508 + 220) % 360;
  const lightness = [0.62, 0.76, 0.5][i % 3];
  const chroma = 0.12;
  const [a, b] = [chroma * Math.cos((hue * Math.PI) / 180), chroma * Math.sin((hue * Math.PI) / 180)];
  return rgb_of_oklab(lightness, a, b);
}

function rgb_of_oklab(lightness, a, b) {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  return linear.map((value) => {
    const clipped = Math.min(1, Math.max(0, value));
    return Math.round(255 * (clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * clipped ** (1 / 2.4) - 0.055));
  });
}

/** CIE L* (0 to 100) of an sRGB colour. */
export function lightness_of(rgb) {
  const [r, g, b] = rgb.map((value) => {
    const c = value / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  return y > 216 / 24389 ? 116 * Math.cbrt(y) - 16 : (y * 24389) / 27;
}

export const css_colour = (rgb) => `rgb(${rgb.map(Math.round).join(' ')})`;
