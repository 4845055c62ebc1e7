// What the graphics processor runs: one program shows any quantity, and the surface under new lights.

export const VERTEX = `#version 300 es
in vec2 corner;
uniform vec4 uWindow; // the part of the picture that is seen: left, top, width, height, in shares of the picture
out vec2 vAt;
void main() {
  vec2 share = corner * 0.5 + 0.5;
  vAt = uWindow.xy + vec2(share.x, 1.0 - share.y) * uWindow.zw;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
in vec2 vAt;
out vec4 pixel;
uniform int uKind; // 0 light, 1 normals, 2 mask, 3 heat, 4 position, 5 the surface under new lights
uniform bool uLinear; // give linear light as it is, for reading back
uniform bool uGrey; // the main texture has one channel
uniform bool uMarkInvalid;
uniform int uChannels; // 0 all, 1 to 3 one of them, 4 luminance
uniform float uExposure;
uniform float uYSign; // -1 where y points down in the file
uniform mat3 uToCamera; // from the frame of the file's vectors to the camera's
uniform vec3 uOrigin; // the camera's place in that frame
uniform float uAspect; // height over width
uniform vec2 uRange;
uniform vec3 uBackground, uValidInk, uInvalidInk;
uniform sampler2D uMain, uAlbedo, uValid, uPlace, uPalette;
uniform bool uHasAlbedo, uHasValid;
uniform int uPlaceKind; // 0 none: a plane; 1 points; 2 depth
uniform vec3 uMiddle; // of the points; of depth its median in x
uniform float uScale; // points per width of the picture; for depth how deep the relief is
uniform int uLightCount;
uniform vec4 uLightPlace[8];
uniform vec3 uLightColour[8];
uniform float uSpecular, uExponent;

vec3 srgb(vec3 light) {
  light = clamp(light, 0.0, 1.0);
  return mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, 12.92 * light, vec3(lessThanEqual(light, vec3(0.0031308))));
}

vec3 chosen(vec3 light) {
  if (uChannels == 4) return vec3(dot(light, vec3(0.2126, 0.7152, 0.0722)));
  return uChannels == 0 ? light : vec3(light[uChannels - 1]);
}

vec3 pointAt(vec2 at) {
  vec2 flat_ = vec2(at.x - 0.5, (0.5 - at.y) * uAspect);
  if (uPlaceKind == 0) return vec3(flat_, 0.0);
  vec4 found = texture(uPlace, at);
  if (uPlaceKind == 2) return vec3(flat_, found.x == 0.0 ? 0.0 : -(found.x - uMiddle.x) / uMiddle.x * uScale);
  vec3 place = uToCamera * (found.xyz * vec3(1.0, uYSign, 1.0) - uOrigin);
  return (place - uMiddle) / uScale;
}

vec3 relit(vec2 at) {
  vec3 n = texture(uMain, at).xyz * vec3(1.0, uYSign, 1.0);
  float size = length(n);
  if (size < 0.5) return vec3(0.0);
  n = uToCamera * (n / size);
  vec3 albedo = uHasAlbedo ? texture(uAlbedo, at).rgb : vec3(0.7);
  vec3 place = pointAt(at);
  vec3 light = vec3(0.0);
  for (int index = 0; index < uLightCount; index++) {
    vec3 l = uLightPlace[index].xyz;
    float reach = uLightPlace[index].w;
    float strength = 1.0;
    if (reach > 0.0) {
      vec3 away = l * reach - place;
      float far = max(length(away), 1e-4);
      l = away / far;
      strength = reach * reach / (far * far);
    }
    float facing = dot(n, l);
    if (facing <= 0.0) continue;
    float shine = 0.0;
    if (uSpecular > 0.0) {
      vec3 between = l + vec3(0.0, 0.0, 1.0);
      shine = uSpecular * pow(max(dot(n, between / max(length(between), 1e-6)), 0.0), uExponent);
    }
    light += uLightColour[index] * strength * (albedo * facing + shine);
  }
  return light;
}

void main() {
  if (any(lessThan(vAt, vec2(0.0))) || any(greaterThan(vAt, vec2(1.0)))) {
    pixel = vec4(uBackground, 1.0);
    return;
  }
  if (uKind == 5 && uLinear) {
    pixel = vec4(relit(vAt), 1.0);
    return;
  }
  vec3 shown;
  vec4 value = texture(uMain, vAt);
  if (uGrey) value.rgb = value.rrr;
  if (uKind == 5) shown = srgb(chosen(relit(vAt) * uExposure));
  else if (uKind == 0) shown = srgb(chosen(value.rgb * uExposure));
  else if (uKind == 1) shown = chosen(0.5 + 0.5 * value.xyz);
  else if (uKind == 2) shown = mix(uInvalidInk, uValidInk, clamp(value.x, 0.0, 1.0));
  else if (uKind == 3) shown = value.x == 0.0 ? uBackground
    : texture(uPalette, vec2(clamp((value.x - uRange.x) / max(uRange.y - uRange.x, 1e-9), 0.002, 0.998), 0.5)).rgb;
  else shown = value.xyz == vec3(0.0) ? uBackground : chosen(clamp(0.5 + (value.xyz - uMiddle) / uScale, 0.0, 1.0));
  if (uMarkInvalid && uHasValid && uKind != 2 && texture(uValid, vAt).x < 0.5) {
    float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 12.0));
    shown = mix(shown, mix(uInvalidInk, uValidInk, stripe), 0.55);
  }
  pixel = vec4(shown, 1.0);
}`;
