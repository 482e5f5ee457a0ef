// SPDX-License-Identifier: Apache-2.0
// One material for all colourings: a value a vertex, looked up in a table of colours; hatched where nothing is known.
import { DataTexture, FrontSide, DoubleSide, GLSL3, NearestFilter, RawShaderMaterial, RGBAFormat, UnsignedByteType, Vector3 } from 'three';

// `datum` is (value * known, known): interpolated across a triangle with unknown corners, their quotient is the mean of
// the corners that are known. Categories are taken from one corner of the triangle instead.
const vertex_shader = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform mat3 normalMatrix;
in vec3 position;
in vec4 normal;
in vec2 datum;
out vec3 shade_normal;
out vec2 smooth_datum;
flat out vec2 flat_datum;
void main() {
  shade_normal = normalMatrix * normal.xyz;
  smooth_datum = datum;
  flat_datum = datum;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const fragment_shader = `
precision highp float;
uniform sampler2D table;
uniform float low, high, hatch;
uniform bool categories;
uniform vec3 unknown_a, unknown_b;
in vec3 shade_normal;
in vec2 smooth_datum;
flat in vec2 flat_datum;
out vec4 colour;
void main() {
  vec2 datum = categories ? flat_datum : smooth_datum;
  vec3 base;
  if (datum.y < 0.5) {
    base = fract((gl_FragCoord.x + gl_FragCoord.y) / hatch) < 0.5 ? unknown_a : unknown_b;
  } else {
    base = texture(table, vec2(clamp((datum.x / datum.y - low) / (high - low), 0.0, 1.0), 0.5)).rgb;
  }
  vec3 n = normalize(shade_normal);
  float facing = gl_FrontFacing ? 1.0 : -1.0;
  float light = 0.74 + 0.26 * max(0.0, dot(n * facing, vec3(-0.28, 0.42, 0.863)));
  colour = vec4(base * light * (gl_FrontFacing ? 1.0 : 0.6), 1.0);
}`;

function table_texture(texels) {
  const texture = new DataTexture(texels, texels.length / 4, 1, RGBAFormat, UnsignedByteType);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

export function surface_material({ open = false } = {}) {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: vertex_shader,
    fragmentShader: fragment_shader,
    side: open ? DoubleSide : FrontSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      table: { value: table_texture(new Uint8Array(4)) },
      low: { value: 0 }, high: { value: 1 }, hatch: { value: 9 }, categories: { value: false },
      unknown_a: { value: new Vector3(0.604, 0.62, 0.64) }, unknown_b: { value: new Vector3(0.7, 0.714, 0.733) },
    },
  });
}

/** `colouring`: {texels, low, high, categories, unknown: [rgb, rgb]}. The old table is freed if its size changes. */
export function apply_colouring(material, { texels, low, high, categories = false, unknown }) {
  const uniforms = material.uniforms;
  const old = uniforms.table.value;
  if (old.image.data.length === texels.length) {
    old.image.data.set(texels);
    old.needsUpdate = true;
  } else {
    old.dispose();
    uniforms.table.value = table_texture(texels);
  }
  uniforms.low.value = low;
  uniforms.high.value = high;
  uniforms.categories.value = categories;
  if (unknown) {
    uniforms.unknown_a.value.fromArray(unknown[0]).divideScalar(255);
    uniforms.unknown_b.value.fromArray(unknown[1]).divideScalar(255);
  }
}
