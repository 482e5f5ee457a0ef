// SPDX-License-Identifier: Apache-2.0
// One material for all colourings: a value a vertex, looked up in a table of colours; hatched where nothing is known.
import { DataTexture, FrontSide, DoubleSide, GLSL3, NearestFilter, RawShaderMaterial, RGBAFormat, UnsignedByteType, Vector3 } from 'three';

// `datum` is (value * known, known): interpolated across a triangle with unknown corners, their quotient is the mean of
// the corners that are known. Categories are taken from one corner of the triangle instead.
// Light is computed a vertex: the surface is fine, and software renderers pay for every number interpolated.
const vertex_shader = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform mat3 normalMatrix;
in vec3 position;
in vec4 normal;
in vec2 datum;
out vec3 shown;  // datum, light
#ifdef CATEGORIES
flat out vec2 category;
#endif
void main() {
  float facing = dot(normalize(normalMatrix * normal.xyz), vec3(-0.28, 0.42, 0.863));
  shown = vec3(datum, facing);
#ifdef CATEGORIES
  category = datum;
#endif
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
}`;

const fragment_shader = `
precision highp float;
uniform sampler2D table;
uniform float low, high, hatch;
uniform vec3 unknown_a, unknown_b;
in vec3 shown;
#ifdef CATEGORIES
flat in vec2 category;
#endif
out vec4 colour;
void main() {
#ifdef CATEGORIES
  vec2 datum = category;
#else
  vec2 datum = shown.xy;
#endif
  vec3 base;
  if (datum.y < 0.5) {
    base = fract((gl_FragCoord.x + gl_FragCoord.y) / hatch) < 0.5 ? unknown_a : unknown_b;
  } else {
    base = texture(table, vec2(clamp((datum.x / datum.y - low) / (high - low), 0.0, 1.0), 0.5)).rgb;
  }
  float light = gl_FrontFacing ? 0.74 + 0.26 * max(0.0, shown.z) : 0.44 + 0.16 * max(0.0, -shown.z);
  colour = vec4(base * light, 1.0);
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
    defines: {},
    vertexShader: vertex_shader,
    fragmentShader: fragment_shader,
    side: open ? DoubleSide : FrontSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      table: { value: table_texture(new Uint8Array(4)) },
      low: { value: 0 }, high: { value: 1 }, hatch: { value: 9 },
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
  if (categories !== ('CATEGORIES' in material.defines)) {
    material.defines = categories ? { CATEGORIES: '' } : {};
    material.needsUpdate = true;
  }
  if (unknown) {
    uniforms.unknown_a.value.fromArray(unknown[0]).divideScalar(255);
    uniforms.unknown_b.value.fromArray(unknown[1]).divideScalar(255);
  }
}
