// SPDX-License-Identifier: Apache-2.0
// What the part can be coloured by. A mode: {id, label, note, values, categories, colouring(settings), legend(settings), range | null}.
import {
  category_colour, coverage_stops, deviation_steps, deviation_stops, even_steps, kNotScanned, lookup, uncertainty_stops,
} from '../shared/colours.js';
import { number } from '../shared/format.js';
import { scale_bar, swatches } from '../shared/legend.js';
import { verdict_colours } from '../shared/verdict.js';

const kHatch = [...[kNotScanned], [178, 182, 187]];
const not_scanned = (name = 'not scanned') => ({ name, rgb: kHatch[0], other: kHatch[1] });
const kWithin = [222, 227, 232];
const kOver = [196, 62, 46];
const kUnder = [36, 98, 172];
const kFacesInLegend = 7;
const kChosen = [255, 193, 7];

/** The tolerance that the whole part has, for legend and histogram. */
export const tolerance_of = ({ tolerance }) =>
  tolerance && tolerance.low !== null && tolerance.high !== null && tolerance.low !== undefined ? [tolerance.low, tolerance.high] : null;

/** The range and the stops that all pictures of this report start with. */
export function default_deviation_map(report) {
  if (report.colours?.stops?.length > 1) return { stops: report.colours.stops, steps: report.colours.steps ?? null };
  const tolerance = tolerance_of(report);
  const reach = Math.max(report.over_area?.p99 ?? 0, ...(tolerance ?? []).map((limit) => 2 * Math.abs(limit))) || 1;
  return { stops: deviation_stops(-reach, reach, tolerance), steps: null };
}

/** The deviation map over another range. */
export function deviation_map(report, { low, high }) {
  const given = default_deviation_map(report);
  const same = low === given.stops[0].value && high === given.stops[given.stops.length - 1].value;
  const stops = same ? given.stops : deviation_stops(low, high, tolerance_of(report));
  return { stops, steps: (same && given.steps?.length && given.steps) || deviation_steps(stops, tolerance_of(report)) };
}

function scalar_mode({ id, label, note, values, range, map, bar = {}, unknown }) {
  const chosen = (settings) => {
    const { stops, steps } = map(settings);
    return { stops, steps: settings.steps || bar.whole_numbers ? steps : null };
  };
  return {
    id, label, note, values, range,
    colouring(settings) {
      const { stops, steps } = chosen(settings);
      return { texels: lookup(stops, steps), low: stops[0].value, high: stops[stops.length - 1].value, unknown: kHatch };
    },
    legend: (settings) => [scale_bar({ ...chosen(settings), ...bar }), swatches([not_scanned(unknown)])],
  };
}

function category_mode({ id, label, note, values, colours, legend }) {
  return {
    id, label, note, values, range: null, categories: true,
    colouring(settings) {
      const list = colours(settings.chosen);
      const texels = new Uint8Array(Math.max(1, list.length) * 4).fill(255);
      list.forEach((rgb, i) => texels.set(rgb, 4 * i));
      return { texels, low: -0.5, high: Math.max(1, list.length) - 0.5, categories: true, unknown: kHatch };
    },
    legend: () => [swatches([...legend(), not_scanned()])],
  };
}

function deviation_mode(report, scene) {
  const { stops } = default_deviation_map(report);
  return scalar_mode({
    id: 'deviation', label: 'Deviation', note: `mm, ${report.sign ?? 'positive: outside the material'}`, values: scene.deviation,
    range: { low: stops[0].value, high: stops[stops.length - 1].value, through_zero: true },
    map: (settings) => deviation_map(report, settings), bar: { tolerance: tolerance_of(report), signs: true },
  });
}

function coverage_mode(scene) {
  const most = Math.min(8, Math.max(1, scene.support.reduce((a, b) => Math.max(a, b), 0)));
  const stops = coverage_stops(0.5, most + 0.5);
  return scalar_mode({
    id: 'coverage', label: 'Coverage', note: 'scans that see each spot', values: Float32Array.from(scene.support, (count) => count || NaN), range: null,
    map: () => ({ stops, steps: even_steps(stops, most) }), bar: { whole_numbers: true },
  });
}

