// The terrain's material: its baked colours as they are, the rover's shadow, and a fine grain that the grid is too coarse for.
import { THREE } from "./three.js";

const NOISE = `
varying vec2 vGround;
uniform vec2 uSun; uniform float uGrain;
float soilHash(vec2 p) { vec3 q = fract(vec3(p.xyx) * .1031); q += dot(q, q.yzx + 33.33); return fract((q.x + q.y) * q.z); }
float soilNoise(vec2 p) {
  vec2 i = floor(p), f = fract(p); f = f * f * (3. - 2. * f);
  return mix(mix(soilHash(i), soilHash(i + vec2(1., 0.)), f.x), mix(soilHash(i + vec2(0., 1.)), soilHash(i + vec2(1., 1.)), f.x), f.y);
}
float soilBump(vec2 p, float size) { return soilNoise(p / size) - soilNoise(p / size + uSun * .55); }
`;
const GRAIN = `
float pixel = length(fwidth(vGround)) * .7071;
float fine = uGrain * .016, coarse = uGrain * .23;
float light = .34 * soilBump(vGround, fine) * (1. - smoothstep(.25 * fine, 1.2 * fine, pixel))
            + .12 * soilBump(vGround + 3.1, coarse) * (1. - smoothstep(.25 * coarse, 1.2 * coarse, pixel));
diffuseColor.rgb *= 1. - light;
`;

export function soilMaterial(toSun, level, { grain = true, coloured = true } = {}) {
  const material = new THREE.MeshLambertMaterial({ vertexColors: coloured });
  material.color.setScalar(0.88 / level);
  material.onBeforeCompile = shader => {
    shader.uniforms.uSun = { value: new THREE.Vector2(toSun.x, toSun.y).normalize() };
    shader.uniforms.uGrain = { value: 1 };
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec2 vGround;")
      .replace("#include <beginnormal_vertex>", "vec3 objectNormal = vec3(0., 0., 1.);") // its light is baked: every place is lit as level ground
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvGround = (modelMatrix * vec4(transformed, 1.)).xy;");
    if (grain) {
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>\n${NOISE}`)
        .replace("#include <color_fragment>", `#include <color_fragment>\n${GRAIN}`);
    }
  };
  return material;
}
