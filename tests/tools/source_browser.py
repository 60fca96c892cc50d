"""Source texts of GLSL and WGSL in a browser: WebGL 2 and WebGPU, with all results of a case read back as float32."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from source_cases import PAIRS, Case
from source_wrappers import parameters, wrapped

FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"),
]
ADDRESS = "http://localhost/"
"""Answered by `opened`: WebGPU wants a page of a secure place."""

COMMON = """
const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const fetched = async (name) => new Float32Array(await (await fetch(`/${name}`)).arrayBuffer());
const text = (values) => {
  let s = '';
  new Uint8Array(values.buffer, values.byteOffset, values.byteLength).forEach((b) => { s += String.fromCharCode(b); });
  return btoa(s);
};
"""
WEBGL = (
    "async ({fragment, width, rows, inputs, tables}) => {"
    + COMMON
    + """
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl || !gl.getExtension('EXT_color_buffer_float')) throw new Error('no WebGL 2 with float targets');
  const program = gl.createProgram();
  const shader = (kind, source) => {
    const s = gl.createShader(kind);
    gl.shaderSource(s, source);
    gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    gl.attachShader(program, s);
  };
  shader(gl.VERTEX_SHADER, `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`);
  shader(gl.FRAGMENT_SHADER, fragment);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  const texture = (unit, name, values, columns) => {
    const lines = Math.ceil(values.length / columns), padded = new Float32Array(columns * lines);
    padded.set(values);
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, columns, lines, 0, gl.RED, gl.FLOAT, padded);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.uniform1i(gl.getUniformLocation(program, name), unit);
  };
  texture(0, 'inputs', floats(inputs), width);
  for (const [i, name] of tables.entries()) texture(i + 1, name, await fetched(name), 2048);
  const target = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + 31);
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, rows);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, width, rows);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const found = new Float32Array(4 * width * rows);
  gl.readPixels(0, 0, width, rows, gl.RGBA, gl.FLOAT, found);
  const error = gl.getError();
  if (error) throw new Error('WebGL error ' + error);
  gl.getExtension('WEBGL_lose_context').loseContext();
  return text(found);
}"""
)
WEBGPU = (
    "async ({code, count, outputs, inputs, tables}) => {"
    + COMMON
    + """
  const adapter = await navigator.gpu.requestAdapter();
  const {maxStorageBuffersPerShaderStage: n} = adapter.limits;
  const device = await adapter.requestDevice({requiredLimits: {maxStorageBuffersPerShaderStage: n}});
  const module = device.createShaderModule({code});
  for (const m of (await module.getCompilationInfo()).messages)
    if (m.type === 'error') throw new Error(`${m.lineNum}: ${m.message}`);
  device.pushErrorScope('validation');
  const compute = {module, entryPoint: 'run'};
  const pipeline = await device.createComputePipelineAsync({layout: 'auto', compute});
  const buffer = (values, usage) => {
    const b = device.createBuffer({size: values.byteLength, usage: usage | GPUBufferUsage.COPY_DST});
    device.queue.writeBuffer(b, 0, values);
    return b;
  };
  const result = buffer(new Float32Array(count * outputs), GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC);
  const back = buffer(new Float32Array(count * outputs), GPUBufferUsage.MAP_READ);
  const bound = (of) => of.map((b, binding) => ({binding, resource: {buffer: b}}));
  const groups = [[buffer(floats(inputs), GPUBufferUsage.STORAGE), result]];
  const read = await Promise.all(tables.map(fetched));
  if (read.length) groups.unshift(read.map((values) => buffer(values, GPUBufferUsage.STORAGE)));
  const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  groups.forEach((of, i) => {
    const group = i + 2 - groups.length;
    pass.setBindGroup(group, device.createBindGroup({layout: pipeline.getBindGroupLayout(group), entries: bound(of)}));
  });
  pass.dispatchWorkgroups(Math.ceil(count / 64));
  pass.end();
  encoder.copyBufferToBuffer(result, 0, back, 0, back.size);
  device.queue.submit([encoder.finish()]);
  const error = await device.popErrorScope();
  if (error) throw new Error(error.message);
  await back.mapAsync(GPUMapMode.READ);
  const found = text(new Float32Array(back.getMappedRange().slice(0)));
  device.destroy();
  return found;
}"""
)


def opened(browser: Any) -> Any:
    """A page on which `run` runs."""
    page = browser.new_page()
    page.set_default_timeout(120_000)
    page.route("**/*", lambda route: route.fulfill(body="<html></html>", content_type="text/html"))
    page.goto(ADDRESS)
    return page


def has_webgpu(page: Any) -> bool:
    """Whether the browser has an adapter for WebGPU."""
    return bool(page.evaluate("async () => !!(navigator.gpu && (await navigator.gpu.requestAdapter()))"))


def run(page: Any, case: Case) -> list[np.ndarray]:
    """The results of every call of a case: (PAIRS, numbers)."""
    columns = [x for call in case.calls for x in call.arguments]
    inputs = np.concatenate([*columns, np.broadcast_to(parameters(case), (PAIRS, len(parameters(case))))], axis=1)
    widths = [sum(call.widths.values()) for call in case.calls]
    sent: dict[str, Any] = {"inputs": _text(inputs), "tables": [t.name for t in case.source.tables]}
    for table in case.source.tables:
        page.route(f"{ADDRESS}{table.name}", partial(_answer, table.values.astype("<f4").tobytes()))
    if case.source.language == "wgsl":
        code = _compute(case, inputs.shape[1], sum(widths))
        back = page.evaluate(WEBGPU, {"code": code, "count": PAIRS, "outputs": sum(widths), **sent})
        found = np.frombuffer(base64.b64decode(back), np.float32).reshape(PAIRS, -1)
    else:
        rows = -(-sum(widths) // 4)
        sent["inputs"] = _text(inputs.T)
        back = page.evaluate(WEBGL, {"fragment": _fragment(case), "width": PAIRS, "rows": rows, **sent})
        read = np.frombuffer(base64.b64decode(back), np.float32).reshape(rows, PAIRS, 4)
        found = read.transpose(1, 0, 2).reshape(PAIRS, -1)[:, : sum(widths)]
    return np.split(found, np.cumsum(widths)[:-1], axis=1)


def _answer(body: bytes, route: Any) -> None:
    route.fulfill(body=body, content_type="application/octet-stream")


def _text(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode()


def _calls(case: Case, entry: str) -> tuple[list[str], list[list[str]]]:
    """Each call with its results stored; `entry`: how an input is read, by its column."""
    blocks, before = [], 0
    place = sum(x.shape[1] for call in case.calls for x in call.arguments)
    texts = []
    for call in case.calls:
        starts = (before + np.cumsum([0, *(x.shape[1] for x in call.arguments)])).tolist()
        given = partial(_given, entry, starts)
        lines, results = wrapped(case, call, given, lambda k: entry.format(place + k))
        before = starts[-1]
        blocks.append(results)
        texts.append("\n".join(lines))
    return texts, blocks


def _given(entry: str, starts: Sequence[int], argument: int, component: int) -> str:
    return entry.format(starts[argument] + component)


def _stored(case: Case, entry: str) -> str:
    """All calls, with results stored in turn in `o`."""
    out, place = "", 0
    for text, results in zip(*_calls(case, entry), strict=True):
        stored = "\n".join(f"o[{place + i}] = {x};" for i, x in enumerate(results))
        out += f"{{\n{text}\n{stored}\n}}\n"
        place += len(results)
    return out


def _fragment(case: Case) -> str:
    """Column i of the picture is pair i, row j holds results 4 j to 4 j + 3."""
    count = sum(sum(call.widths.values()) for call in case.calls)
    chosen = "\n".join(f"if (j == {j}) colour[{i}] = o[{4 * j + i}];" for j in range(-(-count // 4)) for i in range(4))
    return f"""#version 300 es
{case.source.text}
uniform highp sampler2D inputs;
out highp vec4 colour;
void main() {{
int i = int(gl_FragCoord.x), j = int(gl_FragCoord.y);
float o[{4 * -(-count // 4)}];
{_stored(case, "texelFetch(inputs, ivec2(i, {}), 0).r")}
{chosen}
}}
"""


def _compute(case: Case, inputs: int, count: int) -> str:
    entry = f"inputs[{inputs}u * i + {{}}u]"
    stores = _stored(case, entry).replace("o[", f"outputs[{count}u * i + ")
    return f"""{case.source.text}
@group(1) @binding(0) var<storage, read> inputs: array<f32>;
@group(1) @binding(1) var<storage, read_write> outputs: array<f32>;
@compute @workgroup_size(64) fn run(@builtin(global_invocation_id) at: vec3<u32>) {{
let i = at.x;
if (i >= {PAIRS}u) {{ return; }}
{stores}
}}
"""
