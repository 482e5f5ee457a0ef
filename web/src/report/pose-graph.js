// SPDX-License-Identifier: Apache-2.0
// The pose graph of the report, with what its lines mean.
import { category_colour, css_colour } from '../shared/colours.js';
import { h } from '../shared/dom.js';
import { graph_picture } from '../shared/graph.js';
import { plural } from '../shared/format.js';

export function pose_graph(report, scene) {
  const nodes_of = (report.graph?.components ?? []).flat();
  if (nodes_of.length < 2) return null;
  const centre = scene?.box.centre ?? [0, 1, 2].map((k) => (report.model.box.min[k] + report.model.box.max[k]) / 2);
  const viewpoints = new Map((scene?.poses ?? []).map((pose) => [pose.scan, pose.viewpoint]));
  const by_index = new Map(report.scans.map((scan) => [scan.index, scan]));
  const name = (index) => by_index.get(index)?.name ?? `scan ${index}`;
  const pieces = report.graph.components;
  const nodes = nodes_of.map((index) => ({
    id: index, label: String(index), title: `${name(index)}${pieces.length > 1 ? `, piece ${pieces.findIndex((piece) => piece.includes(index)) + 1}` : ''}`,
    at: viewpoints.get(index)?.map((value, k) => value - centre[k]) ?? null,
    colour: css_colour(pieces.length > 1 ? category_colour(3 * pieces.findIndex((piece) => piece.includes(index))) : [44, 84, 128]),
  }));
  const links = report.graph.links.map((link) => ({ from: link.a, to: link.b, overlap: link.overlap, linked: link.linked, title: `${name(link.a)} and ${name(link.b)}` }));
  const used = links.filter((link) => link.linked).length;
  const said = pieces.length > 1 ? `The scans fall into ${pieces.length} pieces that share too little surface; each piece was fitted to the model on its own.` : `All ${nodes.length} scans hang together.`;
  return h('figure', { class: 'graph-figure' }, graph_picture({ nodes, links, surface: scene }),
    h('figcaption', null, `${said} ${plural(used, 'link')}; the wider, the more surface two scans share. Thin dashes: overlaps too small to be used. Sensors stand in their true direction from the part (grey), seen along the axis in which they differ least.`));
}