function uncertainty_mode(scene) {
  const known = scene.sigma.filter(Number.isFinite).sort();
  if (!known.length) return null;
  const high = Number(known[Math.floor(0.98 * (known.length - 1))].toPrecision(2)) || 1;
  return scalar_mode({
    id: 'uncertainty', label: 'Uncertainty', note: 'standard error of the deviation, mm', values: scene.sigma, range: { low: 0, high },
    map: ({ low, high: top }) => { const stops = uncertainty_stops(low, top); return { stops, steps: even_steps(stops, 6) }; }, unknown: 'not known',
  });
}

function scan_mode(report, scene) {
  const used = new Set(scene.scan.filter((index) => !Number.isNaN(index)));
  return category_mode({
    id: 'scan', label: 'Scan', note: 'the scan that brought most points', values: scene.scan,
    colours: (chosen) => report.scans.map((_, i) => (chosen?.scan !== undefined && chosen.scan !== i ? kWithin : category_colour(i))),
    legend: () => report.scans.filter((_, i) => used.has(i)).map((scan) => ({ name: scan.name, rgb: category_colour(scan.index) })),
  });
}

function region_mode(report, scene) {
  const values = scene.region.map((region, v) => (!Number.isNaN(region) ? region + 1 : Number.isNaN(scene.deviation[v]) ? NaN : 0));
  const has_tolerance = tolerance_of(report) !== null || report.verdict?.tolerance_given;
  return category_mode({
    id: 'regions', label: has_tolerance ? 'Out of tolerance' : 'Conspicuous', values,
    note: has_tolerance ? 'connected regions beyond the tolerance' : 'regions that deviate far more than their noise',
    colours: (chosen) => [kWithin, ...report.regions.map((region, i) => (chosen?.region === i ? kChosen : region.peak > 0 ? kOver : kUnder))],
    legend: () => [{ name: 'too high', rgb: kOver }, { name: 'too low', rgb: kUnder }, { name: has_tolerance ? 'within' : 'others', rgb: kWithin }],
  });
}

function face_mode(report, scene) {
  const verdicts = report.faces.map((face) => face.verdict);
  const judged = verdicts.some((verdict) => verdict);
  const values = scene.face.map((face) => (verdicts[face] === 'not scanned' || (report.faces[face] && !report.faces[face].spots_scanned) ? NaN : face));
  return category_mode({
    id: 'faces', label: judged ? 'Face verdicts' : 'Faces', note: judged ? 'verdict of each CAD face' : 'faces of the model', values,
    colours: (chosen) => report.faces.map((face, i) => (chosen?.face === i ? kChosen : judged ? verdict_colours[face.verdict] ?? kWithin : category_colour(i))),
    legend: () => (judged ? ['pass', 'fail', 'not enough data'].map((name) => ({ name: `${name} (${number(verdicts.filter((verdict) => verdict === name).length)})`, rgb: verdict_colours[name] })) : largest_faces(report)),
  });
}

/** The largest faces by name: no legend holds all faces of a part, and colours come back after a while. */
function largest_faces(report) {
  const faces = report.faces.map((face, i) => ({ ...face, i })).filter((face) => face.spots_scanned).sort((a, b) => b.area - a.area || a.i - b.i);
  const entries = faces.slice(0, kFacesInLegend).map(({ name, i }) => ({ name, rgb: category_colour(i) }));
  const left = faces.length - entries.length;
  return left > 0 ? [...entries, { name: `and ${number(left)} smaller`, rgb: [255, 255, 255] }] : entries;
}

/** All modes that this report has data for. */
export function modes_of(report, scene) {
  return [
    scene.deviation && deviation_mode(report, scene), scene.support && coverage_mode(scene), scene.sigma && uncertainty_mode(scene),
    scene.scan && report.scans?.length && scan_mode(report, scene), scene.region && scene.deviation && report.regions && region_mode(report, scene),
    scene.face && report.faces?.length && face_mode(report, scene),
  ].filter(Boolean);
}
