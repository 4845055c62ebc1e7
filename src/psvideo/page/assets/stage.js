// Drawing with WebGL2: textures of the current pictures, panes cut out of one canvas, and light read back as floats.
import { VERTEX, fragment } from "./shaders.js";
import { CIVIDIS, INVALID, VALID, VIRIDIS, paletteBytes, paletteOf } from "./palettes.js";
import { lightUniforms } from "./lights.js";

const UNITS = { uMain: 0, uAlbedo: 1, uValid: 2, uPlace: 3, uPalette: 4 };
export const BACKGROUND = [0.165, 0.165, 0.165];

export function openStage(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: false });
  return gl ? new Stage(gl, canvas) : null;
}

class Stage {
  constructor(gl, canvas) {
    this.gl = gl;
    this.canvas = canvas;
    this.floats = gl.getExtension("EXT_color_buffer_float") !== null;
    gl.getExtension("OES_texture_float_linear");
    this.build();
  }

  build() {
    const gl = this.gl;
    this.programs = new Map();
    this.textures = new Map();
    const corners = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.enable(gl.SCISSOR_TEST);
    this.empty = this.colours(new Uint8Array(4), 1);
    this.palettes = new Map([CIVIDIS, VIRIDIS].map((palette) => [palette, this.colours(paletteBytes(palette), 256)]));
  }

  // Take the program for a way of looking into use, made when it is first asked for.
  use(look, linear) {
    const gl = this.gl;
    const way = wayOf(look, linear);
    const name = JSON.stringify(way);
    const known = this.programs.has(name);
    if (!known) this.programs.set(name, { program: linked(gl, way), at: new Map() });
    this.current = this.programs.get(name);
    gl.useProgram(this.current.program);
    if (known) return;
    for (const [sampler, unit] of Object.entries(UNITS)) gl.uniform1i(this.uniform(sampler), unit);
    gl.uniform3fv(this.uniform("uBackground"), BACKGROUND);
    gl.uniform3fv(this.uniform("uValidInk"), VALID);
    gl.uniform3fv(this.uniform("uInvalidInk"), INVALID);
  }

  uniform(name) {
    const { at, program } = this.current;
    if (!at.has(name)) at.set(name, this.gl.getUniformLocation(program, name));
    return at.get(name);
  }

  colours(bytes, width) {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    filtered(gl, gl.LINEAR);
    return texture;
  }

