// What the graphics processor runs. Every way of looking gets a program of its own, with what does not change written in
// as numbers: software rendering runs through all branches of a program, whichever is taken.

export const VERTEX = `#version 300 es
in vec2 corner;
uniform vec4 uWindow; // the part of the picture that is seen: left, top, width, height, in shares of the picture
out vec2 vAt;
void main() {
  vec2 share = corner * 0.5 + 0.5;
  vAt = uWindow.xy + vec2(share.x, 1.0 - share.y) * uWindow.zw;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

// `way`: kind (one of KINDS), grey (the albedo, where it is relit), channels, linear, albedo, valid, place (0 a plane,
// 1 points, 2 depth), lights (their number), near (whether any is), shine (whether there are highlights), around
// (whether light comes from all around).
export function fragment(way) {
  return `#version 300 es
precision highp float;
precision highp sampler2D;
in vec2 vAt;
out vec4 pixel;
uniform float uExposure;
uniform float uYSign; // -1 where y points down in the file
uniform mat3 uToCamera; // from the frame of the file's vectors to the camera's
uniform vec3 uOrigin; // the camera's place in that frame
uniform float uAspect; // height over width
uniform vec2 uRange;
uniform vec3 uBackground, uValidInk, uInvalidInk;
uniform sampler2D uMain, uAlbedo, uValid, uPlace, uPalette;
uniform vec3 uMiddle; // of the points; of depth its median in x
uniform float uScale; // points per width of the picture; for depth how deep the relief is
uniform vec4 uLightPlace[8];
uniform vec3 uLightColour[8];
uniform float uSpecular, uExponent;
uniform vec3 uAround[9];
${SRGB}
vec3 chosen(vec3 light) {
  return ${["light", "light.rrr", "light.ggg", "light.bbb", "vec3(dot(light, vec3(0.2126, 0.7152, 0.0722)))"][way.channels]};
}
${way.kind === "relit" ? relitText(way) : ""}
${way.valid ? GAP : ""}
void main() {
  ${way.kind === "relit" ? "" : `vec4 value = texture(uMain, vAt)${way.grey ? ".rrra" : ""};`}
  vec3 shown = ${SHOWN[way.kind](way)};
  ${way.valid ? HATCH : ""}
  pixel = vec4(shown, 1.0);
}`;
}

const SHOWN = {
  light: () => "srgb(chosen(value.rgb * uExposure))",
  normals: () => "chosen(0.5 + 0.5 * value.xyz)",
  mask: () => "mix(uInvalidInk, uValidInk, clamp(value.x, 0.0, 1.0))",
  heat: () => `value.x == 0.0 ? uBackground
    : texture(uPalette, vec2(clamp((value.x - uRange.x) / max(uRange.y - uRange.x, 1e-9), 0.002, 0.998), 0.5)).rgb`,
  position: () => "value.xyz == vec3(0.0) ? uBackground : chosen(clamp(0.5 + (value.xyz - uMiddle) / uScale, 0.0, 1.0))",
  relit: (way) => (way.linear ? "relit(vAt)" : "srgb(chosen(relit(vAt) * uExposure))"),
};

// Where nothing is shown a gap of the subject is hatched: something is shown to all four sides. What is around is not.
const GAP = `bool isShown(vec2 at) { return texture(uMain, at).rgb != vec3(0.0); }
bool isBeside(vec2 way) {
  for (float far = 1.0; far <= 1024.0; far *= 1.5) {
    vec2 at = vAt + far * way;
    if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return false;
    if (isShown(at)) return true;
  }
  return false;
}
bool inGap() {
  vec2 step = 1.0 / vec2(textureSize(uMain, 0));
  return isBeside(vec2(step.x, 0.0)) && isBeside(vec2(-step.x, 0.0))
    && isBeside(vec2(0.0, step.y)) && isBeside(vec2(0.0, -step.y));
}`;
const HATCH = `if (texture(uValid, vAt).x < 0.5 && (isShown(vAt) || inGap())) {
    float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 12.0));
    shown = mix(shown, mix(uInvalidInk, uValidInk, stripe), 0.55);
  }`;

// IEC 61966-2-1, its power fitted by roots, which cost less: off by a hundredth of an 8-bit step.
const SRGB = `vec3 srgb(vec3 light) {
  light = clamp(light, 0.0, 1.0);
  vec3 root = sqrt(light), fourth = sqrt(root), eighth = sqrt(fourth);
  vec3 power = 0.65395650 * root + 0.68878216 * fourth - 0.31853384 * eighth - 0.02018341 * light - 0.0040528;
  return mix(power, 12.92 * light, vec3(lessThanEqual(light, vec3(0.0031308))));
}`;

// See around.js.
const AROUND_TEXT = `light += albedo * max(uAround[0] + uAround[1] * n.y + uAround[2] * n.z + uAround[3] * n.x
    + uAround[4] * (n.x * n.y) + uAround[5] * (n.y * n.z) + uAround[6] * (3.0 * n.z * n.z - 1.0)
    + uAround[7] * (n.x * n.z) + uAround[8] * (n.x * n.x - n.y * n.y), 0.0);`;

function relitText(way) {
  return `
vec3 pointAt(vec2 at) {
  vec2 level = vec2(at.x - 0.5, (0.5 - at.y) * uAspect);
  ${way.place === 1 ? "return (uToCamera * (texture(uPlace, at).xyz * vec3(1.0, uYSign, 1.0) - uOrigin) - uMiddle) / uScale;" : ""}
  ${way.place === 2 ? `float depth = texture(uPlace, at).x;
  return vec3(level, depth == 0.0 ? 0.0 : -(depth - uMiddle.x) / uMiddle.x * uScale);` : ""}
  ${way.place === 0 ? "return vec3(level, 0.0);" : ""}
}

vec3 relit(vec2 at) {
  vec3 n = texture(uMain, at).xyz * vec3(1.0, uYSign, 1.0);
  float size = length(n);
  n = uToCamera * (n / max(size, 1e-6));
  vec3 albedo = ${way.albedo ? `texture(uAlbedo, at)${way.grey ? ".rrr" : ".rgb"}` : "vec3(0.7)"};
  ${way.near ? "vec3 place = pointAt(at);" : ""}
  vec3 light = vec3(0.0);
  ${Array.from({ length: way.lights }, (_, index) => lightText(way, index)).join("\n  ")}
  ${way.around ? AROUND_TEXT : ""}
  return size < 0.5 ? vec3(0.0) : light;
}`;
}

function lightText(way, index) {
  return `{
    vec3 l = uLightPlace[${index}].xyz;
    float strength = 1.0;
    ${way.near ? `float reach = uLightPlace[${index}].w;
    if (reach > 0.0) {
      vec3 away = l * reach - place;
      float far = max(length(away), 1e-4);
      l = away / far;
      strength = reach * reach / (far * far);
    }` : ""}
    float facing = dot(n, l);
    vec3 given = albedo * max(facing, 0.0);
    ${way.shine ? `vec3 between = l + vec3(0.0, 0.0, 1.0);
    float shine = uSpecular * pow(max(dot(n, between / max(length(between), 1e-6)), 0.0), uExponent);
    given += facing > 0.0 ? shine : 0.0;` : ""}
    light += uLightColour[${index}] * strength * given;
  }`;
}