  // The texture of a sequence's current picture; it is sent again only when the picture is another.
  texture(id, block, quick) {
    const gl = this.gl;
    let held = this.textures.get(id);
    if (!held) this.textures.set(id, (held = { texture: gl.createTexture(), size: "", filter: null, block: null }));
    gl.bindTexture(gl.TEXTURE_2D, held.texture);
    const filter = block.half && !quick ? gl.LINEAR : gl.NEAREST;
    if (held.filter !== filter) filtered(gl, filter);
    held.filter = filter;
    if (held.block === block) return held.texture;
    const format = block.channels === 1 ? gl.RED : gl.RGB;
    const inside = block.channels === 1 ? (block.half ? gl.R16F : gl.R32F) : block.half ? gl.RGB16F : gl.RGB32F;
    const type = block.half ? gl.HALF_FLOAT : gl.FLOAT;
    const size = `${block.width}x${block.height}x${block.channels}${block.half}`;
    if (held.size === size) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, block.width, block.height, format, type, block.data);
    } else {
      gl.texImage2D(gl.TEXTURE_2D, 0, inside, block.width, block.height, 0, format, type, block.data);
    }
    held.block = block;
    held.size = size;
    return held.texture;
  }

  resize(width, height) {
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
  }

  clear() {
    const gl = this.gl;
    gl.scissor(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...BACKGROUND, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  // Wait until the renderer has drawn all that it was given: to read a pixel needs it.
  finish() {
    const gl = this.gl;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  // Draw one pane into a rectangle of the canvas in its pixels, from the top left; `cut` is the part that may be drawn.
  draw(look, rect, cut) {
    const gl = this.gl;
    const below = this.canvas.height - rect.y - rect.height;
    gl.viewport(rect.x, below, rect.width, rect.height);
    const seen = withinPicture(look.window, rect, cut);
    if (seen.width <= 0 || seen.height <= 0) return;
    gl.scissor(seen.x, this.canvas.height - seen.y - seen.height, seen.width, seen.height);
    this.set(look, look.window, false);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  set(look, window, linear) {
    const gl = this.gl;
    const { blocks, sequence } = look;
    this.use(look, linear);
    gl.uniform4f(this.uniform("uWindow"), window.x, window.y, window.width, window.height);
    const uses = (name, id) => {
      gl.activeTexture(gl.TEXTURE0 + UNITS[name]);
      gl.bindTexture(gl.TEXTURE_2D, id && blocks[id] ? this.texture(look.from + id, blocks[id], look.quick || look.sharp) : this.empty);
    };
    const relit = look.kind === "relit";
    uses("uMain", relit ? "normals" : look.main);
    uses("uAlbedo", relit ? "albedo" : null);
    uses("uValid", look.markInvalid ? "valid" : null);
    uses("uPlace", relit ? look.place.id : null);
    gl.activeTexture(gl.TEXTURE0 + UNITS.uPalette);
    gl.bindTexture(gl.TEXTURE_2D, this.palettes.get(paletteOf(sequence)));
    gl.uniform1f(this.uniform("uExposure"), look.exposure);
    gl.uniform1f(this.uniform("uYSign"), sequence.y === "down" ? -1 : 1);
    gl.uniformMatrix3fv(this.uniform("uToCamera"), true, look.toCamera);
    gl.uniform3fv(this.uniform("uOrigin"), look.origin);
    gl.uniform1f(this.uniform("uAspect"), look.aspect);
    gl.uniform2f(this.uniform("uRange"), ...look.range);
    gl.uniform3fv(this.uniform("uMiddle"), look.place.middle);
    gl.uniform1f(this.uniform("uScale"), look.place.scale);
    const lights = lightUniforms(look.lights);
    gl.uniform4fv(this.uniform("uLightPlace"), lights.places);
    gl.uniform3fv(this.uniform("uLightColour"), lights.colours);
    gl.uniform1f(this.uniform("uSpecular"), look.specular);
    if (look.around) gl.uniform3fv(this.uniform("uAround"), look.around);
    gl.uniform1f(this.uniform("uExponent"), look.exponent);
  }

  // The surface under the lights as linear light, one pixel per pixel of the normals: { width, height, values (RGBA) }.
  relitValues(look) {
    const gl = this.gl;
    const { width, height } = look.blocks.normals;
    const target = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + 7);
    gl.bindTexture(gl.TEXTURE_2D, target);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
    const buffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, 0, width, height);
    this.set(look, { x: 0, y: 1, width: 1, height: -1 }, true); // the first row read is the top one
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const values = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, values);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(buffer);
    gl.deleteTexture(target);
    return { width, height, values };
  }
}

// The part of a cut that the picture covers: what lies around it is background already.
function withinPicture(window, rect, cut) {
  const left = Math.max(cut.x, Math.floor(rect.x - window.x / window.width * rect.width));
  const top = Math.max(cut.y, Math.floor(rect.y - window.y / window.height * rect.height));
  const right = Math.min(cut.x + cut.width, Math.ceil(rect.x + (1 - window.x) / window.width * rect.width));
  const bottom = Math.min(cut.y + cut.height, Math.ceil(rect.y + (1 - window.y) / window.height * rect.height));
  return { x: left, y: top, width: right - left, height: bottom - top };
}

function filtered(gl, filter) {
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
}

// What of a look is written into its program: see shaders.js.
function wayOf(look, linear) {
  const { kind, blocks, lights } = look;
  const relit = kind === "relit";
  const near = relit && lights.some((light) => light.near);
  return {
    kind, linear, grey: blocks[relit ? "albedo" : look.main]?.channels === 1, channels: look.channels,
    albedo: Boolean(blocks.albedo), valid: look.markInvalid && kind !== "mask" && !linear, place: near ? look.place.kind : 0,
    lights: relit ? lights.length : 0, near, shine: relit && look.specular > 0,
    around: relit && Boolean(look.around),
  };
}

function linked(gl, way) {
  const program = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment(way)]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, "corner");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`the picture's program does not compile: ${logs.join(" ")} ${gl.getProgramInfoLog(program)}`);
  }
  return program;
}
